"""``weftform characterise``: from the files of the testing machine to a fabric card."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from weftform.errors import MeasurementError, WeftformError

if TYPE_CHECKING:
    from weftform.laboratory import MarkerTracking, Reading
    from weftform.laboratory.fitting import PolynomialFit
    from weftform.laboratory.shear import ShearCurve
    from weftform.laboratory.tabulating import TableFit

app = typer.Typer(
    help="From measured curves to the laws of a fabric card.", no_args_is_help=True, rich_markup_mode=None
)


class DirectionChoice(str, Enum):
    """Which yarns lie along the pull."""

    WARP = "warp"
    WEFT = "weft"
    BOTH = "both"


class LawChoice(str, Enum):
    """Form of the law."""

    POLYNOMIAL = "polynomial"
    TABULATED = "tabulated"


class WeightingChoice(str, Enum):
    """Size of the errors along the curve."""

    UNIFORM = "uniform"
    RELATIVE = "relative"


class AngleChoice(str, Enum):
    """Shear angle of a bias-extension law."""

    AUTO = "auto"
    KINEMATIC = "kinematic"
    MEASURED = "measured"


class LockingChoice(str, Enum):
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
Units = Annotated[
    list[str] | None, typer.Option("--unit", help="Unit where the file has none: force=kN. Repeatable.")
]
Only = Annotated[
    list[str] | None, typer.Option("--only", help="Specimen to take from files with several. Repeatable.")
]
Zero = Annotated[bool, typer.Option("--zero", help="Shift each test so that it starts at the origin.")]
Monotone = Annotated[bool, typer.Option("--monotone/--not-monotone", help="Impose a law that rises.")]
Weighting = Annotated[
    WeightingChoice, typer.Option(help="Errors of one size, or in proportion to the force.")
]
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


@app.command()
def tensile(
    files: Files,
    height: Annotated[float, typer.Option(help="Gauge length of the specimens [mm].")],
    width: Annotated[float, typer.Option(help="Width of the specimens [mm].")],
    thickness: Thickness = None,
    direction: Annotated[
        DirectionChoice, typer.Option(help="Yarns along the pull; both: one law.")
    ] = DirectionChoice.WARP,
    output: Output = None,
    law: Annotated[LawChoice, typer.Option(help="Form of the law.")] = LawChoice.POLYNOMIAL,
    degree: Annotated[int, typer.Option(help="Of the polynomial.", min=1, max=12)] = 4,
    from_mm: Annotated[
        float | None, typer.Option("--from-mm", help="Start of the fitted interval [mm].")
    ] = None,
    to_mm: Annotated[float | None, typer.Option("--to-mm", help="End of the fitted interval [mm].")] = None,
    monotone: Monotone = True,
    origin: Annotated[bool, typer.Option("--origin/--no-origin", help="Impose F(0) = 0.")] = True,
    weighting: Weighting = WeightingChoice.UNIFORM,
    knots: Knots = 24,
    spacing: Annotated[
        float, typer.Option("--l0", help="Mesh size for the connector limits of Eq. 11 [mm].", min=1e-3)
    ] = 1.0,
    preset: Preset = "auto",
    column: Columns = None,
    unit: Units = None,
    only: Only = None,
    zero: Zero = False,
    name: Name = None,
    areal_weight: Weight = None,
    base: Base = None,
    shear_modulus: ShearModulus = None,
    tension_stiffness: TensionStiffness = None,
    figures: Figures = None,
    no_figures: NoFigures = False,
) -> None:
    """Tensile tests along the yarns: force of the elongation (Eqs. 3, 4, 11)."""
    with _reported():
        from weftform.laboratory import characterise_tensile
        from weftform.laboratory.card_file import existing_value, provenance

        yarns: Any = "weft" if direction is DirectionChoice.WEFT else "warp"
        found = characterise_tensile(
            files,
            direction=yarns,
            length=height,
            width=width,
            law=law.value,
            degree=degree,
            interval=_interval(from_mm, to_mm),
            monotone=monotone,
            through_origin=origin,
            weighting=weighting.value,
            knots=knots,
            reading=_reading(preset, column, unit, only, zero),
        )
        typer.echo(
            f"Tensile test along the {direction.value}: {len(found.specimens)} specimens, {found.fit.points} points"
        )
        s = found.stages
        typer.echo(f"  crimp to {s.crimp_end:.3f} mm, linear to {s.linear_end:.3f} mm at {s.linear_stiffness:.5g} N/mm"
                   f"{', then damage' if s.damage else ', no damage seen'}")  # fmt: skip
        _say_fit(found.fit, "F", "N", "u", "mm")
        uc, fc = found.connector_limits(spacing)
        typer.echo(f"  connectors, l0 = {spacing:g} mm (Eq. 11): Uc_max = {uc:.5g} mm, Fc_max = {fc:.5g} N")
        other = "weft" if yarns == "warp" else "warp"
        warnings = list(found.warnings)
        if direction is not DirectionChoice.BOTH and existing_value(
            output, base, ("tension", other, "same_as")
        ):
            warnings.append(f"the {other} of the card is the same as the {yarns}, so it changes with it")
        _say_warnings(warnings)
        tables: dict[tuple[str, ...], dict[str, Any]] = {("tension", yarns): found.card_table()}
        if direction is DirectionChoice.BOTH:
            tables[("tension", other)] = {"same_as": yarns}
        origin_table = provenance(
            "tensile", found.specimens, found.fit, found.interval, "mm", "N", found.warnings,
            more={"crimp_end_mm": s.crimp_end, "linear_end_mm": s.linear_end},
        )  # fmt: skip
        defaults = _defaults(areal_weight, thickness, shear_modulus, tension_stiffness)
        defaults.pop(("tension", yarns), None)
        if direction is DirectionChoice.BOTH:
            defaults.pop(("tension", other), None)
        _write(output, tables, {f"tension-{yarns}": origin_table}, base, defaults, name)
        folder = _figure_folder(output, figures, no_figures)
        if folder is not None:
            from weftform.laboratory.figures import draw_tensile

            _say_files(draw_tensile(found, folder))


@app.command("bias-extension")
def bias_extension(
    files: Files,
    height: Annotated[float, typer.Option(help="Free height of the specimens between the clamps [mm].")],
    width: Annotated[float, typer.Option(help="Width of the specimens [mm].")],
    thickness: Thickness = None,
    output: Output = None,
    markers: Annotated[list[Path] | None, typer.Option(help="Table of marker positions. Repeatable.")] = None,
    layout: Annotated[Path | None, typer.Option(help="TOML file with the quadruples of markers.")] = None,
    displacements: Annotated[
        Path | None, typer.Option(help="Table of image and displacement, if the markers have none.")
    ] = None,
    angle: Annotated[
        AngleChoice, typer.Option(help="auto: measured where slip is found.")
    ] = AngleChoice.AUTO,
    law: Annotated[LawChoice, typer.Option(help="Form of the law.")] = LawChoice.POLYNOMIAL,
    degree: Annotated[int, typer.Option(help="Of the polynomial.", min=1, max=12)] = 5,
    from_deg: FromDeg = None,
    to_deg: ToDeg = None,
    monotone: Monotone = True,
    weighting: Weighting = WeightingChoice.UNIFORM,
    knots: Knots = 24,
    locking: Locking = LockingChoice.BROKEN_LINE,
    preset: Preset = "auto",
    column: Columns = None,
    unit: Units = None,
    only: Only = None,
    zero: Zero = False,
    name: Name = None,
    areal_weight: Weight = None,
    base: Base = None,
    tension_stiffness: TensionStiffness = None,
    figures: Figures = None,
    no_figures: NoFigures = False,
) -> None:
    """Bias-extension test: normalised shear force, shear stress and modulus (Eqs. 1, 2, 5 to 10)."""
    with _reported():
        from weftform.laboratory import LockingCriterion, characterise_bias_extension
        from weftform.laboratory.card_file import provenance
        from weftform.laboratory.kinematics import check_bias_specimen

        check_bias_specimen(height, width)
        found = characterise_bias_extension(
            files,
            height=height,
            width=width,
            thickness=_thickness(thickness, output, base),
            tracking=_tracking(markers, layout, displacements),
            angle=angle.value,
            law=law.value,
            degree=degree,
            interval_deg=_interval(from_deg, to_deg),
            monotone=monotone,
            weighting=weighting.value,
            knots=knots,
            locking=LockingCriterion(locking.value),
            reading=_reading(preset, column, unit, only, zero),
        )
        typer.echo(f"Bias-extension test {height:g} x {width:g} mm: {len(found.specimens)} specimens, "
                   f"{found.shear.fit.points} points, {found.angle_source} angle")  # fmt: skip
        if found.slip is not None:
            if found.slip.displacement is not None and found.slip.interval is not None:
                typer.echo(f"  slip from {found.slip.displacement:.2f} mm ({found.slip.angle_deg:.1f} deg), 95 % interval "
                           f"{found.slip.interval[0]:.2f}-{found.slip.interval[1]:.2f} mm")  # fmt: skip
            else:
                typer.echo("  no slip found")
        _say_shear(found.shear)
        _say_warnings(found.warnings)
        more: dict[str, Any] = {"angle": found.angle_source, "locking_deg": found.shear.stages.locking_deg}
        if found.slip is not None:
            more["slip_mm"] = found.slip.displacement
        origin = provenance(
            "bias-extension", found.specimens, found.shear.fit, found.interval_deg, "deg", "N", found.warnings,
            tracking=found.tracking, more=more,
        )  # fmt: skip
        defaults = _defaults(areal_weight, thickness, None, tension_stiffness)
        _write(output, {("shear",): found.card_table()}, {"shear": origin}, base, defaults, name)
        folder = _figure_folder(output, figures, no_figures)
        if folder is not None:
            from weftform.laboratory.figures import draw_bias_extension

            _say_files(draw_bias_extension(found, folder))


@app.command("picture-frame")
def picture_frame(
    files: Files,
    height: Annotated[float, typer.Option(help="Side of the frame between its hinges [mm].")],
    width: Annotated[float, typer.Option(help="Side of the sheared cloth [mm].")],
    thickness: Thickness = None,
    output: Output = None,
    law: Annotated[LawChoice, typer.Option(help="Form of the law.")] = LawChoice.TABULATED,
    degree: Annotated[int, typer.Option(help="Of the polynomial.", min=1, max=12)] = 5,
    from_deg: FromDeg = None,
    to_deg: ToDeg = None,
    monotone: Monotone = True,
    weighting: Weighting = WeightingChoice.UNIFORM,
    knots: Knots = 24,
    locking: Locking = LockingChoice.BROKEN_LINE,
    preset: Preset = "auto",
    column: Columns = None,
    unit: Units = None,
    only: Only = None,
    zero: Zero = False,
    name: Name = None,
    areal_weight: Weight = None,
    base: Base = None,
    tension_stiffness: TensionStiffness = None,
    figures: Figures = None,
    no_figures: NoFigures = False,
) -> None:
    """Picture-frame test: from forces or an already normalised table to the shear law."""
    with _reported():
        from weftform.laboratory import LockingCriterion, characterise_picture_frame
        from weftform.laboratory.card_file import provenance

        found = characterise_picture_frame(
            files,
            frame_side=height,
            fabric_side=width,
            thickness=_thickness(thickness, output, base),
            law=law.value,
            degree=degree,
            interval_deg=_interval(from_deg, to_deg),
            monotone=monotone,
            weighting=weighting.value,
            knots=knots,
            locking=LockingCriterion(locking.value),
            reading=_reading(preset, column, unit, only, zero),
        )
        typer.echo(f"Picture-frame test, {found.measured} data: {len(found.specimens)} specimens, "
                   f"{found.shear.fit.points} points")  # fmt: skip
        _say_shear(found.shear, "N/mm" if found.measured == "normalised" else "N")
        _say_warnings(found.warnings)
        origin = provenance(
            "picture-frame", found.specimens, found.shear.fit, found.interval_deg, "deg",
            "N_per_mm" if found.measured == "normalised" else "N", found.warnings,
            more={"measured": found.measured, "locking_deg": found.shear.stages.locking_deg},
        )  # fmt: skip
        defaults = _defaults(areal_weight, thickness, None, tension_stiffness)
        _write(output, {("shear",): found.card_table()}, {"shear": origin}, base, defaults, name)
        folder = _figure_folder(output, figures, no_figures)
        if folder is not None:
            from weftform.laboratory.figures import draw_picture_frame

            _say_files(draw_picture_frame(found, folder))


@contextmanager
def _reported() -> Iterator[None]:
    """One clear message and the exit code of the error, no traceback."""
    try:
        yield
    except WeftformError as problem:
        typer.echo(str(problem), err=True)
        raise typer.Exit(problem.exit_code) from None


def _pairs(texts: Sequence[str] | None, option: str) -> dict[str, str]:
    pairs = {}
    for text in texts or ():
        key, equals, value = text.partition("=")
        if not (equals and key.strip() and value.strip()):
            raise MeasurementError(
                f"{option} {text} is not of the form QUANTITY=VALUE", expected=f"{option} force=..."
            )
        pairs[key.strip()] = value.strip()
    return pairs


def _reading(
    preset: str,
    column: Sequence[str] | None,
    unit: Sequence[str] | None,
    only: Sequence[str] | None,
    zero: bool,
) -> Reading:
    from weftform.laboratory import Reading

    return Reading(preset, _pairs(column, "--column"), _pairs(unit, "--unit"), tuple(only or ()), zero)


def _interval(start: float | None, end: float | None) -> tuple[float, float] | None:
    if start is None and end is None:
        return None
    if end is None:
        raise MeasurementError(
            "a start of the interval without its end", hint="give --to-mm or --to-deg as well"
        )
    return (start or 0.0, end)


def _thickness(given: float | None, output: Path | None, base: str | None) -> float:
    """The thickness from the option, else from the card."""
    if given is not None:
        return given
    from weftform.laboratory.card_file import existing_value

    found = existing_value(output, base, ("fabric", "thickness_mm"))
    if isinstance(found, int | float) and not isinstance(found, bool):
        return float(found)
    raise MeasurementError(
        "the thickness of the fabric is needed", expected="--thickness MM, or a card that has it"
    )


def _tracking(
    markers: Sequence[Path] | None, layout: Path | None, displacements: Path | None
) -> tuple[MarkerTracking, ...]:
    if not markers:
        if layout is not None or displacements is not None:
            raise MeasurementError(
                "--layout and --displacements belong to --markers", expected="--markers FILE"
            )
        return ()
    if layout is None:
        raise MeasurementError(
            "the quadruples of markers are not known",
            expected="--layout FILE.toml with [[quadruple]] tables",
            hint="the shipped sample bias-extension-layout.toml shows one",
        )
    from weftform.laboratory import track_markers

    return tuple(track_markers(m, layout, displacements=displacements) for m in markers)


def _defaults(
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


def _write(
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


def _figure_folder(output: Path | None, figures: Path | None, none: bool) -> Path | None:
    if none:
        return None
    if figures is not None:
        return figures
    return None if output is None else output.with_name(f"{output.stem}-figures")


def _say_fit(
    fit: PolynomialFit | TableFit, y: str, y_unit: str, x: str, x_unit: str, residual: str | None = None
) -> None:
    from weftform.laboratory.fitting import PolynomialFit

    if isinstance(fit, PolynomialFit):
        typer.echo(f"  {y}({x}) [{y_unit}], {x} in {x_unit}, valid to {fit.valid_to:.4g}:")
        for power, value, error in zip(fit.powers, fit.coefficients, fit.standard_errors, strict=True):
            typer.echo(f"    {x}^{power}: {value: .6g}  +- {error:.2g}")
    else:
        typer.echo(
            f"  {y}({x}) [{y_unit}] as a table of {len(fit.x)} points, {x} in {x_unit} to {fit.valid_to:.4g}"
        )
    typer.echo(f"  rms {fit.rms:.3g} {residual or y_unit}, R2 {fit.r_squared:.5f}")


def _say_shear(shear: ShearCurve, residual: str = "N") -> None:
    _say_fit(shear.fit, "F_sh", "N/mm", "gamma", "rad", residual)
    modulus = shear.modulus_coefficients
    if modulus is not None:
        typer.echo("  G12 [MPa], powers 0, 1, ...: " + ", ".join(f"{c:.5g}" for c in modulus))
    typer.echo(
        f"  G12 {'is positive over the whole validity' if shear.modulus_positive else 'IS NEGATIVE somewhere'}"
    )
    locking = f"{shear.stages.locking_deg:.1f} deg" if shear.stages.locking_deg is not None else "not reached"
    typer.echo(f"  placing to {shear.stages.placing_end_deg:.1f} deg, locking angle {locking}")
    typer.echo(f"    ({shear.stages.criterion})")


def _say_warnings(warnings: Sequence[str]) -> None:
    for warning in warnings:
        typer.echo(f"warning: {warning}", err=True)


def _say_files(files: Sequence[Path]) -> None:
    for file in files:
        typer.echo(f"  figure {file}")
