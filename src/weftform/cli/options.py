"""Arguments and options that several verbs share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

StudyName = Annotated[
    str, typer.Argument(metavar="STUDY", help="A TOML file, or the name of a shipped study (see `weftform studies`).")
]
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a value of the study, e.g. --set blank.warp_angle_deg=45"),
]
ResultFolder = Annotated[Path, typer.Argument(metavar="DIR", help="A result folder written by `weftform run`.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
