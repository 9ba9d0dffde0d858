"""The edge of the blank, flat and formed, and how far it was drawn in."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from weftform.blank import YarnGrid

Floats = NDArray[np.float64]


def formed_outline(grid: YarnGrid, positions: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Edge of the whole blank, mirrored from the modelled part, as one chain of points in order around it.

    Parameters
    ----------
    positions
        Positions of the crossings [mm], shape [rows, columns, 3].

    Returns
    -------
    flat, formed, modelled
        Flat (x, y) [mm], shape [points, 2]; formed (x, y, z) [mm], shape [points, 3]; whether each point is in
        the modelled part.
    """
    chain = grid.edge_loops[0]
    flat = grid.flat.reshape(-1, 3)[chain, :2]
    formed = positions.reshape(-1, 3)[chain]
    modelled = np.ones(len(chain), bool)
    for axis, plane in enumerate(("x", "y")):
        if plane not in grid.planes:
            continue
        sign = np.ones(3)
        sign[axis] = -1.0
        # go on from the end that lies on the plane
        if abs(flat[-1, axis]) > abs(flat[0, axis]):
            flat, formed, modelled = flat[::-1], formed[::-1], modelled[::-1]
        image, shape = flat[::-1] * sign[:2], formed[::-1] * sign
        skip = 1 if abs(flat[-1, axis]) < 1e-9 else 0
        flat = np.vstack([flat, image[skip:]])
        formed = np.vstack([formed, shape[skip:]])
        modelled = np.concatenate([modelled, np.zeros(len(image) - skip, bool)])
    if np.allclose(flat[0], flat[-1]):
        return flat, formed, modelled
    return np.vstack([flat, flat[:1]]), np.vstack([formed, formed[:1]]), np.append(modelled, modelled[:1])


def draw_in(flat: Floats, formed: Floats, corner_angle: float) -> dict[str, float]:
    """Inward displacement in plan view of three points of the edge [mm].

    Parameters
    ----------
    flat, formed
        Closed edge, see :func:`formed_outline`.
    corner_angle
        Polar angle of the corner of the flat blank [rad].

    Returns
    -------
    ``edge_x`` and ``edge_y``: the points of the flat edge on the axes x and y; ``corner``: along the diagonal.
    """
    found = {}
    for name, angle in (("edge_x", 0.0), ("edge_y", 0.5 * math.pi), ("corner", corner_angle)):
        direction = np.array([math.cos(angle), math.sin(angle)])
        k, share = _crossing(flat, direction)
        start = (1 - share) * flat[k] + share * flat[k + 1]
        end = (1 - share) * formed[k, :2] + share * formed[k + 1, :2]
        found[name] = float((start - end) @ direction)
    return found


def _crossing(flat: Floats, direction: Floats) -> tuple[int, float]:
    """Segment of the closed edge that a ray from the centre leaves through, and where on it (0..1)."""
    normal = np.array([-direction[1], direction[0]])
    side = flat @ normal
    ahead = flat @ direction
    best = (-math.inf, 0, 0.0)
    for k in range(len(flat) - 1):
        if (side[k] <= 1e-9 and side[k + 1] > 1e-9) or (side[k] > 1e-9 and side[k + 1] <= 1e-9):
            share = float(np.clip(side[k] / (side[k] - side[k + 1]), 0.0, 1.0))
            reach = (1 - share) * ahead[k] + share * ahead[k + 1]
            if reach > best[0]:
                best = (reach, k, share)
    return best[1], best[2]
