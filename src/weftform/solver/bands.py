"""Which rows each thread takes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from weftform.solver.problem import Problem
from weftform.solver.spans import row_spans

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

ROW_COST = 8.0
"""Crossings whose work is that of beginning and ending a row."""
FACE_COST, EDGE_COST = 0.2, 0.65
"""Work of contact with the flat face and with the rounded edge of a tool, in crossings without contact: what `weftform bench`
finds beside sheets without contact, roughly. Only how evenly threads share the work depends on these."""
LEAST_ROWS = 2
"""Of a band, so that no two of its neighbours share one."""


def share_rows(problem: Problem, bands: int) -> Ints:
    """Where bands of rows begin and end, so that each has about the same work; shape [bands + 1]."""
    cost = row_spans(problem.grid.active)[:, 5] + ROW_COST
    cost[-1] = ROW_COST  # there are no cells above it
    return even_edges(cost + contact_cost(problem), bands)


def contact_cost(problem: Problem) -> Floats:
    """Work of contact of each row with the tools above and below it while the blank is flat, in crossings; shape [rows]."""
    grid = problem.grid
    away = np.hypot(grid.flat[..., 0], grid.flat[..., 1])
    cost = np.zeros(grid.shape)
    for tool in problem.tools:
        inward = tool.side_s * (tool.s0 - away)
        cost += np.where(inward > 0.0, FACE_COST, np.where(inward > -abs(tool.radius), EDGE_COST, 0.0))
    return np.asarray(np.where(grid.active, cost, 0.0).sum(axis=1))


def even_edges(cost: Floats, bands: int) -> Ints:
    """Where bands of rows begin and end so that each has the same work, as nearly as whole rows allow.

    Parameters
    ----------
    cost
        Of each row, shape [rows].
    bands
        At most half as many as rows.

    Returns
    -------
    shape [bands + 1]. Each band but the first also has the work of the row before it, whose cells its own first row needs.
    """
    until = np.concatenate([[0], np.cumsum(cost)])
    again = np.maximum(np.arange(bands + 1) - 1, 0) * cost.max()
    wanted = np.arange(bands + 1) / bands * (until[-1] + again[-1]) - again
    edges = np.searchsorted(until, wanted - 0.5 * cost.max())
    inner = np.arange(bands + 1) * LEAST_ROWS
    edges = np.maximum.accumulate(np.maximum(edges - inner, 0)) + inner
    shared: Ints = np.minimum(edges, len(cost) - inner[::-1]).astype(np.int64)
    shared[-1] = len(cost)
    return shared
