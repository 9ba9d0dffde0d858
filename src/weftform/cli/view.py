"""``weftform view``: a result in three dimensions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def view(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Result folder written by `weftform run`.")],
    stroke: Annotated[
        float | None, typer.Option(help="Show the computed instant nearest to this stroke (mm); the end without.")
    ] = None,
    png: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a picture to this file and open no window.")
    ] = None,
    field: Annotated[
        str, typer.Option(help="What colours the cells: shear, warp-force, weft-force, warp-strain or weft-strain.")
    ] = "shear",
) -> None:
    """Show the formed part in three dimensions: a window with a slider, or a picture where there is no display."""
    from weftform.report.view3d import has_display, render_window, show
    from weftform.result import Result

    result = Result.open(folder)
    shown = show(result, result.frame_at(stroke), png, field=field)
    if shown.file is None:
        return
    if png is None:
        why = "no display" if not has_display() else "no window can be opened"
        typer.echo(f"{why}: wrote a picture instead", err=True)
    if shown.by == "matplotlib" and not render_window():
        typer.echo(
            "drawn without pyvista: `pip install 'weftform[view]'` adds tools and an interactive window", err=True
        )
    typer.echo(str(shown.file))
