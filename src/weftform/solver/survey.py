"""A look at the whole state between batches of steps: extremes for the stable step, and gaps for the contact search."""

from __future__ import annotations

import math

import numba
import numpy as np

from weftform.mechanics.compiled import FASTMATH
from weftform.mechanics.contact import rounded_edge
from weftform.mechanics.membrane import half_tangent
from weftform.mechanics.piecewise import piecewise_slope, piecewise_value
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

CLEAR, TOUCHING, ON_FACE = 0, 1, 2
"""How a row stands to a tool until the next survey: out of reach, within reach, within reach of its flat face only."""

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
        Output, shape [tools, local rows]: :data:`CLEAR`, :data:`TOUCHING` or :data:`ON_FACE`.
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
    from_edge = np.full((tools, rows), np.inf)
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
                from_edge[k, j] = min(from_edge[k, j], tool_table[k, 0] * (tool_table[k, 1] - away))
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
                g2 = left * (state[u + p] - state[n + p]) + (1.0 - left) * (state[u + 1 + p] - state[n + 1 + p])
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
        way = 2.0 * (out[FASTEST] * reach + abs(poses[k, 0] - poses[k, 3]) * ahead) + margin
        for j in range(rows):
            near = ON_FACE if from_edge[k, j] > way else TOUCHING
            touching[k, row_index[j]] = near if gaps[k, j] < way else CLEAR
            out[PENETRATION] = max(out[PENETRATION], -gaps[k, j])
    return out


SAMPLES = 17
"""Points at which a law is sampled for its largest value and slope."""


@numba.njit(fastmath=FASTMATH, error_model="numpy", cache=True)
def largest_on(coefficients, degree, pieces, width, end_slope, end):
    """Largest value and largest slope of a packed law on 0..end."""
    value = -math.inf
    slope = -math.inf
    for k in range(SAMPLES):
        x = end * k / (SAMPLES - 1)
        value = max(value, piecewise_value(coefficients, degree, pieces, width, end_slope, x))
        slope = max(slope, piecewise_slope(coefficients, degree, pieces, width, end_slope, x))
    return value, slope


@numba.njit(fastmath=FASTMATH, error_model="numpy", cache=True)
def contact_forces(rows, first_tool, tool_table, poses):
    """Force of all tools on each crossing [N], shape [rows, columns, 3], from fields of shape [rows, fields,
    columns].
    """
    count, _, columns = rows.shape
    total = np.zeros((count, columns, 3))
    for j in range(count):
        for i in range(columns):
            area = rows[j, at.AREA, i]
            x, y, z = rows[j, 0, i], rows[j, 1, i], rows[j, 2, i]
            away = math.sqrt(x * x + y * y)
            for k in range(tool_table.shape[0]):
                t = tool_table[k]
                distance, normal_s, normal_z = rounded_edge(away, z - poses[k, 0], t[0], t[1], t[2], t[3], t[4])
                press = t[6] * area * max(t[5] - distance, 0.0)
                radial = press * normal_s / max(away, 1e-12)
                field = first_tool + at.TOOL_FIELDS * k
                total[j, i, 0] += radial * x + rows[j, field, i]
                total[j, i, 1] += radial * y + rows[j, field + 1, i]
                total[j, i, 2] += press * normal_z + rows[j, field + 2, i]
    return total
