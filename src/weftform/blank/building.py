"""Building a yarn grid: the window, the cells and half cells that fit an outline best, and their planes of symmetry."""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from weftform.blank import outline as shapes
from weftform.blank.grid import CORNERS, Cell, YarnGrid
from weftform.errors import StudyError

LARGEST_GRID = 20_000_000
"""Cells; above this the memory of a laptop does not hold a run."""


def build_grid(
    outline: Polygon,
    *,
    cell_length: float,
    warp_angle: float,
    planes: tuple[str, ...] = (),
    fitted: bool = True,
) -> YarnGrid:
    """Cover an outline with whole and half cells.

    Parameters
    ----------
    outline
        The blank in the plane of the press [mm].
    cell_length
        Wanted cell length [mm]; changed to the nearest that meets an outline along yarns or along the bias.
    warp_angle
        Angle from x to the warp [rad].
    planes
        Planes of symmetry, of ``"x"`` and ``"y"``.
    fitted
        False keeps ``cell_length`` as it is.

    Raises
    ------
    StudyError
        No cell, more than :data:`LARGEST_GRID`, or symmetry that the yarns or the outline do not have.
    """
    quarter = warp_angle / (math.pi / 4)
    aligned = abs(quarter - round(quarter)) < 1e-9
    along_bias = aligned and round(quarter) % 2 == 1
    for plane in planes:
        if not shapes.symmetric(outline, plane):
            raise StudyError(
                f"the outline is not symmetric in the plane {plane} = 0",
                key="blank.symmetry",
                hint='use symmetry = "full"',
            )
    if planes and not aligned:
        raise StudyError(
            "a blank can be cut at planes of symmetry only where yarns run along or at 45 degrees to them",
            key="blank.symmetry",
            expected="a warp angle of 0, 90 or +-45 degrees",
            got=f"{math.degrees(warp_angle):g} degrees",
            hint='use symmetry = "full"',
        )
    u0, v0, u1, v1 = shapes.bounds_along(outline, warp_angle)
    part = shapes.kept_part(outline, planes)
    x0, y0, x1, y1 = outline.bounds
    shortest = min(u1 - u0, v1 - v0, x1 - x0, y1 - y0)
    if cell_length > shortest * (1.0 + 1e-9):
        _no_cell(cell_length)
    # whole and half cells cover the area, so there are at least this many; an area is known without laying them out
    if part.area / cell_length**2 > 1.2 * LARGEST_GRID:
        _too_many(part.area / cell_length**2)
    along = across = cell_length
    centre = (0.0, 0.0)
    if fitted and aligned and not along_bias:
        _, along = shapes.fit_along_yarns(u1 - u0, cell_length, bool(planes))
        _, across = shapes.fit_along_yarns(v1 - v0, cell_length, bool(planes))
        # The first line lies on the edge of the outline, so the centre of the press may lie between crossings.
        centre = (-u0 / along, -v0 / across)
    elif fitted and along_bias:
        along = across = shapes.fit_along_bias(x1 - x0, y1 - y0, cell_length, bool(planes))
        start = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        c, s = math.cos(warp_angle), math.sin(warp_angle)
        middle = (c * start[0] + s * start[1], -s * start[0] + c * start[1])
        # The corners are crossings. With an odd number of half diagonals from the middle to a corner the middle is none.
        diagonals = round((x1 - x0) / (math.sqrt(2.0) * along)) + round((y1 - y0) / (math.sqrt(2.0) * along))
        shift = 0.5 * (diagonals % 2)
        centre = (shift - middle[0] / along, shift - middle[1] / across)
    if part.area / (along * across) > LARGEST_GRID:
        _too_many(part.area / (along * across))
    u0, v0, u1, v1 = shapes.bounds_along(part, warp_angle)
    tolerance = 1e-6
    first_i = math.floor(centre[0] + u0 / along + tolerance)
    first_j = math.floor(centre[1] + v0 / across + tolerance)
    columns = math.ceil(centre[0] + u1 / along - tolerance) - first_i + 1
    rows = math.ceil(centre[1] + v1 / across - tolerance) - first_j + 1
    if rows < 2 or columns < 2:
        _no_cell(cell_length)
    if (rows - 1) * (columns - 1) > 2 * LARGEST_GRID:
        _too_many((rows - 1) * (columns - 1))
    grid = YarnGrid(
        cells=np.zeros((rows - 1, columns - 1), np.int8),
        warp_pitch=along,
        weft_pitch=across,
        centre=(_tidy(centre[0]) - first_i, _tidy(centre[1]) - first_j),
        warp_angle=warp_angle,
        planes=planes,
        requested_area=float(part.area),
    )
    cells = _best_cells(grid, part)
    if not cells.any():
        _no_cell(cell_length)
    if np.count_nonzero(cells) > LARGEST_GRID:
        _too_many(float(np.count_nonzero(cells)))
    rows_used = np.flatnonzero(cells.any(axis=1))
    columns_used = np.flatnonzero(cells.any(axis=0))
    j0, i0 = int(rows_used[0]), int(columns_used[0])
    cells = cells[j0 : rows_used[-1] + 1, i0 : columns_used[-1] + 1]
    return YarnGrid(
        cells=np.ascontiguousarray(cells),
        warp_pitch=along,
        weft_pitch=across,
        centre=(grid.centre[0] - i0, grid.centre[1] - j0),
        warp_angle=warp_angle,
        planes=planes,
        requested_area=float(part.area),
    )


def _tidy(coordinate: float) -> float:
    """Take rounding errors off a grid coordinate that is meant to be a multiple of a quarter."""
    nearest = round(4.0 * coordinate) / 4.0
    return nearest if abs(coordinate - nearest) < 1e-9 else coordinate


def _no_cell(cell_length: float) -> None:
    raise StudyError(
        "the blank holds no cell",
        key="blank.cell_length_mm",
        got=f"{cell_length:g} mm",
        hint="choose a cell length well below the size of the blank",
    )


def _too_many(count: float) -> None:
    raise StudyError(
        f"the blank would have {count:.3g} cells",
        key="blank.cell_length_mm",
        expected=f"at most {LARGEST_GRID:,} cells",
        hint="choose a larger cell length",
    )


def _best_cells(grid: YarnGrid, part: Polygon) -> NDArray[np.int8]:
    """For each place the whole cell, half cell or nothing that differs least in area from the outline."""
    shapely.prepare(part)
    rows, columns = grid.cells.shape
    cells = np.zeros((rows, columns), np.int8)
    corners = grid.flat[..., :2]
    rings = np.stack([corners[dj : dj + rows, di : di + columns] for di, dj in CORNERS], axis=2)
    quads = shapely.polygons(rings.reshape(-1, 4, 2))
    area = grid.cell_area
    inside = shapely.contains(part, quads)
    cells.reshape(-1)[inside] = Cell.WHOLE
    partly = np.flatnonzero(~inside & shapely.intersects(part, quads))
    if partly.size:
        ring = rings.reshape(-1, 4, 2)[partly]
        covered = shapely.area(shapely.intersection(part, quads[partly]))
        miss = [covered, area - covered]
        for lacked in range(4):
            triangle = shapely.polygons(ring[:, [k for k in range(4) if k != lacked]])
            within = shapely.area(shapely.intersection(part, triangle))
            miss.append(0.5 * area - within + covered - within)
        best = np.round(np.asarray(miss) / area, 9).argmin(axis=0)
        cells.reshape(-1)[partly] = best
    return _one_piece(cells)


def _one_piece(cells: NDArray[np.int8]) -> NDArray[np.int8]:
    """Drop crumbs: cells that share no side with the largest piece."""
    if _rows_overlap(cells != Cell.ABSENT):
        return cells
    from scipy import ndimage  # half a second that most blanks do not need

    pieces, count = ndimage.label(cells != Cell.ABSENT)
    if count <= 1:
        return cells
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    return np.where(pieces == sizes.argmax(), cells, np.int8(Cell.ABSENT))


def _rows_overlap(there: NDArray[np.bool_]) -> bool:
    """Whether each row is one run of cells and meets the next: then they are all one piece."""
    there = there[there.any(axis=1).argmax() : len(there) - there[::-1].any(axis=1).argmax()]
    first = there.argmax(axis=1)
    last = there.shape[1] - there[:, ::-1].argmax(axis=1)
    whole = there.sum(axis=1) == last - first
    return bool(whole.all() and (np.maximum(first[1:], first[:-1]) < np.minimum(last[1:], last[:-1])).all())
