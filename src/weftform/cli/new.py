"""``weftform new``: write a study to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

TEMPLATES = {"hemisphere": "hemisphere-0-90"}
"""Short names of the shipped studies to start from; every shipped name works too."""


def new(
    template: Annotated[
        str,
        typer.Argument(metavar="TEMPLATE", help="hemisphere, or the name of any shipped study (`weftform studies`)."),
    ],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The TOML file to write.")],
) -> None:
    """Write a commented study to start from. Example: weftform new hemisphere my.toml"""
    import difflib
    import json

    from weftform.errors import StudyError
    from weftform.study.shipped import shipped_studies

    shipped = shipped_studies()
    name = TEMPLATES.get(template, template)
    if name not in shipped:
        names = [*TEMPLATES, *shipped]
        close = difflib.get_close_matches(template, names, 1, 0.4)
        raise StudyError(
            f'no template named "{template}"',
            expected="one of " + ", ".join(names),
            hint=f"did you mean {close[0]}?" if close else None,
        )
    if file.exists():
        raise StudyError("the file exists and is left as it is", file=file, hint="choose another name")
    text = (
        shipped[name]
        .read_text(encoding="utf-8")
        .replace(f"weftform run {name} --out results/{name}", f"weftform run {file.name} --out results/{file.stem}")
        .replace(f'name = "{name}"', f"name = {json.dumps(file.stem)}")
    )
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as problem:
        raise StudyError(f"cannot be written ({problem.strerror})", file=file) from None
    typer.echo(f"wrote {file}\nnext: weftform check {file}, then weftform run {file} --out results/{file.stem}")
