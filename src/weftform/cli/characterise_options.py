"""Options, messages and card writing that the characterise commands share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from weftform.cli.options import pairs_of
from weftform.errors import MeasurementError, WeftformError

if TYPE_CHECKING:
    from weftform.laboratory import MarkerTracking, Reading
    from weftform.laboratory.fitting import PolynomialFit
    from weftform.laboratory.shear import ShearCurve
    from weftform.laboratory.tabulating import TableFit


class DirectionChoice(StrEnum):
    """Which yarns lie along the pull."""

    WARP = "warp"
    WEFT = "weft"
    BOTH = "both"


class LawChoice(StrEnum):
    """Form of the law."""

    POLYNOMIAL = "polynomial"
    TABULATED = "tabulated"


class WeightingChoice(StrEnum):
    """Size of the errors along the curve."""

    UNIFORM = "uniform"
    RELATIVE = "relative"


class AngleChoice(StrEnum):
    """Shear angle of a bias-extension law."""

    AUTO = "auto"
    KINEMATIC = "kinematic"
    MEASURED = "measured"


class LockingChoice(StrEnum):
    """Criterion of the locking angle."""

    BROKEN_LINE = "broken-line"
    STIFFNESS_RATIO = "stiffness-ratio"


Files = Annotated[list[Path], typer.Argument(help="Measurement files, one or several specimens each.")]
Output = Annotated[
    Path | None, typer.Option("-o", "--output", help="Fabric card (TOML): updated where it exists, else new.")
]
Name = Annotated[str | None, typer.Option(help="Name of a new card (default: name of the file).")]
Weight = Annotated[float | None, typer.Option("--areal-weight", help="Areal weight of a new card [g/m2].")]
Base = Annotated[
    str | None,
    typer.Option("--from", help="Card (shipped name or file) from which a new card takes its other tables."),
]
TensionStiffness = Annotated[
    float | None,
    typer.Option(
        "--tension-stiffness",
        help="For a card without tensile tests: linear tension in both directions [N per mm of width and unit strain].",
    ),
]
ShearModulus = Annotated[
    float | None, typer.Option("--shear-modulus", help="For a card without shear tests: constant G12 [MPa].")
]
Preset = Annotated[str, typer.Option(help="Kind of export: auto, generic, instron, aramis, vic3d.")]
Columns = Annotated[
    list[str] | None,
    typer.Option("--column", help="Column of a quantity: displacement=HEADER or force=2. Repeatable."),
]
Units = Annotated[list[str] | None, typer.Option("--unit", help="Unit where the file has none: force=kN. Repeatable.")]
Only = Annotated[list[str] | None, typer.Option("--only", help="Specimen to take from files with several. Repeatable.")]
Zero = Annotated[bool, typer.Option("--zero", help="Shift each test so that it starts at the origin.")]
Monotone = Annotated[bool, typer.Option("--monotone/--not-monotone", help="Impose a law that rises.")]
Weighting = Annotated[WeightingChoice, typer.Option(help="Errors of one size, or in proportion to the force.")]
Knots = Annotated[int, typer.Option(help="Knots of a tabulated law.", min=2, max=500)]
Figures = Annotated[
    Path | None,
    typer.Option("--figures", help="Folder for the figures (default: CARD-figures beside the card)."),
]
NoFigures = Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")]
FromDeg = Annotated[float | None, typer.Option("--from-deg", help="Start of the fitted interval [deg].")]
ToDeg = Annotated[float | None, typer.Option("--to-deg", help="End of the fitted interval [deg].")]
Thickness = Annotated[float | None, typer.Option(help="Thickness of the fabric [mm] (default: the card's).")]
Locking = Annotated[LockingChoice, typer.Option(help="Criterion of the locking angle.")]


@contextmanager
def reported() -> Iterator[None]:
    """One clear message and the exit code of the error, no traceback."""
    try:
        yield
    except WeftformError as problem:
        typer.echo(str(problem), err=True)
        raise typer.Exit(problem.exit_code) from None
    except OSError as problem:
        typer.echo(f"{problem.filename}: cannot be written ({problem.strerror})", err=True)
        raise typer.Exit(2) from None


def reading_of(
    preset: str,
    column: Sequence[str] | None,
    unit: Sequence[str] | None,
    only: Sequence[str] | None,
    zero: bool,
) -> Reading:
    from weftform.laboratory import Reading

    return Reading(
        preset,
        pairs_of(column, "--column", "force=HEADER"),
        pairs_of(unit, "--unit", "force=kN"),
        tuple(only or ()),
        zero,
    )


def interval_of(start: float | None, end: float | None) -> tuple[float, float] | None:
    if start is None and end is None:
        return None
    if end is None:
        raise MeasurementError("a start of the interval without its end", hint="give --to-mm or --to-deg as well")
    return (start or 0.0, end)


def thickness_of(given: float | None, output: Path | None, base: str | None) -> float:
    """The thickness from the option, else from the card."""
    if given is not None:
        return given
    from weftform.laboratory.card_file import existing_value

    found = existing_value(output, base, ("fabric", "thickness_mm"))
    if isinstance(found, int | float) and not isinstance(found, bool):
        return float(found)
    raise MeasurementError("the thickness of the fabric is needed", expected="--thickness MM, or a card that has it")


def tracking_of(
    markers: Sequence[Path] | None, layout: Path | None, displacements: Path | None
) -> tuple[MarkerTracking, ...]:
    if not markers:
        if layout is not None or displacements is not None:
            raise MeasurementError("--layout and --displacements belong to --markers", expected="--markers FILE")
        return ()
    if layout is None:
        raise MeasurementError(
            "the quadruples of markers are not known",
            expected="--layout FILE.toml with [[quadruple]] tables",
            hint="the shipped sample bias-extension-layout.toml shows one",
        )
    from weftform.laboratory import track_markers

    return tuple(track_markers(m, layout, displacements=displacements) for m in markers)


def defaults_of(
    areal_weight: float | None, thickness: float | None, modulus: float | None, stiffness: float | None
) -> dict[tuple[str, ...], Any]:
    """What the options give for a card: only what is not None."""
    values: dict[tuple[str, ...], Any] = {}
    if areal_weight is not None:
        values[("fabric", "areal_weight_g_m2")] = areal_weight
    if thickness is not None:
        values[("fabric", "thickness_mm")] = thickness
    if stiffness is not None:
        line = {
            "law": "linear",
            "stiffness_N_per_mm": stiffness,
            "specimen_length_mm": 100.0,
            "specimen_width_mm": 100.0,
            "source": "option --tension-stiffness, not measured",
        }
        values[("tension", "warp")] = line
        values[("tension", "weft")] = dict(line)
    if modulus is not None:
        values[("shear",)] = {
            "law": "constant",
            "modulus_MPa": modulus,
            "source": "option --shear-modulus, not measured",
        }
    return values


def write_tables(
    output: Path | None,
    tables: dict[tuple[str, ...], dict[str, Any]],
    origin: dict[str, dict[str, Any]],
    base: str | None,
    defaults: dict[tuple[str, ...], Any],
    name: str | None,
) -> None:
    if output is None:
        typer.echo("No card written (give -o CARD.toml).")
        return
    from weftform.laboratory.card_file import write_card

    existed = output.exists()
    write_card(output, tables, origin, base=base, defaults=defaults, name=name)
    typer.echo(f"{'Updated' if existed else 'Wrote'} {output}")


def figure_folder(output: Path | None, figures: Path | None, none: bool) -> Path | None:
    if none:
        return None
    if figures is not None:
        return figures
    return None if output is None else output.with_name(f"{output.stem}-figures")


def say_fit(
    fit: PolynomialFit | TableFit, y: str, y_unit: str, x: str, x_unit: str, residual: str | None = None
) -> None:
    from weftform.laboratory.fitting import PolynomialFit

    if isinstance(fit, PolynomialFit):
        typer.echo(f"  {y}({x}) [{y_unit}], {x} in {x_unit}, valid to {fit.valid_to:.4g}:")
        for power, value, error in zip(fit.powers, fit.coefficients, fit.standard_errors, strict=True):
            typer.echo(f"    {x}^{power}: {value: .6g}  +- {error:.2g}")
    else:
        typer.echo(f"  {y}({x}) [{y_unit}] as a table of {len(fit.x)} points, {x} in {x_unit} to {fit.valid_to:.4g}")
    typer.echo(f"  rms {fit.rms:.3g} {residual or y_unit}, R2 {fit.r_squared:.5f}")


def say_shear(shear: ShearCurve, residual: str = "N") -> None:
    say_fit(shear.fit, "F_sh", "N/mm", "gamma", "rad", residual)
    modulus = shear.modulus_coefficients
    if modulus is not None:
        typer.echo("  G12 [MPa], powers 0, 1, ...: " + ", ".join(f"{c:.5g}" for c in modulus))
    typer.echo(f"  G12 {'is positive over the whole validity' if shear.modulus_positive else 'IS NEGATIVE somewhere'}")
    locking = f"{shear.stages.locking_deg:.1f} deg" if shear.stages.locking_deg is not None else "not reached"
    typer.echo(f"  placing to {shear.stages.placing_end_deg:.1f} deg, locking angle {locking}")
    typer.echo(f"    ({shear.stages.criterion})")


def count_of(specimens: Sequence[object]) -> str:
    return f"{len(specimens)} specimen{'' if len(specimens) == 1 else 's'}"


def say_warnings(warnings: Sequence[str]) -> None:
    for warning in warnings:
        typer.echo(f"warning: {warning}", err=True)


def say_files(files: Sequence[Path]) -> None:
    for file in files:
        typer.echo(f"  figure {file}")
