"""Energies for the ledger, evaluated independently of the time loop.

Energies of connectors, hourglass control and contact are functions of the state. The membrane's stress is a
function of the state but, with constant thickness, has no potential, so its work is integrated with Simpson's
rule from entry to entry. (Friction and damping heat are sums of the time loop.) The ledger therefore closes only if
the time loop integrates the same physics.

The membrane's memory of the last entry is ``l1^2 - 1``, ``l2^2 - 1``, ``tan(gamma / 2)`` and the work so far.

Sums run over the rows column by column, so that they do not depend on the bands. Loops over a row take one operation
or law at a time, so that their code is short, whatever the degree of a law, and vectorised.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from weftform.mechanics.angles import angle_between, mean_half_tangent, root_of_secants
from weftform.mechanics.compiled import FASTMATH
from weftform.mechanics.connector import connector_energy
from weftform.mechanics.contact import rounded_edge
from weftform.mechanics.membrane import half_tangent, shear_stress
from weftform.mechanics.piecewise import horner, polynomial
from weftform.mechanics.roots import inverse_root
from weftform.solver import layout as at
from weftform.solver.measures import closed_row, metric_row, strain_row
from weftform.solver.rows import U1
from weftform.solver.vector_loops import row_loop, use_full_width

KINETIC = 0
CONNECTORS = 1
MEMBRANE = 2
HOURGLASS = 3
CONTACT = 4
CLOSED = 5
"""Largest squared sine of the angle by which two connectors that meet have closed or opened."""
ENTRIES = 6


@row_loop
def polynomial_row(coefficients, degree, x, out, count):
    """Polynomial of each place of a row, highest power first."""
    use_full_width()
    for i in range(count):
        out[i] = coefficients[0]
    # four powers per pass: each pass reads and writes the row
    single = degree % 4
    for k in range(1, single + 1):
        c = coefficients[k]
        for i in range(count):
            out[i] = out[i] * x[i] + c
    for k in range(single + 1, degree + 1, 4):
        a, b, c, d = coefficients[k], coefficients[k + 1], coefficients[k + 2], coefficients[k + 3]
        for i in range(count):
            out[i] = (((out[i] * x[i] + a) * x[i] + b) * x[i] + c) * x[i] + d


@row_loop
def kinetic_row(state, row, traits, trait, count, stride, density, total):
    """Kinetic energy of the crossings."""
    use_full_width()
    s = np.uint64(stride)
    vx = row + s * np.uint64(at.VELOCITY)
    vy, vz = vx + s, vx + s + s
    inertia = trait + s * np.uint64(at.INERTIA)
    for i in range(count):
        u, v, w = state[vx + i], state[vy + i], state[vz + i]
        total[i] += 0.5 * density * traits[inertia + i] * (u * u + v * v + w * w)


@row_loop
def contact_energy_row(state, row, traits, trait, grip, held, count, stride, tool, tool_z, total):
    """Energy of the penalty springs of a tool, normal and tangential."""
    use_full_width()
    s = np.uint64(stride)
    area = trait + s * np.uint64(at.AREA)
    side_s, s0, side_z, z0, radius = tool[0], tool[1], tool[2], tool[3], tool[4]
    half_thickness, stiffness, tangential = tool[5], tool[6], tool[6] * tool[8]
    for i in range(count):
        x, y = state[row + i], state[row + s + i]
        away = math.sqrt(x * x + y * y)
        distance, _, _ = rounded_edge(away, state[row + s + s + i] - tool_z, side_s, s0, side_z, z0, radius)
        depth = max(half_thickness - distance, 0.0)
        fx, fy, fz = grip[held + i], grip[held + s + i], grip[held + s + s + i]
        stick = (fx * fx + fy * fy + fz * fz) / tangential if depth > 0.0 else 0.0
        a = traits[area + i]
        total[i] += 0.5 * a * (stiffness * depth * depth + stick) if a > 0.0 else 0.0


@row_loop
def connector_energy_row(traits, weight, count, pitch, law, degree, pieces, strain, inside, value, total):
    """Stored energy of connectors; ``law`` = coefficients, integrals, width, slope beyond, slope in compression, and for a
    law of one piece the coefficients of its integral over the strain.
    """
    width, end_slope, slack = law[2], law[3], law[4]
    if pieces > 1:
        for i in range(count):
            w = traits[weight + i]
            if w > 0.0:
                total[i] += (
                    w * pitch * connector_energy(law[0], law[1], degree, pieces, width, end_slope, slack, strain[i])
                )
        return
    for i in range(count):
        inside[i] = min(max(strain[i], 0.0), width)
    polynomial_row(law[5], degree, inside, value, count)
    at_end = horner(law[0], degree, 0, width)
    for i in range(count):
        beyond = max(strain[i] - width, 0.0)
        push = min(strain[i], 0.0)
        energy = value[i] * inside[i] + beyond * (at_end + 0.5 * end_slope * beyond) + 0.5 * slack * push * push
        total[i] += traits[weight + i] * pitch * energy


@row_loop
def hourglass_row(state, row, above, traits, trait, count, stride, weights, lower, left, stabilise, total):
    """Energy of the hourglass control of the cells above a row."""
    use_full_width()
    s = np.uint64(stride)
    volume = trait + s * np.uint64(at.VOLUME)
    for i in range(count):
        twist = 0.0
        for c in range(3):
            p = row + i + s * np.uint64(c)
            q = above + i + s * np.uint64(c)
            change = (state[q + U1] - state[q]) - (state[p + U1] - state[p])
            twist += change * change
        wl = weights[lower + i]
        wa = weights[left + i]
        whole = 16.0 * (wl * (1.0 - wl)) * (wa * (1.0 - wa))
        v = traits[volume + i]
        total[i] += 0.5 * stabilise * v * whole * twist if v > 0.0 else 0.0


@row_loop
def tangent_row(memory, field, count, stride, g11, g22, g12, t, before, middle, root):
    """``tan(gamma / 2)`` now, at the last entry and halfway between, and what the difference of the two needs besides."""
    use_full_width()
    s = np.uint64(stride)
    for i in range(count):
        t[i] = half_tangent(g11[i], g22[i], g12[i])
        before[i] = memory[field + s + s + i]
        root[i] = root_of_secants(t[i], before[i])
        middle[i] = mean_half_tangent(t[i], before[i], root[i])


@row_loop
def shear_row(t, count, law, degree, pieces, inside, out):
    """``tau`` by ``t = tan(gamma / 2)`` (mechanics.membrane.shear_stress)."""
    use_full_width()
    width, end_slope = law[2], law[3]
    if pieces > 1:
        for i in range(count):
            out[i] = shear_stress(law[0], degree, pieces, width, end_slope, t[i])
        return
    for i in range(count):
        inside[i] = min(abs(t[i]), width)
    polynomial_row(law[0], degree, inside, out, count)
    for i in range(count):
        out[i] = t[i] * (out[i] + end_slope * max(abs(t[i]) - width, 0.0))


@row_loop
def log_row(memory, field, count, stride, series, g11, g22, warp, weft, warp_before, weft_before):
    """Logarithms of the stretches now and at the last entry (mechanics.membrane.log_stretch); one reciprocal serves four."""
    use_full_width()
    s = np.uint64(stride)
    for i in range(count):
        g1, g2 = g11[i], g22[i]
        h1, h2 = 1.0 + memory[field + i], 1.0 + memory[field + s + i]
        both, both_before = (g1 + 1.0) * (g2 + 1.0), (h1 + 1.0) * (h2 + 1.0)
        inverse = 1.0 / (both * both_before)
        new, old = inverse * both_before, inverse * both
        y1, y2 = (g1 - 1.0) * (g2 + 1.0) * new, (g2 - 1.0) * (g1 + 1.0) * new
        z1, z2 = (h1 - 1.0) * (h2 + 1.0) * old, (h2 - 1.0) * (h1 + 1.0) * old
        warp[i], weft[i] = y1 * polynomial(series, y1 * y1), y2 * polynomial(series, y2 * y2)
        warp_before[i], weft_before[i] = z1 * polynomial(series, z1 * z1), z2 * polynomial(series, z2 * z2)


@row_loop
def work_row(
    memory, field, traits, volume, count, stride, warp_modulus, weft_modulus,
    g11, g22, t, tau, before, tau_before, middle, tau_middle, root, warp, weft, warp_before, weft_before, total,
):  # fmt: skip
    """Work of the membrane since the last entry, by Simpson's rule straight in (ln l1, ln l2, gamma); becomes the last.

    One reciprocal serves three cosines ``(1 - t^2) / (1 + t^2)``; roots by multiplications, because the divider is what
    these loops wait for.
    """
    use_full_width()
    s = np.uint64(stride)
    for i in range(count):
        g1, g2 = g11[i], g22[i]
        h1, h2 = 1.0 + memory[field + i], 1.0 + memory[field + s + i]
        e1, e2, o1, o2 = warp[i], weft[i], warp_before[i], weft_before[i]
        # area ratios l1 l2 cos(gamma)
        stretched, stretched_before = g1 * g2, h1 * h2
        stretched *= inverse_root(stretched)
        stretched_before *= inverse_root(stretched_before)
        product = stretched * stretched_before
        a, b, c = t[i] * t[i], before[i] * before[i], middle[i] * middle[i]
        inverse = 1.0 / ((1.0 + a) * (1.0 + b) * (1.0 + c))
        new = stretched * (1.0 - a) * ((1.0 + b) * (1.0 + c) * inverse)
        old = stretched_before * (1.0 - b) * ((1.0 + a) * (1.0 + c) * inverse)
        mid = 4.0 * product * inverse_root(product) * (1.0 - c) * ((1.0 + a) * (1.0 + b) * inverse)
        done = (
            warp_modulus * (new * e1 + mid * (0.5 * (e1 + o1)) + old * o1) * (e1 - o1)
            + weft_modulus * (new * e2 + mid * (0.5 * (e2 + o2)) + old * o2) * (e2 - o2)
            + (new * tau[i] + mid * tau_middle[i] + old * tau_before[i]) * angle_between(t[i], before[i], root[i])
        )
        work = memory[field + s + s + s + i] + traits[volume + i] / 6.0 * done
        memory[field + i] = g1 - 1.0
        memory[field + s + i] = g2 - 1.0
        memory[field + s + s + i] = t[i]
        memory[field + s + s + s + i] = work
        total[i] += work


@numba.njit(fastmath=FASTMATH, error_model="numpy", cache=True, nogil=True)
def enter_ledger(
    state, memory, traits, trait_rows, row_index, stride, fields, trait_fields, half_cells, tools, density,
    membrane, series, warp_law, weft_law, shear_law, shapes, warp_pitch, weft_pitch, tool_table, poses, grip,
):  # fmt: skip
    """Sum the energies and integrate the membrane's work since the last entry.

    Parameters
    ----------
    memory
        What each cell was at the last entry, shape [local rows, layout.MEMORY, stride] flattened; brought up to date.
    density
        Mass per area, mass scaling included [tonne/mm2].
    shapes
        (warp degree, warp pieces, weft degree, weft pieces, shear degree, shear pieces).
    grip
        Friction tractions, shape [local rows, tools, 3, stride].

    Returns
    -------
    Energies [mJ] and what else the entries are, shape [ENTRIES].
    """
    rows = row_index.shape[0]
    wd, wp, fd, fp, sd, sp = shapes
    length = np.uint64(fields * stride)
    trait_length = np.uint64(trait_fields * stride)
    s = np.uint64(stride)
    # whole rows, padding included, where all weights are zero: no loop ends in single numbers
    count = s
    # taken out of their arrays once: each view counts its references, which takes as long as a few crossings
    sums = np.zeros((ENTRIES, stride))
    kinetic, connectors, work, hourglass, contact, closed = sums[0], sums[1], sums[2], sums[3], sums[4], sums[5]
    scratch = np.zeros((17, stride))
    g11, g22, g12, root = scratch[0], scratch[1], scratch[2], scratch[3]
    t, before, middle, tau, tau_before, tau_middle = (
        scratch[4], scratch[5], scratch[6], scratch[7], scratch[8], scratch[9]
    )  # fmt: skip
    x, y, z = scratch[10], scratch[11], scratch[12]
    warp, weft, warp_before, weft_before = scratch[13], scratch[14], scratch[15], scratch[16]
    halves = np.full(stride, 0.5)
    weights = traits if half_cells else halves
    tractions = grip.reshape(-1)
    for j in range(rows):
        row = np.uint64(row_index[j]) * length
        trait = np.uint64(trait_rows[row_index[j]]) * trait_length
        kinetic_row(state, row, traits, trait, count, stride, density, kinetic)
        for k in range(tools):
            held = (np.uint64(row_index[j]) * np.uint64(tools) + np.uint64(k)) * np.uint64(3) * s
            contact_energy_row(
                state, row, traits, trait, tractions, held, count, stride, tool_table[k], poses[k, 0], contact
            )  # fmt: skip
        strain_row(state, row, row + U1, count, stride, 1.0 / warp_pitch, x)
        connector_energy_row(
            traits, trait + s * np.uint64(at.WARP_LINE), count, warp_pitch, warp_law, wd, wp, x, y, z, connectors
        )  # fmt: skip
        if j == rows - 1:
            continue
        above = np.uint64(row_index[j + 1]) * length
        trait_above = np.uint64(trait_rows[row_index[j + 1]]) * trait_length
        strain_row(state, row, above, count, stride, 1.0 / weft_pitch, x)
        connector_energy_row(
            traits, trait + s * np.uint64(at.WEFT_LINE), count, weft_pitch, weft_law, fd, fp, x, y, z, connectors
        )  # fmt: skip
        lower = trait + s * np.uint64(at.LOWER_WEIGHT) if half_cells else np.uint64(0)
        left = trait + s * np.uint64(at.LEFT_WEIGHT) if half_cells else np.uint64(0)
        hourglass_row(
            state, row, above, traits, trait, count, stride, weights, lower, left, membrane[5], hourglass
        )  # fmt: skip
        metric_row(
            state, row, above, traits, trait, count, stride, weights, lower, left, half_cells, membrane[6], membrane[7],
            1.0 / warp_pitch, 1.0 / weft_pitch, g11, g22, g12,
        )  # fmt: skip
        closed_row(
            state, row, above, traits, trait, trait_above, count, stride, weights, lower, left, half_cells, membrane[6],
            membrane[7], closed,
        )  # fmt: skip
        field = np.uint64(row_index[j] * at.MEMORY) * s
        tangent_row(memory, field, count, stride, g11, g22, g12, t, before, middle, root)
        shear_row(t, count, shear_law, sd, sp, x, tau)
        shear_row(before, count, shear_law, sd, sp, x, tau_before)
        shear_row(middle, count, shear_law, sd, sp, x, tau_middle)
        log_row(memory, field, count, stride, series, g11, g22, warp, weft, warp_before, weft_before)
        work_row(
            memory, field, traits, trait + s * np.uint64(at.VOLUME), count, stride, membrane[3], membrane[4],
            g11, g22, t, tau, before, tau_before, middle, tau_middle, root, warp, weft, warp_before, weft_before, work,
        )  # fmt: skip
    out = np.zeros(ENTRIES)
    for k in range(ENTRIES):
        out[k] = sums[k].max() if k == CLOSED else sums[k].sum()
    return out
