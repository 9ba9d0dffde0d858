"""``weftform characterise``: from the files of the testing machine to a fabric card."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from weftform.cli.characterise_options import (
    AngleChoice,
    Base,
    Columns,
    DirectionChoice,
    Figures,
    Files,
    FromDeg,
    Knots,
    LawChoice,
    Locking,
    LockingChoice,
    Monotone,
    Name,
    NoFigures,
    Only,
    Output,
    Preset,
    ShearModulus,
    TensionStiffness,
    Thickness,
    ToDeg,
    Units,
    Weight,
    Weighting,
    WeightingChoice,
    Zero,
    count_of,
    defaults_of,
    figure_folder,
    interval_of,
    reading_of,
    reported,
    say_files,
    say_fit,
    say_shear,
    say_warnings,
    thickness_of,
    tracking_of,
    write_tables,
)

app = typer.Typer(
    help="From measured curves to the laws of a fabric card.", no_args_is_help=True, rich_markup_mode=None
)


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
    from_mm: Annotated[float | None, typer.Option("--from-mm", help="Start of the fitted interval [mm].")] = None,
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
    with reported():
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
            interval=interval_of(from_mm, to_mm),
            monotone=monotone,
            through_origin=origin,
            weighting=weighting.value,
            knots=knots,
            reading=reading_of(preset, column, unit, only, zero),
        )
        typer.echo(f"Tensile test along the {direction.value}: {count_of(found.specimens)}, {found.fit.points} points")
        s = found.stages
        typer.echo(
            f"  crimp to {s.crimp_end:.3f} mm, linear to {s.linear_end:.3f} mm at {s.linear_stiffness:.5g} "
            f"N/mm"
            f"{', then damage' if s.damage else ', no damage seen'}"
        )
        say_fit(found.fit, "F", "N", "u", "mm")
        uc, fc = found.connector_limits(spacing)
        typer.echo(f"  connectors, l0 = {spacing:g} mm (Eq. 11): Uc_max = {uc:.5g} mm, Fc_max = {fc:.5g} N")
        other = "weft" if yarns == "warp" else "warp"
        warnings = list(found.warnings)
        if direction is not DirectionChoice.BOTH and existing_value(output, base, ("tension", other, "same_as")):
            warnings.append(f"the {other} of the card is the same as the {yarns}, so it changes with it")
        say_warnings(warnings)
        tables: dict[tuple[str, ...], dict[str, Any]] = {("tension", yarns): found.card_table()}
        if direction is DirectionChoice.BOTH:
            tables[("tension", other)] = {"same_as": yarns}
        origin_table = provenance(
            "tensile",
            found.specimens,
            found.fit,
            found.interval,
            "mm",
            "N",
            found.warnings,
            more={"crimp_end_mm": s.crimp_end, "linear_end_mm": s.linear_end},
        )
        defaults = defaults_of(areal_weight, thickness, shear_modulus, tension_stiffness)
        defaults.pop(("tension", yarns), None)
        if direction is DirectionChoice.BOTH:
            defaults.pop(("tension", other), None)
        write_tables(output, tables, {f"tension-{yarns}": origin_table}, base, defaults, name)
        folder = figure_folder(output, figures, no_figures)
        if folder is not None:
            from weftform.laboratory.figures import draw_tensile

            say_files(draw_tensile(found, folder))


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
    angle: Annotated[AngleChoice, typer.Option(help="auto: measured where slip is found.")] = AngleChoice.AUTO,
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
    with reported():
        from weftform.laboratory import LockingCriterion, characterise_bias_extension
        from weftform.laboratory.card_file import provenance
        from weftform.laboratory.kinematics import check_bias_specimen

        check_bias_specimen(height, width)
        found = characterise_bias_extension(
            files,
            height=height,
            width=width,
            thickness=thickness_of(thickness, output, base),
            tracking=tracking_of(markers, layout, displacements),
            angle=angle.value,
            law=law.value,
            degree=degree,
            interval_deg=interval_of(from_deg, to_deg),
            monotone=monotone,
            weighting=weighting.value,
            knots=knots,
            locking=LockingCriterion(locking.value),
            reading=reading_of(preset, column, unit, only, zero),
        )
        typer.echo(
            f"Bias-extension test {height:g} x {width:g} mm: {count_of(found.specimens)}, "
            f"{found.shear.fit.points} points, {found.angle_source} angle"
        )
        if found.slip is not None:
            if found.slip.displacement is not None and found.slip.interval is not None:
                typer.echo(
                    f"  slip from {found.slip.displacement:.2f} mm ({found.slip.angle_deg:.1f} deg), 95 % "
                    f"interval "
                    f"{found.slip.interval[0]:.2f}-{found.slip.interval[1]:.2f} mm"
                )
            else:
                typer.echo("  no slip found")
        say_shear(found.shear)
        say_warnings(found.warnings)
        more: dict[str, Any] = {"angle": found.angle_source, "locking_deg": found.shear.stages.locking_deg}
        if found.slip is not None:
            more["slip_mm"] = found.slip.displacement
        origin = provenance(
            "bias-extension",
            found.specimens,
            found.shear.fit,
            found.interval_deg,
            "deg",
            "N",
            found.warnings,
            tracking=found.tracking,
            more=more,
        )
        defaults = defaults_of(areal_weight, thickness, None, tension_stiffness)
        write_tables(output, {("shear",): found.card_table()}, {"shear": origin}, base, defaults, name)
        folder = figure_folder(output, figures, no_figures)
        if folder is not None:
            from weftform.laboratory.figures import draw_bias_extension

            say_files(draw_bias_extension(found, folder))


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
    with reported():
        from weftform.laboratory import LockingCriterion, characterise_picture_frame
        from weftform.laboratory.card_file import provenance

        found = characterise_picture_frame(
            files,
            frame_side=height,
            fabric_side=width,
            thickness=thickness_of(thickness, output, base),
            law=law.value,
            degree=degree,
            interval_deg=interval_of(from_deg, to_deg),
            monotone=monotone,
            weighting=weighting.value,
            knots=knots,
            locking=LockingCriterion(locking.value),
            reading=reading_of(preset, column, unit, only, zero),
        )
        typer.echo(
            f"Picture-frame test, {found.measured} data: {count_of(found.specimens)}, {found.shear.fit.points} points"
        )
        say_shear(found.shear, "N/mm" if found.measured == "normalised" else "N")
        say_warnings(found.warnings)
        origin = provenance(
            "picture-frame",
            found.specimens,
            found.shear.fit,
            found.interval_deg,
            "deg",
            "N_per_mm" if found.measured == "normalised" else "N",
            found.warnings,
            more={"measured": found.measured, "locking_deg": found.shear.stages.locking_deg},
        )
        defaults = defaults_of(areal_weight, thickness, None, tension_stiffness)
        write_tables(output, {("shear",): found.card_table()}, {"shear": origin}, base, defaults, name)
        folder = figure_folder(output, figures, no_figures)
        if folder is not None:
            from weftform.laboratory.figures import draw_picture_frame

            say_files(draw_picture_frame(found, folder))


@app.command("shear-map")
def shear_map(
    file: Annotated[Path, typer.Argument(help="Full-field export of one stage: positions and displacements.")],
    warp_deg: Annotated[float, typer.Option("--warp-deg", help="Direction of the warp from the x axis [deg].")] = 45.0,
    png: Annotated[Path | None, typer.Option("--png", help="Picture to write (default: FILE-shear.png here).")] = None,
    table: Annotated[
        Path | None, typer.Option("--csv", help="Table to write: x_mm, y_mm and shear_angle_deg of each triangle.")
    ] = None,
    preset: Preset = "auto",
    column: Columns = None,
    unit: Units = None,
) -> None:
    """Shear-angle map of a full-field (DIC) export: GOM Aramis, VIC-3D or generic."""
    with reported():
        from weftform.laboratory.figures import draw_shear_field
        from weftform.laboratory.full_field import read_shear_field
        from weftform.result.writer import write_whole

        field = read_shear_field(file, warp_deg=warp_deg, reading=reading_of(preset, column, unit, None, False))
        typer.echo(
            f"Shear angle of {file.name}: {len(field.angle)} triangles, mean {field.angle.mean():.2f} deg, from "
            f"{field.angle.min():.2f} to {field.angle.max():.2f} deg"
        )
        say_warnings(field.warnings)
        if table is not None:
            rows = zip(field.x, field.y, field.angle, strict=True)
            write_whole(
                table, "x_mm,y_mm,shear_angle_deg\n" + "".join(f"{x:.4f},{y:.4f},{g:.4f}\n" for x, y, g in rows)
            )
            typer.echo(f"  table {table}")
        say_files([draw_shear_field(field, Path(f"{file.stem}-shear.png") if png is None else png, file.name)])
