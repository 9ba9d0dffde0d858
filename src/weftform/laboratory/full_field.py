"""Shear-angle map from a full-field displacement measurement (digital image correlation)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats
from weftform.laboratory.presets import Quantity
from weftform.laboratory.specimen import Reading
from weftform.laboratory.table import read_table


@dataclass(frozen=True, eq=False)
class ShearField:
    """Shear angles on triangles between measured points.

    Attributes
    ----------
    x, y
        Undeformed centres of the triangles [mm], shape [n].
    angle
        Shear angle [deg], shape [n]; positive where the angle between warp and weft closes.
    corners
        Undeformed corners of the triangles [mm], shape [n, 3, 2].
    warnings
        What was done to the measurement.
    """

    x: Floats
    y: Floats
    angle: Floats
    corners: Floats
    warnings: tuple[str, ...] = ()


def shear_field(
    x: Floats,
    y: Floats,
    shift_x: Floats,
    shift_y: Floats,
    *,
    warp_deg: float = 45.0,
    longest_mm: float | None = None,
) -> ShearField:
    """Shear angles from displacements, free of any definition of strain.

    The points are triangulated in the undeformed state; in each triangle the deformation gradient is
    constant and turns and stretches the two yarn directions, whose angle is compared with the right angle
    they started from.

    Parameters
    ----------
    x, y, shift_x, shift_y
        Undeformed positions and displacements [mm], shape [points].
    warp_deg
        Direction of the warp from the x axis [deg]; the weft is 90 degrees further.
    longest_mm
        Triangles with a longer side are left out (they bridge gaps); by default three times the median side.

    Raises
    ------
    MeasurementError
        Fewer than three points, or all on a line.
    """
    from scipy.spatial import Delaunay, QhullError

    points = np.column_stack([x, y])
    try:
        triangles = Delaunay(points).simplices
    except (QhullError, ValueError) as problem:
        raise MeasurementError(
            "the points cannot be triangulated",
            expected="three points or more, not on a line",
            got=f"{len(points)} points",
        ) from problem
    corner = points[triangles]
    moved = (points + np.column_stack([shift_x, shift_y]))[triangles]
    sides = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(axis=1)
    kept = sides <= (3.0 * np.median(sides) if longest_mm is None else longest_mm)
    corner, moved = corner[kept], moved[kept]
    before = np.stack([corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]], axis=2)
    after = np.stack([moved[:, 1] - moved[:, 0], moved[:, 2] - moved[:, 0]], axis=2)
    gradient = after @ np.linalg.inv(before)
    t = np.radians(warp_deg)
    warp = gradient @ np.array([np.cos(t), np.sin(t)])
    weft = gradient @ np.array([-np.sin(t), np.cos(t)])
    cosine = (warp * weft).sum(axis=1) / (np.linalg.norm(warp, axis=1) * np.linalg.norm(weft, axis=1))
    centre = corner.mean(axis=1)
    return ShearField(centre[:, 0], centre[:, 1], np.degrees(np.arcsin(np.clip(cosine, -1.0, 1.0))), corner)


def read_shear_field(
    file: Path | str,
    *,
    warp_deg: float = 45.0,
    reading: Reading = Reading(),  # noqa: B008 (frozen)
) -> ShearField:
    """Shear-angle map of one exported stage (positions and displacements; GOM Aramis, VIC-3D or generic).

    Points that the system lost are left out. In plane: displacements along z are not used.

    Raises
    ------
    MeasurementError
        The file cannot be read, or has too few points.
    """
    needed = [Quantity.X, Quantity.Y, Quantity.SHIFT_X, Quantity.SHIFT_Y]
    t = read_table(file, needed, may_miss=needed, preset=reading.preset, columns=reading.columns, units=reading.units)
    x, y, u, v = (t.values[q] for q in needed)
    ok = np.isfinite(x) & np.isfinite(y) & np.isfinite(u) & np.isfinite(v)
    warnings = t.warnings
    if not ok.all():
        warnings = (*warnings, f"{t.file.name}: {int((~ok).sum())} of {len(ok)} points lost by the system are left out")
    return replace(shear_field(x[ok], y[ok], u[ok], v[ok], warp_deg=warp_deg), warnings=warnings)
