"""A look at the whole state between batches of steps: extremes for the stable step, and gaps for the contact search."""

from __future__ import annotations

import math

import numba
import numpy as np

from weftform.mechanics.compiled import FASTMATH
from weftform.mechanics.contact import rounded_edge
from weftform.mechanics.membrane import half_tangent
from weftform.solver import layout as at

# what a survey returns
WARP_STRAIN = 0
"""Largest nominal strain of a warp connector."""
WEFT_STRAIN = 1
HALF_TANGENT = 2
"""Largest |tan(gamma / 2)|."""
FASTEST = 3
"""Largest speed [mm/s]."""
PENETRATION = 4
"""Largest penetration into a tool [mm]."""
FINITE = 5
"""1 while every crossing is where a crossing can be."""
WORST_ROW = 6
WORST_COLUMN = 7
SLACKEST = 8
"""Smallest nominal strain of a connector (negative: shortened)."""
ENTRIES = 9

LARGEST_SPEED = 1.0e8
"""mm/s; a crossing faster than that (100 km/s) belongs to a run that has blown up."""
LARGEST_STRAIN = 10.0
"""A connector eleven times its length belongs to a run that has blown up."""


@numba.njit(fastmath=FASTMATH, error_model="numpy", cache=True, nogil=True)
def survey(
    state, row_index, columns, stride, fields, half_cells, edge_weight, tools, warp_pitch, weft_pitch,
    tool_table, poses, touching, reach, ahead, margin,
):  # fmt: skip
    """Survey the state.

    Parameters
    ----------
    row_index
        Local row of each row of the grid, shape [rows].
    touching
        Output, shape [tools, local rows]: whether a row may touch a tool before the next survey.
    reach
        Time until the next survey [s]; with twice the largest speed it bounds how far a crossing can come.
    ahead
        Steps until the next survey.
    margin
        Gap below which a row counts as touching in any case [mm].

    Returns
    -------
    Array of shape [ENTRIES], see the constants of this module.
    """
    out = np.zeros(ENTRIES)
    out[FINITE] = 1.0
    rows = row_index.shape[0]
    length = fields * stride
    gaps = np.full((tools, rows), np.inf)
    fastest = 0.0
    longest_warp = 0.0
    longest_weft = 0.0
    shortest = math.inf
    sheared = 0.0
    for j in range(rows):
        base = row_index[j] * length
        above = row_index[j + 1] * length if j < rows - 1 else base
        for i in range(columns):
            n = base + i
            if state[n + at.AREA * stride] <= 0.0:
                continue
            x = state[n]
            y = state[n + stride]
            z = state[n + 2 * stride]
            vx = state[n + 3 * stride]
            vy = state[n + 4 * stride]
            vz = state[n + 5 * stride]
            speed = vx * vx + vy * vy + vz * vz
            if not (speed < LARGEST_SPEED**2 and math.isfinite(x + y + z)):
                out[FINITE] = 0.0
                out[WORST_ROW] = j
                out[WORST_COLUMN] = i
                return out
            fastest = max(fastest, speed)
            away = math.sqrt(x * x + y * y)
            for k in range(tools):
                distance, _, _ = rounded_edge(
                    away,
                    z - poses[k, 0],
                    tool_table[k, 0],
                    tool_table[k, 1],
                    tool_table[k, 2],
                    tool_table[k, 3],
                    tool_table[k, 4],
                )
                gaps[k, j] = min(gaps[k, j], distance - tool_table[k, 5])
            if state[n + at.WARP_LINE * stride] > 0.0:
                dx = state[n + 1] - x
                dy = state[n + 1 + stride] - y
                dz = state[n + 1 + 2 * stride] - z
                squared = (dx * dx + dy * dy + dz * dz) / (warp_pitch * warp_pitch)
                longest_warp = max(longest_warp, squared)
                shortest = min(shortest, squared)
                if squared > (1.0 + LARGEST_STRAIN) ** 2:
                    out[FINITE] = 0.0
                    out[WORST_ROW] = j
                    out[WORST_COLUMN] = i
            u = above + i
            if state[n + at.WEFT_LINE * stride] > 0.0:
                dx = state[u] - x
                dy = state[u + stride] - y
                dz = state[u + 2 * stride] - z
                squared = (dx * dx + dy * dy + dz * dz) / (weft_pitch * weft_pitch)
                longest_weft = max(longest_weft, squared)
                shortest = min(shortest, squared)
                if squared > (1.0 + LARGEST_STRAIN) ** 2:
                    out[FINITE] = 0.0
                    out[WORST_ROW] = j
                    out[WORST_COLUMN] = i
        if j == rows - 1:
            continue
        for i in range(columns - 1):
            n = base + i
            if state[n + at.VOLUME * stride] <= 0.0:
                continue
            u = above + i
            low = 0.5
            left = 0.5
            if half_cells:
                low = state[n + edge_weight * stride]
                left = state[n + (edge_weight + 1) * stride]
            g11 = 0.0
            g22 = 0.0
            g12 = 0.0
            for c in range(3):
                p = c * stride
                g1 = low * (state[n + 1 + p] - state[n + p]) + (1.0 - low) * (state[u + 1 + p] - state[u + p])
                g2 = left * (state[u + p] - state[n + p]) + (1.0 - left) * (
                    state[u + 1 + p] - state[n + 1 + p]
                )
                g11 += g1 * g1
                g22 += g2 * g2
                g12 += g1 * g2
            scale = warp_pitch * weft_pitch
            t = half_tangent(g11 / warp_pitch**2, g22 / weft_pitch**2, g12 / scale)
            sheared = max(sheared, abs(t))
    out[FASTEST] = math.sqrt(fastest)
    out[WARP_STRAIN] = math.sqrt(longest_warp) - 1.0
    out[WEFT_STRAIN] = math.sqrt(longest_weft) - 1.0
    out[SLACKEST] = math.sqrt(shortest) - 1.0 if shortest < math.inf else 0.0
    out[HALF_TANGENT] = sheared
    for k in range(tools):
        closing = 2.0 * (out[FASTEST] * reach + abs(poses[k, 0] - poses[k, 3]) * ahead) + margin
        for j in range(rows):
            touching[k, row_index[j]] = gaps[k, j] < closing
            out[PENETRATION] = max(out[PENETRATION], -gaps[k, j])
    return out
