"""The yarn grid: a window on a structured grid of yarn crossings.

Mesh lines are yarns. Index ``i`` counts crossings along a warp yarn, ``j`` along a weft yarn; arrays are indexed
``[j, i]``. An outline or a plane of symmetry that runs along the bias is met by half cells: right triangles, one
corner missing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from weftform.blank import outline as shapes
from weftform.errors import StudyError

Floats = NDArray[np.float64]

LARGEST_GRID = 20_000_000
"""Cells; above this the memory of a laptop does not hold a run."""


class Cell(IntEnum):
    """What stands at a place of the grid; half cells are named by the corner they lack."""

    ABSENT = 0
    WHOLE = 1
    LACKS_00 = 2
    LACKS_10 = 3
    LACKS_11 = 4
    LACKS_01 = 5


CORNERS = ((0, 0), (1, 0), (1, 1), (0, 1))
"""Corners of a cell in order around it, as (di, dj)."""

LACKED = {Cell.LACKS_00: 0, Cell.LACKS_10: 1, Cell.LACKS_11: 2, Cell.LACKS_01: 3}


@dataclass(frozen=True)
class YarnGrid:
    """Yarn crossings, cells and lines of a flat blank.

    Attributes
    ----------
    cells
        :class:`Cell` codes, shape [rows - 1, columns - 1].
    warp_pitch, weft_pitch
        Cell length along the warp and along the weft [mm].
    centre
        Grid coordinates (i, j) of the blank's centre; whole numbers where a crossing lies there.
    warp_angle
        Angle from the x axis to the warp [rad].
    planes
        Planes of symmetry, of ``"x"`` and ``"y"`` (named by their normal).
    requested_area
        Area of the modelled part of the declared outline [mm2].
    """

    cells: NDArray[np.int8]
    warp_pitch: float
    weft_pitch: float
    centre: tuple[float, float]
    warp_angle: float
    planes: tuple[str, ...]
    requested_area: float

    @property
    def shape(self) -> tuple[int, int]:
        """Crossings: (rows along the weft, columns along the warp)."""
        return self.cells.shape[0] + 1, self.cells.shape[1] + 1

    @property
    def cell_area(self) -> float:
        """Flat area of a whole cell [mm2]."""
        return self.warp_pitch * self.weft_pitch

    @cached_property
    def cell_share(self) -> Floats:
        """1 for whole cells, 0.5 for half cells, 0 where there is none, shape [rows - 1, columns - 1]."""
        return np.where(self.cells == Cell.WHOLE, 1.0, np.where(self.cells == Cell.ABSENT, 0.0, 0.5))

    @property
    def cell_count(self) -> int:
        """Whole and half cells."""
        return int(np.count_nonzero(self.cells))

    @property
    def has_half_cells(self) -> bool:
        return bool((self.cells > Cell.WHOLE).any())

    @property
    def area(self) -> float:
        """Flat area of the modelled part [mm2]."""
        return float(self.cell_share.sum()) * self.cell_area

    @property
    def copies(self) -> int:
        """How many times the modelled part makes up the blank: 1, 2 or 4."""
        return int(2 ** len(self.planes))

    @cached_property
    def axes(self) -> tuple[float, float]:
        """Cosine and sine of the warp angle, exact at multiples of 45 degrees."""
        eighths = self.warp_angle / (math.pi / 4)
        if abs(eighths - round(eighths)) < 1e-12:
            half = math.sqrt(0.5)
            c = (1.0, half, 0.0, -half, -1.0, -half, 0.0, half)
            k = round(eighths) % 8
            return c[k], c[(k - 2) % 8]
        return math.cos(self.warp_angle), math.sin(self.warp_angle)

    @property
    def along_bias(self) -> bool:
        """Whether the yarns make 45 degrees with the axes of the press."""
        c, s = self.axes
        return abs(abs(c) - abs(s)) < 1e-12

    @cached_property
    def material(self) -> Floats:
        """Yarn coordinates (U along warp, V along weft) of the crossings from the centre [mm], shape [rows,
        columns, 2].
        """
        rows, columns = self.shape
        u = (np.arange(columns) - self.centre[0]) * self.warp_pitch
        v = (np.arange(rows) - self.centre[1]) * self.weft_pitch
        return np.stack(np.broadcast_arrays(u[None, :], v[:, None]), axis=-1)

    def plan(self, material: Floats) -> Floats:
        """Flat position (x, y) of material points (U, V) [mm], shape [..., 2]."""
        c, s = self.axes
        u, v = material[..., 0], material[..., 1]
        return np.stack([c * u - s * v, s * u + c * v], axis=-1)

    def material_at(self, plan: Floats) -> Floats:
        """Material point (U, V) of flat positions (x, y) [mm], shape [..., 2]."""
        c, s = self.axes
        x, y = plan[..., 0], plan[..., 1]
        return np.stack([c * x + s * y, -s * x + c * y], axis=-1)

    @cached_property
    def flat(self) -> Floats:
        """Flat positions of the crossings [mm], shape [rows, columns, 3]."""
        plan = self.plan(self.material)
        return np.concatenate([plan, np.zeros((*plan.shape[:2], 1))], axis=-1)

    @cached_property
    def node_area(self) -> Floats:
        """Flat area that belongs to each crossing [mm2], shape [rows, columns]; 0 outside the blank."""
        area = np.zeros(self.shape)
        for corner, (di, dj) in enumerate(CORNERS):
            share = np.where(self.cells == Cell.WHOLE, 0.25, np.where(self.cells == Cell.ABSENT, 0.0, 1.0 / 6.0))
            # half of a whole cell's share on a plane of symmetry, a whole one off it
            on = self.on_plane[dj : dj + self.cells.shape[0], di : di + self.cells.shape[1]].any(axis=-1)
            share = np.where(self.mirrors[0] > 0.0, np.where(on, 0.125, 0.25), share)
            for kind, lacked in LACKED.items():
                if lacked == corner:
                    share = np.where(self.cells == kind, 0.0, share)
            area[dj : dj + self.cells.shape[0], di : di + self.cells.shape[1]] += share * self.cell_area
        return area

    @cached_property
    def active(self) -> NDArray[np.bool_]:
        """Crossings that belong to the blank, shape [rows, columns]."""
        return np.asarray(self.node_area > 0.0)

    def _legs(self, first: int, second: int) -> NDArray[np.bool_]:
        """Cells that have the edge between two neighbouring corners."""
        has = self.cells != Cell.ABSENT
        for kind, lacked in LACKED.items():
            if lacked in (first, second):
                has = has & (self.cells != kind)
        return np.asarray(has)

    @cached_property
    def warp_lines(self) -> Floats:
        """Weight of each warp connector: 1, or 0.5 on a plane of symmetry, 0 where none; shape [rows, columns - 1]."""
        rows, columns = self.shape
        present = np.zeros((rows, columns - 1), bool)
        present[:-1] |= self._legs(0, 1)
        present[1:] |= self._legs(3, 2)
        on = self.on_plane[:, :-1] & self.on_plane[:, 1:]
        return present * np.where(on.any(axis=-1), 0.5, 1.0)

    @cached_property
    def weft_lines(self) -> Floats:
        """Weight of each weft connector, shape [rows - 1, columns]."""
        rows, columns = self.shape
        present = np.zeros((rows - 1, columns), bool)
        present[:, :-1] |= self._legs(0, 3)
        present[:, 1:] |= self._legs(1, 2)
        on = self.on_plane[:-1] & self.on_plane[1:]
        return present * np.where(on.any(axis=-1), 0.5, 1.0)

    @cached_property
    def on_plane(self) -> NDArray[np.bool_]:
        """Whether each crossing lies on the planes x = 0, y = 0 of symmetry, shape [rows, columns, 2]."""
        near = np.abs(self.flat[..., :2]) < 1e-6 * min(self.warp_pitch, self.weft_pitch)
        return np.asarray(near & np.array([plane in self.planes for plane in ("x", "y")]))

    @cached_property
    def edge_weights(self) -> tuple[Floats, Floats]:
        """Share of the lower warp edge and of the left weft edge in a cell's yarn vectors (0.5 each in a whole
        cell).
        """
        lower = np.full(self.cells.shape, 0.5)
        left = np.full(self.cells.shape, 0.5)
        for kind, low, lef in (
            (Cell.LACKS_00, 0.0, 0.0),
            (Cell.LACKS_10, 0.0, 1.0),
            (Cell.LACKS_11, 1.0, 1.0),
            (Cell.LACKS_01, 1.0, 0.0),
        ):
            lower[self.cells == kind] = low
            left[self.cells == kind] = lef
        return lower, left

    @cached_property
    def mirrors(self) -> tuple[Floats, Floats]:
        """How the yarn vectors of half cells on planes of symmetry are completed by their mirror images.

        The other half of such a cell is its image ``M``, so the missing warp edge is ``+-M`` of the weft edge that is there: the
        mean yarn vectors of the whole cell are ``g1 = (w + S f) / 2`` and ``g2 = (f + S w) / 2`` with the edges ``w`` and ``f`` of
        the half and ``S = +-M``, + where the plane runs from corner 00 to 11 and - where it runs from 10 to 01.

        Returns
        -------
        share
            0.5 where a half cell lies on a plane of symmetry, else 0, shape [rows - 1, columns - 1].
        signs
            Diagonal of S, shape [rows - 1, columns - 1, 3].
        """
        rows, columns = self.cells.shape
        share = np.zeros((rows, columns))
        signs = np.ones((rows, columns, 3))
        corner = [self.on_plane[dj : dj + rows, di : di + columns] for di, dj in CORNERS]
        for kind, lacked in LACKED.items():
            cut = corner[(lacked + 1) % 4] & corner[(lacked + 3) % 4]
            for axis in (0, 1):
                here = (self.cells == kind) & cut[..., axis]
                mirror = np.ones(3)
                mirror[axis] = -1.0
                share[here] = 0.5
                signs[here] = mirror if lacked in (1, 3) else -mirror
        return share, signs

    @cached_property
    def cut_cells(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows and columns of the half cells on planes of symmetry."""
        rows, columns = np.nonzero(self.mirrors[0])
        return rows, columns

    @cached_property
    def corners_known(self) -> NDArray[np.bool_]:
        """Corners of cells at which two connectors meet, or one and the mirror image of another: shape [4, rows - 1,
        columns - 1] in the order of :data:`CORNERS`.
        """
        cut = self.mirrors[0] > 0.0
        warp, weft = self.warp_lines > 0.0, self.weft_lines > 0.0
        lower, upper, left, right = (present | cut for present in (warp[:-1], warp[1:], weft[:, :-1], weft[:, 1:]))
        exists = self.cells != Cell.ABSENT
        return np.asarray(np.stack([lower & left, lower & right, upper & right, upper & left]) & exists)

    @cached_property
    def quads(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Cells as polygons: flat node indices, offsets of each polygon, and (j, i) of each, shape [cells, 2]."""
        columns = self.shape[1]
        places = np.argwhere(self.cells != Cell.ABSENT)
        kinds = self.cells[places[:, 0], places[:, 1]]
        corners = np.stack([(places[:, 0] + dj) * columns + places[:, 1] + di for di, dj in CORNERS], axis=1)
        keep = np.ones(corners.shape, bool)
        for kind, lacked in LACKED.items():
            keep[kinds == kind, lacked] = False
        offsets = np.concatenate([[0], np.cumsum(keep.sum(axis=1))])
        return corners[keep], offsets, places

    @cached_property
    def edge_loops(self) -> list[NDArray[np.int64]]:
        """Edge of the modelled part as chains of flat node indices, without the planes of symmetry, longest first."""
        indices, offsets, _ = self.quads
        following: dict[int, list[int]] = {}
        edges: set[tuple[int, int]] = set()
        for a, b in pairwise(offsets):
            ring = indices[a:b]
            edges.update((int(p), int(q)) for p, q in zip(ring, np.roll(ring, -1), strict=True))
        on = self.on_plane.reshape(-1, 2)
        for p, q in edges:
            if (q, p) not in edges and not (on[p] & on[q]).any():
                following.setdefault(p, []).append(q)
        arrivals = {q for ends in following.values() for q in ends}
        loops = []
        while following:
            free = [p for p in following if p not in arrivals]
            chain = [free[0] if free else min(following)]
            while following.get(chain[-1]):
                ends = following[chain[-1]]
                nxt = ends.pop()
                if not ends:
                    del following[chain[-1]]
                chain.append(nxt)
            loops.append(np.asarray(chain))
            arrivals = {q for ends in following.values() for q in ends}
        return sorted(loops, key=len, reverse=True)

    def fold(self, material: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Material points of the whole blank brought into the modelled part, and in which planes they were mirrored.

        Returns
        -------
        folded
            (U, V) [mm], shape [..., 2].
        mirrored
            Whether x and y were mirrored, shape [..., 2].
        """
        plan = self.plan(np.asarray(material, float))
        mirrored = (plan < 0.0) & np.array([plane in self.planes for plane in ("x", "y")])
        return self.material_at(np.where(mirrored, -plan, plan)), mirrored


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
