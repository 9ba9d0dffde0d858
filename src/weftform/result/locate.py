"""Between material points and places on the formed part: within a cell, and back from plan view."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from weftform.blank import Cell
from weftform.blank.grid import CORNERS
from weftform.result.fields import Fields

Floats = NDArray[np.float64]


def cell_corners(fields: Fields, a: int, b: int) -> Floats:
    """Corners (0,0), (1,0), (1,1), (0,1) of the cell in column ``a`` and row ``b`` [mm], shape [4, 3].

    The missing corner of a half cell completes the parallelogram, which makes the map of the cell linear.
    """
    x00, x10, x11, x01 = (fields.positions[b + dj, a + di] for di, dj in CORNERS)
    kind = Cell(fields.grid.cells[b, a])
    if kind == Cell.LACKS_00:
        x00 = x10 + x01 - x11
    elif kind == Cell.LACKS_10:
        x10 = x00 + x11 - x01
    elif kind == Cell.LACKS_11:
        x11 = x10 + x01 - x00
    elif kind == Cell.LACKS_01:
        x01 = x00 + x11 - x10
    return np.stack([x00, x10, x11, x01])


def bilinear(corners: Floats, p: float, q: float) -> Floats:
    """Position at (p, q) of a cell, 0 to 1 along warp and weft [mm], shape [3]."""
    x00, x10, x11, x01 = corners
    return np.asarray((1 - p) * (1 - q) * x00 + p * (1 - q) * x10 + p * q * x11 + (1 - p) * q * x01)


def material_below(fields: Fields, x: float, y: float) -> tuple[float, float] | None:
    """Material point (U, V) [mm] of the whole blank that lies at (x, y) [mm] in plan view; None where there is none.

    The uppermost one where the part lies over itself. The inverse of the map that :meth:`Result.probe` uses.
    """
    from scipy.optimize import root

    grid = fields.grid
    place = np.array([x, y])
    mirrored = (place < 0.0) & np.array([plane in grid.planes for plane in ("x", "y")])
    folded = np.where(mirrored, -place, place)
    best: tuple[float, Floats] | None = None
    for b, a in _cells_over(fields, folded):
        corners = cell_corners(fields, a, b)

        def miss(at: Floats, corners: Floats = corners) -> Floats:
            return bilinear(corners, at[0], at[1])[:2] - folded

        found = root(miss, [0.5, 0.5], tol=1e-12)
        if np.abs(found.fun).max() > 1e-6 or not (np.abs(found.x - 0.5) <= 0.5 + 1e-6).all():
            continue
        height = float(bilinear(corners, *found.x)[2])
        if best is None or height > best[0]:
            best = height, (np.array([a, b]) + found.x - grid.centre) * (grid.warp_pitch, grid.weft_pitch)
    if best is None:
        return None
    plan = grid.plan(best[1])
    u, v = grid.material_at(np.where(mirrored, -plan, plan))
    return float(u), float(v)


def _cells_over(fields: Fields, place: Floats) -> list[tuple[int, int]]:
    """Cells (row, column) of the modelled part whose plan view holds a place."""
    import shapely

    indices, offsets, places = fields.grid.quads
    plan = fields.positions.reshape(-1, 3)[indices, :2]
    low, high = (f.reduceat(plan, offsets[:-1], axis=0) for f in (np.minimum, np.maximum))
    near = np.flatnonzero(((low <= place + 1e-6) & (high >= place - 1e-6)).all(axis=1))
    point = shapely.Point(place)
    # a point on the edge between two cells is found within the round-off of the position
    return [
        (int(places[k, 0]), int(places[k, 1]))
        for k in near
        if shapely.Polygon(plan[offsets[k] : offsets[k + 1]]).distance(point) <= 1e-6
    ]
