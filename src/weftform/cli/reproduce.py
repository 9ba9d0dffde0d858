"""``weftform reproduce``: everything the paper reports, computed and compared."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import Annotated

import typer

from weftform.cli.options import AsJson


def reproduce(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where to write the report and the runs.")] = Path(
        "results/reproduction"
    ),
    as_json: AsJson = False,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Do not draw the figures.")] = False,
) -> None:
    """Run everything the paper reports, print it beside the paper's numbers and write reproduction.md and .json.

    Takes a few minutes on two cores. Exits 1 where an item that must agree does not.
    """
    from rich.console import Console
    from rich.table import Table

    from weftform.reproduction import reproduce as compute
    from weftform.reproduction.reproduce import HEADER

    notes = Console(stderr=True)

    def watch(name: str, done: int, count: int) -> None:
        if notes.is_terminal:
            notes.print(f"{done:3d} of {count}  {name}")

    found = compute(out, figures=not no_figures, watch=watch)
    if as_json:
        typer.echo(found.to_json())
    else:
        console = Console(width=None if Console().is_terminal else 160)
        for section, members in groupby(found.items, key=lambda item: item.section):
            table = Table(*HEADER, title=section, title_justify="left", expand=True)
            for item in members:
                table.add_row(*item.cells(), style="red" if item.agrees is False else None)
            console.print(table)
        typer.echo(f"report     {out / 'reproduction.md'} ({found.seconds:.0f} s)")
        for item in found.disagreeing:
            typer.secho(f"disagrees  {item.what}", fg="red", err=True)
    if not found.ok:
        raise typer.Exit(1)
