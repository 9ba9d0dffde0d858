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
from weftform.solver.measures import metric_row, strain_row
from weftform.solver.rows import U1
from weftform.solver.vector_loops import row_loop, use_full_width

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
KINETIC = 9
"""Sum over the crossings of inertia area times squared speed [mm4/s2]."""
ENTRIES = 10

CLEAR, TOUCHING, ON_FACE = 0, 1, 2
"""How a crossing stands to a tool until the next survey: out of reach, within reach, within reach of its flat face."""

LARGEST_SPEED = 1.0e8
"""mm/s; a crossing faster than that (100 km/s) belongs to a run that has blown up."""
LARGEST_STRAIN = 10.0
"""A connector eleven times its length belongs to a run that has blown up."""


@row_loop
def speed_row(state, row, traits, trait, count, stride, fastest, broken, kinetic):
    """Largest squared speed so far in each column, a zero that turns NaN where a number is not finite, and kinetic energy."""
    use_full_width()
    s = np.uint64(stride)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    inertia = trait + s * np.uint64(at.INERTIA)
    for i in range(count):
        u, v, w = state[vx + i], state[vy + i], state[vz + i]
        speed = u * u + v * v + w * w
        fastest[i] = max(fastest[i], speed)
        kinetic[i] += traits[inertia + i] * speed
        broken[i] += 0.0 * (state[x + i] + state[y + i] + state[z + i] + speed)


@row_loop
def extremes_row(traits, weight, count, strain, longest, shortest):
    """Largest and smallest strain so far in each column, of the connectors that there are."""
    use_full_width()
    for i in range(count):
        there = traits[weight + i] > 0.0
        longest[i] = max(longest[i], strain[i] if there else -1.0)
        shortest[i] = min(shortest[i], strain[i] if there else math.inf)


@row_loop
def tangent_row(count, g11, g22, g12, sheared):
    """Largest ``|tan(gamma / 2)|`` so far in each column."""
    use_full_width()
    for i in range(count):
        sheared[i] = max(sheared[i], abs(half_tangent(g11[i], g22[i], g12[i])))


@row_loop
def gap_row(state, row, traits, trait, count, stride, tool, tool_z, gap, inward):
    """Gap between the surface of the fabric and a tool, and the way from its rounded edge inwards on its face."""
    use_full_width()
    s = np.uint64(stride)
    area = trait + s * np.uint64(at.AREA)
    side_s, s0, side_z, z0, radius, half_thickness = tool[0], tool[1], tool[2], tool[3], tool[4], tool[5]
    for i in range(count):
        x, y = state[row + i], state[row + s + i]
        away = math.sqrt(x * x + y * y)
        distance, _, _ = rounded_edge(away, state[row + s + s + i] - tool_z, side_s, s0, side_z, z0, radius)
        there = traits[area + i] > 0.0
        gap[i] = distance - half_thickness if there else math.inf
        inward[i] = side_s * (s0 - away) if there else math.inf


@numba.njit(fastmath=FASTMATH, error_model="numpy", cache=True, nogil=True)
def survey(
    state, traits, trait_rows, row_index, spans, stride, fields, trait_fields, half_cells, tools, warp_inverse, weft_inverse,
    sign_x, sign_y, tool_table, poses, pieces, reach, ahead, margin,
):  # fmt: skip
    """Survey the state.

    Parameters
    ----------
    row_index
        Local row of each row of the grid, shape [rows].
    spans
        Of each local row (:func:`weftform.solver.spans.row_spans`).
    sign_x, sign_y
        Of the mirror image that completes a half cell (:func:`weftform.blank.grid.mirrors`).
    pieces
        Output, shape [tools, local rows, 1 + most pieces, 3]: in the first entry how many pieces of the row a tool can
        touch until the next survey; then where each begins, its length, and :data:`TOUCHING` or :data:`ON_FACE`.
    reach
        Time until the next survey [s]; with twice the largest speed it bounds how far a crossing can come.
    ahead
        Steps until the next survey.
    margin
        Gap below which a crossing counts as touching in any case [mm].

    Returns
    -------
    Array of shape [ENTRIES], see the constants of this module.
    """
    out = np.zeros(ENTRIES)
    rows = row_index.shape[0]
    length = fields * stride
    fastest = np.zeros(stride)
    broken = np.zeros(stride)
    kinetic = np.zeros(stride)
    longest_warp = np.full(stride, -1.0)
    longest_weft = np.full(stride, -1.0)
    shortest = np.full(stride, np.inf)
    sheared = np.zeros(stride)
    strain, g11, g22, g12 = np.empty(stride), np.empty(stride), np.empty(stride), np.empty(stride)
    halves = np.full(stride, 0.5)
    weights = traits if half_cells else halves
    for j in range(rows):
        r = row_index[j]
        # as far as the cells above the row reach, of which a half one may have no crossing at its lower left corner
        begin = spans[r, 4]
        count = np.uint64(spans[r, 5])
        row = np.uint64(r * length + begin)
        above = np.uint64(row_index[min(j + 1, rows - 1)] * length + begin)
        trait = np.uint64(trait_rows[r] * trait_fields * stride + begin)
        speed_row(
            state, row, traits, trait, count, stride, fastest[begin:], broken[begin:], kinetic[begin:]
        )  # fmt: skip
        strain_row(state, row, row + U1, count, stride, warp_inverse, strain)
        weight = trait + np.uint64(at.WARP_LINE * stride)
        extremes_row(traits, weight, count, strain, longest_warp[begin:], shortest[begin:])
        if j == rows - 1:
            continue
        strain_row(state, row, above, count, stride, weft_inverse, strain)
        weight = trait + np.uint64(at.WEFT_LINE * stride)
        extremes_row(traits, weight, count, strain, longest_weft[begin:], shortest[begin:])
        lower = trait + np.uint64(at.LOWER_WEIGHT * stride) if half_cells else np.uint64(0)
        left = trait + np.uint64(at.LEFT_WEIGHT * stride) if half_cells else np.uint64(0)
        metric_row(
            state, row, above, traits, trait, count, stride, weights, lower, left, half_cells, sign_x, sign_y,
            warp_inverse, weft_inverse, g11, g22, g12,
        )  # fmt: skip
        tangent_row(count, g11, g22, g12, sheared[begin:])
    out[FASTEST] = math.sqrt(fastest.max())
    out[WARP_STRAIN] = longest_warp.max()
    out[WEFT_STRAIN] = longest_weft.max()
    out[SLACKEST] = shortest.min() if shortest.min() < math.inf else 0.0
    out[HALF_TANGENT] = sheared.max()
    out[KINETIC] = kinetic.sum()
    out[FINITE] = 1.0
    longest = max(out[WARP_STRAIN], out[WEFT_STRAIN])
    if not (broken.sum() == 0.0 and out[FASTEST] < LARGEST_SPEED and longest < LARGEST_STRAIN):  # also where a NaN is
        out[FINITE] = 0.0
        out[WORST_ROW], out[WORST_COLUMN] = worst_crossing(
            state, traits, trait_rows, row_index, spans, stride, fields, trait_fields, warp_inverse, weft_inverse
        )
        return out
    gap = np.empty(stride)
    inward = np.empty(stride)
    for k in range(tools):
        way = 2.0 * (out[FASTEST] * reach + abs(poses[k, 0] - poses[k, 3]) * ahead) + margin
        for j in range(rows):
            r = row_index[j]
            begin = spans[r, 0]
            count = spans[r, 1]
            trait = np.uint64(trait_rows[r] * trait_fields * stride + begin)
            row = np.uint64(r * length + begin)
            gap_row(state, row, traits, trait, np.uint64(count), stride, tool_table[k], poses[k, 0], gap, inward)
            found = 0
            former = CLEAR
            for block in range(0, count, at.LANES):
                nearest = math.inf
                innermost = math.inf
                for i in range(block, block + at.LANES):
                    nearest = min(nearest, gap[i])
                    innermost = min(innermost, inward[i])
                out[PENETRATION] = max(out[PENETRATION], -nearest)
                kind = CLEAR
                if nearest < way:
                    kind = ON_FACE if innermost > way else TOUCHING
                if kind != CLEAR and kind == former and pieces[k, r, found, 1] < at.PIECE:
                    pieces[k, r, found, 1] += at.LANES
                elif kind != CLEAR:
                    found += 1
                    pieces[k, r, found, 0] = begin + block
                    pieces[k, r, found, 1] = at.LANES
                    pieces[k, r, found, 2] = kind
                former = kind
            pieces[k, r, 0, 0] = found
    return out


@numba.njit(fastmath=FASTMATH, error_model="numpy", cache=True, nogil=True)
def worst_crossing(
    state, traits, trait_rows, row_index, spans, stride, fields, trait_fields, warp_inverse, weft_inverse
):  # fmt: skip
    """Row and column of the first crossing that is where no crossing can be."""
    rows = row_index.shape[0]
    most = (1.0 + LARGEST_STRAIN) ** 2
    for j in range(rows):
        begin = spans[row_index[j], 0]
        row = row_index[j] * fields * stride
        above = row_index[min(j + 1, rows - 1)] * fields * stride
        trait = trait_rows[row_index[j]] * trait_fields * stride
        for i in range(begin, min(begin + spans[row_index[j], 1], stride - 1)):
            if traits[trait + i + at.AREA * stride] <= 0.0:
                continue
            speed = 0.0
            warp = 0.0
            weft = 0.0
            for c in range(3):
                p = c * stride + i
                speed += state[row + p + at.VELOCITY * stride] ** 2
                warp += ((state[row + p + 1] - state[row + p]) * warp_inverse) ** 2
                weft += ((state[above + p] - state[row + p]) * weft_inverse) ** 2
            place = state[row + i] + state[row + stride + i] + state[row + 2 * stride + i]
            if not (speed < LARGEST_SPEED**2 and math.isfinite(place)):
                return j, i
            if traits[trait + i + at.WARP_LINE * stride] > 0.0 and warp > most:
                return j, i
            if traits[trait + i + at.WEFT_LINE * stride] > 0.0 and weft > most:
                return j, i
    return 0, 0


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
def contact_forces(rows, areas, grip, tool_table, poses):
    """Force of all tools on each crossing [N], shape [rows, columns, 3], from fields of shape [rows, fields,
    columns], the area of each crossing and its friction traction with each tool.
    """
    count, _, columns = rows.shape
    total = np.zeros((count, columns, 3))
    for j in range(count):
        for i in range(columns):
            area = areas[j, i]
            x, y, z = rows[j, 0, i], rows[j, 1, i], rows[j, 2, i]
            away = math.sqrt(x * x + y * y)
            for k in range(tool_table.shape[0]):
                t = tool_table[k]
                distance, normal_s, normal_z = rounded_edge(away, z - poses[k, 0], t[0], t[1], t[2], t[3], t[4])
                press = t[6] * max(t[5] - distance, 0.0)
                radial = press * normal_s / max(away, 1e-12)
                total[j, i, 0] += area * (radial * x + grip[j, k, 0, i])
                total[j, i, 1] += area * (radial * y + grip[j, k, 1, i])
                total[j, i, 2] += area * (press * normal_z + grip[j, k, 2, i])
    return total
