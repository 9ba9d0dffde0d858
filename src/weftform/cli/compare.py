"""``weftform compare``: simulation beside experiment."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from weftform.cli.options import AsJson, ResultFolder, pairs_of

if TYPE_CHECKING:
    from weftform.comparison import Comparison
    from weftform.laboratory import Reading


class Way(StrEnum):
    """What places the measured axes."""

    OUTLINE = "outline"
    MARKERS = "markers"


def compare(
    folder: ResultFolder,
    outline: Annotated[
        Path | None,
        typer.Option("--outline", metavar="FILE", help="Points around the formed part: x_mm, y_mm."),
    ] = None,
    angles: Annotated[
        Path | None,
        typer.Option(
            "--angles", metavar="FILE", help="Shear angles: name, angle_deg, and u_mm, v_mm or x_mm, y_mm; scatter_deg."
        ),
    ] = None,
    curve: Annotated[
        list[Path] | None,
        typer.Option("--curve", metavar="FILE", help="Force curve: displacement_mm, force_N. Repeat for specimens."),
    ] = None,
    markers: Annotated[
        Path | None,
        typer.Option("--markers", metavar="FILE", help="Markers: marker, x_mm, y_mm, z_mm, u_mm, v_mm, image."),
    ] = None,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            "--tolerance",
            metavar="NAME=LIMIT",
            help="outline, outline-mean, outline-x, outline-y, hausdorff, angle, angle-mean, curve, curve-rms, marker or "
            "marker-mean, e.g. outline=2, angle=3, curve=5%. Repeatable.",
        ),
    ] = None,
    stroke: Annotated[
        float | None, typer.Option(metavar="S", help="Compare the kept instant nearest to S mm; default the end.")
    ] = None,
    scale: Annotated[bool, typer.Option("--scale", help="Find a scale of the measured positions as well.")] = False,
    register_by: Annotated[
        Way | None, typer.Option("--register-by", help="What places the measured axes; default the outline.")
    ] = None,
    no_registration: Annotated[
        bool, typer.Option("--no-registration", help="Measured positions are in the axes of the press already.")
    ] = False,
    signed: Annotated[bool, typer.Option("--signed", help="Compare shear angles with their signs.")] = False,
    column: Annotated[
        list[str] | None,
        typer.Option("--column", help="Column of a quantity: x=HEADER, or of one file: outline.x=HEADER. Repeatable."),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option("--unit", help="Unit where a file has none: x=cm, curve.force=kN. Repeatable."),
    ] = None,
    zero: Annotated[
        bool, typer.Option("--zero", help="Shift each force curve so that it starts at the origin.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Where to write; default DIR/comparison.")
    ] = None,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Do not draw the figures.")] = False,
    as_json: AsJson = False,
) -> None:
    """Lay measurements of the formed part over the simulation: outline, shear angles, force, markers.

    Writes comparison.json and figures. Exits 1 where a tolerance is not kept.

    Example: weftform compare results/first --outline measured.csv --angles points.csv --tolerance outline=2
    """
    from weftform.comparison import compare as compute
    from weftform.errors import MeasurementError

    if no_registration and register_by is not None:
        raise MeasurementError("--register-by and --no-registration exclude each other", expected="one of them")
    found = compute(
        folder,
        outline=outline,
        angles=angles,
        curve=curve or (),
        markers=markers,
        stroke=stroke,
        scale=scale,
        register_by="none" if no_registration else None if register_by is None else register_by.value,
        signed_angles=signed,
        tolerances=pairs_of(tolerance, "--tolerance", "outline=2"),
        readings=_readings(pairs_of(column, "--column", "outline.x=HEADER"), pairs_of(unit, "--unit", "x=cm"), zero),
    )
    written = found.write(out, figures=not no_figures)
    if as_json:
        typer.echo(found.to_json())
    else:
        _show(found)
        for file in written:
            typer.echo(f"wrote      {file}")
    for warning in found.warnings:
        typer.secho(f"note       {warning}", err=True)
    if found.ok is False:
        raise typer.Exit(1)


def _readings(columns: dict[str, str], units: dict[str, str], zero: bool) -> dict[str, Reading]:
    """How each file is read: what names no file holds for all."""
    from weftform.comparison.comparison import ITEMS
    from weftform.errors import MeasurementError
    from weftform.laboratory import Reading

    for option, given in (("--column", columns), ("--unit", units)):
        for key in given:
            item, dot, _ = key.partition(".")
            if dot and item not in ITEMS:
                raise MeasurementError(
                    f'no file "{item}" is compared', key=option, expected=", ".join(ITEMS), got=f"{key}={given[key]}"
                )

    def of(item: str, given: dict[str, str]) -> dict[str, str]:
        everywhere = {key: value for key, value in given.items() if "." not in key}
        own = {key.partition(".")[2]: value for key, value in given.items() if key.startswith(f"{item}.")}
        return everywhere | own

    return {item: Reading(columns=of(item, columns), units=of(item, units), zero=zero) for item in ITEMS}


def _show(found: Comparison) -> None:
    """The numbers as a table, one row each, with the verdict where there is a tolerance."""
    from rich.console import Console
    from rich.table import Table

    from weftform.comparison.summary import rows

    console = Console(width=None if Console().is_terminal else 100)
    typer.echo(f"{found.result.study.name} at {found.stroke_mm:.4g} mm.  {found.placement.words()}")
    table = Table("", "what", "value", "tolerance", "verdict", show_edge=False, pad_edge=False)
    for row in rows(found):
        verdict = "" if row.ok is None else "within" if row.ok else "OUT OF TOLERANCE"
        style = None if row.ok is None else "green" if row.ok else "bold red"
        table.add_row(row.item, row.what, row.value, row.tolerance, f"[{style}]{verdict}[/]" if style else "")
    console.print(table)
