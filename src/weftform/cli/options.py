"""Arguments and options that several verbs share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from weftform.errors import MeasurementError

StudyName = Annotated[
    str, typer.Argument(metavar="STUDY", help="A TOML file, or the name of a shipped study (see `weftform studies`).")
]
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a value of the study, e.g. --set blank.warp_angle_deg=45"),
]
ResultFolder = Annotated[Path, typer.Argument(metavar="DIR", help="A result folder written by `weftform run`.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]


def pairs_of(texts: Sequence[str] | None, option: str, example: str) -> dict[str, str]:
    """Names and values of a repeated option.

    Raises
    ------
    MeasurementError
        One is not of the form NAME=VALUE, or a name is given twice.
    """
    pairs: dict[str, str] = {}
    for text in texts or ():
        key, equals, value = (part.strip() for part in text.partition("="))
        if not (equals and key and value):
            raise MeasurementError("not of the form NAME=VALUE", key=option, expected=f"{option} {example}", got=text)
        if key in pairs:
            raise MeasurementError(f"{key} is given twice", key=option, expected="once", got=f"{pairs[key]}, {value}")
        pairs[key] = value
    return pairs
