"""The whole part as polygons, mirrored from the modelled half or quarter, coarsened where a picture cannot show all."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from weftform.blank import Cell, YarnGrid
from weftform.blank.grid import CORNERS, LACKED

Floats = NDArray[np.float64]

MOST_DRAWN = 40_000
"""Cells of the whole part above which blocks of cells are drawn as one."""


@dataclass(frozen=True)
class Patches:
    """Polygons of the modelled part.

    Attributes
    ----------
    nodes
        Flat node indices of the corners in order, shape [polygons, 4]. A half cell repeats its last corner; its
        first three corners run along its two yarns.
    triangle
        Whether each is a half cell, shape [polygons].
    places
        (j, i) of the cells drawn one by one, shape [singles, 2]; they come first.
    blocks
        (row, column) of the blocks of ``stride`` x ``stride`` whole cells drawn as one, shape [blocks, 2].
    stride
        Cells along the side of a block; 1 where there is none.
    """

    nodes: NDArray[np.int64]
    triangle: NDArray[np.bool_]
    places: NDArray[np.int64]
    blocks: NDArray[np.int64]
    stride: int

    def sample(self, values: Floats) -> Floats:
        """Values of the polygons from those of the cells (shape [rows - 1, columns - 1]); mean over blocks."""
        single = values[self.places[:, 0], self.places[:, 1]]
        if self.stride == 1:
            return single
        return np.concatenate([single, _block_mean(values, self.stride)[self.blocks[:, 0], self.blocks[:, 1]]])


@dataclass(frozen=True)
class WholePart:
    """Polygons of the whole part.

    Attributes
    ----------
    corners
        Corners in order [mm], shape [polygons, 4, 3]; half cells as in :class:`Patches`.
    triangle
        Whether each is a half cell, shape [polygons].
    values
        Value of each, shape [polygons].
    stride
        Cells along the side of the largest polygons.
    """

    corners: Floats
    triangle: NDArray[np.bool_]
    values: Floats
    stride: int

    @property
    def normals(self) -> Floats:
        """Unit normals, upwards for the flat blank, shape [polygons, 3]."""
        a, b = self.corners[:, 2] - self.corners[:, 0], self.corners[:, 3] - self.corners[:, 1]
        normal = np.cross(a, b)
        return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300))

    @property
    def areas(self) -> Floats:
        """Area of each polygon [mm2], shape [polygons]; of the two triangles around its first diagonal."""
        a, b, c = (self.corners[:, k] - self.corners[:, 0] for k in (1, 2, 3))
        halves = [np.linalg.norm(np.cross(p, q), axis=1) for p, q in ((a, b), (b, c))]
        return np.asarray(0.5 * (halves[0] + halves[1]))

    def note(self) -> str:
        """What the caption has to say about the drawing."""
        if self.stride == 1:
            return ""
        n = self.stride
        return f"Drawn in blocks of {n} × {n} cells: mean values, one in {n} lines of the mesh."


def patches(grid: YarnGrid, most: int = MOST_DRAWN) -> Patches:
    """Polygons that show the modelled part.

    Parameters
    ----------
    most
        Cells of the whole part that may be drawn one by one; beyond, whole cells go together in square blocks as far
        as they fill them, so that the edge of the blank stays as it is.
    """
    stride = max(1, math.ceil(math.sqrt(grid.cell_count * grid.copies / most)))
    columns = grid.shape[1]
    whole = grid.cells == Cell.WHOLE
    blocks = np.empty((0, 2), np.int64)
    single = grid.cells != Cell.ABSENT
    if stride > 1:
        filled = _block_mean(whole.astype(float), stride) == 1.0
        blocks = np.argwhere(filled)
        covered = np.kron(filled, np.ones((stride, stride), bool))
        single = single.copy()
        single[: covered.shape[0], : covered.shape[1]] &= ~covered
    places = np.argwhere(single)
    kinds = grid.cells[places[:, 0], places[:, 1]]
    order = np.tile(np.arange(4), (len(places), 1))
    for kind, lacked in LACKED.items():
        order[kinds == kind] = [(lacked + k) % 4 for k in (1, 2, 3, 3)]
    di, dj = (np.array([corner[k] for corner in CORNERS]) for k in (0, 1))
    nodes = (places[:, :1] + dj[order]) * columns + places[:, 1:] + di[order]
    block_nodes = stride * ((blocks[:, :1] + dj) * columns + blocks[:, 1:] + di)
    return Patches(
        nodes=np.vstack([nodes, block_nodes]).astype(np.int64),
        triangle=np.concatenate([kinds != Cell.WHOLE, np.zeros(len(blocks), bool)]),
        places=places,
        blocks=blocks,
        stride=stride,
    )


def whole_part(
    grid: YarnGrid,
    positions: Floats,
    values: Floats,
    *,
    mirrored: Floats | None = None,
    most: int = MOST_DRAWN,
) -> WholePart:
    """The whole part, mirrored in the planes of symmetry.

    Parameters
    ----------
    positions
        Positions of the crossings [mm], shape [rows, columns, 3].
    values
        Of the cells, shape [rows - 1, columns - 1].
    mirrored
        Values that the image in one plane has, where they differ (see :class:`weftform.report.quantities.Quantity`).
    most
        See :func:`patches`.
    """
    drawn = patches(grid, most)
    corners = positions.reshape(-1, 3)[drawn.nodes]
    own = drawn.sample(values)
    image = own if mirrored is None else drawn.sample(mirrored)
    signs = itertools.product(*((1.0, -1.0) if plane in grid.planes else (1.0,) for plane in ("x", "y")), (1.0,))
    parts, shown = [], []
    for sign in signs:
        odd = math.prod(sign) < 0.0
        # a mirror image turns the polygons over: go round them the other way, the yarns of half cells first again
        ring = corners * np.array(sign)
        if odd:
            ring = np.where(drawn.triangle[:, None, None], ring[:, [2, 1, 0, 0]], ring[:, [0, 3, 2, 1]])
        parts.append(ring)
        shown.append(image if odd else own)
    return WholePart(
        corners=np.concatenate(parts),
        triangle=np.tile(drawn.triangle, grid.copies),
        values=np.concatenate(shown),
        stride=drawn.stride,
    )


def _block_mean(values: Floats, stride: int) -> Floats:
    """Mean over blocks of cells that fit whole, shape [(rows - 1) // stride, (columns - 1) // stride]."""
    rows, columns = (n // stride for n in values.shape)
    blocks = values[: rows * stride, : columns * stride].reshape(rows, stride, columns, stride)
    return np.asarray(blocks.mean(axis=(1, 3)))
