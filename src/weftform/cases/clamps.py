"""Crossings held and moved by a testing machine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from weftform.blank import YarnGrid
from weftform.solver import Driven

Floats = NDArray[np.float64]
Nodes = NDArray[np.int64]


def nodes_where(grid: YarnGrid, chosen: NDArray[np.bool_]) -> Nodes:
    """Flat indices of the crossings of the blank that are chosen, from a mask of shape [rows, columns]."""
    return np.flatnonzero((chosen & grid.active).ravel())


def ends(grid: YarnGrid, axis: int) -> tuple[Nodes, Nodes]:
    """Crossings on the lowest and on the highest edge along x (0) or y (1)."""
    along = grid.flat[..., axis]
    tolerance = 1e-6 * grid.warp_pitch
    low, high = along[grid.active].min(), along[grid.active].max()
    return nodes_where(grid, along < low + tolerance), nodes_where(grid, along > high - tolerance)


def clamped(grid: YarnGrid, fixed: Nodes, moving: Nodes, axis: int) -> Driven:
    """Two clamps: all components held, one of them moved along x (0) or y (1) by motion 0."""
    nodes = np.concatenate([fixed, moving])
    modes = np.zeros((1, len(nodes), 3))
    modes[0, len(fixed) :, axis] = 1.0
    return Driven(nodes, np.ones((len(nodes), 3), bool), modes, (0,), (0,))
