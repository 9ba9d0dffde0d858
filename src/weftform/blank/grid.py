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
from numpy.typing import NDArray

Floats = NDArray[np.float64]


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
    def outside(self) -> tuple[NDArray[np.intp], ...]:
        """Rows and columns of the places where no crossing of the blank is."""
        return np.nonzero(~self.active)

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
