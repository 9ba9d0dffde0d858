"""``weftform probe``: values at material points."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from weftform.cli.options import AsJson, ResultFolder


def probe(
    folder: ResultFolder,
    yarn: Annotated[
        list[str],
        typer.Option("--yarn", metavar="U,V", help="Material point: U mm along warp, V mm along weft from the centre."),
    ],
    stroke: Annotated[
        float | None,
        typer.Option("--stroke", metavar="S", help="At the kept instant nearest to S mm; default the end."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Values at material points: position, shear angle, yarn directions, strains and forces.

    Example: weftform probe results/first --yarn 10,10 --yarn 20,20 --json
    """
    from weftform.errors import ResultError
    from weftform.result import Result

    points = []
    for text in yarn:
        try:
            u, v = (float(part) for part in text.split(","))
        except ValueError:
            raise ResultError(
                "not a material point", key="--yarn", expected="two numbers U,V in mm, such as 10,-5", got=text
            ) from None
        points.append((u, v))
    found = Result.open(folder).probe(points, stroke)
    if as_json:
        typer.echo(json.dumps([point.as_dict() for point in found], indent=2))
        return
    typer.echo("   U [mm]   V [mm]   x [mm]   y [mm]   z [mm]  shear [deg]  warp [N/mm]  weft [N/mm]")
    for p in found:
        x, y, z = p.position_mm
        typer.echo(
            f"{p.yarn_mm[0]:9.3f}{p.yarn_mm[1]:9.3f}{x:9.3f}{y:9.3f}{z:9.3f}{p.shear_angle_deg:13.3f}"
            f"{p.warp_force_N_per_mm:13.4f}{p.weft_force_N_per_mm:13.4f}"
        )
