"""Which part of each row the loops run over: a blank at 45 degrees fills only half of its window on the grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from weftform.solver.layout import LANES


def row_spans(active: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Begin and length of the loops of each row.

    Parameters
    ----------
    active
        Crossings of the blank, shape [rows, columns].

    Returns
    -------
    shape [rows, 6]: begin and length for crossings, for warp edges, and for the cells and weft edges above the row.
    Both are multiples of ``layout.LANES``; a span may end in the padding of the row.

    Notes
    -----
    Scratch rows keep what the row before wrote, so each loop has to cover whatever a later one reads: warp edges
    reach one place beyond the crossings of the row and of its neighbours, and the cells above a row as far as the
    warp edges of both its rows.
    """
    columns = active.shape[1]
    first = np.where(active.any(axis=1), active.argmax(axis=1), columns)
    last = np.where(active.any(axis=1), columns - 1 - active[:, ::-1].argmax(axis=1), -1)

    def hull(low: NDArray[np.int64], high: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Smallest spans that hold those of a row and of its two neighbours."""
        padded_low = np.concatenate([[columns], low, [columns]])
        padded_high = np.concatenate([[-1], high, [-1]])
        return (
            np.minimum(np.minimum(padded_low[:-2], padded_low[1:-1]), padded_low[2:]),
            np.maximum(np.maximum(padded_high[:-2], padded_high[1:-1]), padded_high[2:]),
        )

    wide_first, wide_last = hull(first, last)
    wide_first = np.maximum(wide_first - 1, 0)
    above_first = np.minimum(wide_first, np.append(wide_first[1:], columns))
    above_last = np.maximum(wide_last, np.append(wide_last[1:], -1))
    spans = []
    for low, high in ((first, last), (wide_first, wide_last), (above_first, above_last)):
        begin = np.minimum(low, columns - 1) // LANES * LANES
        spans.append((begin, np.where(high >= low, -(-(high + 1 - begin) // LANES) * LANES, 0)))
    return np.column_stack([column for pair in spans for column in pair]).astype(np.int64)
