"""A look at the state on the device: extremes for the stable step and the contact search, and the energy ledger.

A block has a row of the grid; what it finds goes to the host, which finishes over the rows as
:mod:`weftform.solver.survey` and :mod:`weftform.solver.energies` do. The formulas are theirs.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numba
import numpy as np
from numba import cuda

from weftform.mechanics.angles import angle_between, mean_half_tangent, root_of_secants
from weftform.mechanics.connector import connector_energy
from weftform.mechanics.contact import rounded_edge
from weftform.mechanics.membrane import half_tangent, log_stretch, shear_stress
from weftform.solver import energies, survey
from weftform.solver import layout as at
from weftform.solver.cuda.elements import covariant_vectors
from weftform.solver.cuda.functions import combine, device_function, dot, minus, put_vector, vector_at
from weftform.solver.cuda.launch import MOVING, Constants, kept_fields
from weftform.solver.layout import Layout

# what a row finds in a survey; all but the first are largest values
R_INERTIA = 0
"""Sum of inertia area times squared speed."""
R_FASTEST = 1
R_WARP = 2
R_WEFT = 3
R_SHORTEST = 4
"""Minus the smallest squared stretch of a connector."""
R_HALF_TANGENT = 5
R_WORST = 6
"""1 + column of a crossing that is not where a crossing can be; 0 where all is well."""
R_TOOLS = 7
"""Per tool: minus the smallest gap, minus the smallest distance to the edge of its face."""

ONE = np.uint64(1)


@device_function
def squared_stretch(moving, m, step, stride, inverse_length):
    """Squared length over initial length of a connector to the crossing ``step`` further."""
    way = minus(vector_at(moving, m + step, stride), vector_at(moving, m, stride))
    return dot(way, way) * (inverse_length * inverse_length)


@device_function
def line_energy(moving, m, step, stride, weight, inverse_length, law, integrals):
    """Stored energy of a connector [mJ]."""
    strain = math.sqrt(squared_stretch(moving, m, step, stride, inverse_length)) - 1.0
    return weight / inverse_length * connector_energy(law[0], integrals, law[1], law[2], law[3], law[4], law[5], strain)


@device_function
def edges_of_cell(moving, m, stride, up):
    """Lower, upper, left and right edge of the cell above and to the right of a crossing."""
    a = vector_at(moving, m, stride)
    b = vector_at(moving, m + ONE, stride)
    c = vector_at(moving, m + up, stride)
    d = vector_at(moving, m + up + ONE, stride)
    return minus(b, a), minus(d, c), minus(c, a), minus(d, b)


@device_function
def squared_sine(a, b):
    """Squared sine of what two connectors at a corner miss of a right angle."""
    product = dot(a, b)
    return product * product / max(dot(a, a) * dot(b, b), 1e-300)


@device_function
def chosen(first, condition, second):
    """One of two vectors."""
    if condition:
        return first
    return second


@device_function
def cosine_of(t):
    """``cos(gamma)`` from ``tan(gamma / 2)``."""
    return (1.0 - t * t) / (1.0 + t * t)


@device_function
def simpson(old, middle, new):
    """Six times the mean of a function over an interval."""
    return old + 4.0 * middle + new


@device_function
def keep_largest(array, place, value):
    """Keep the larger one."""
    array[place] = max(array[place], value)


@cache
def compile_cell_vectors(layout: Layout, constants: Constants) -> Any:
    """Function: mean yarn vectors of a cell from its edges (:func:`weftform.solver.cuda.elements.covariant_vectors`)."""
    lower_weight, left_weight, mirror_field, mirror_z_field = (
        np.uint64(field * layout.stride) for field in (at.LOWER_WEIGHT, at.LEFT_WEIGHT, at.MIRROR, at.MIRROR_Z)
    )
    half_cells, membrane = bool(layout.half_cells), constants.membrane
    i1, i2 = membrane[0], membrane[1]

    @device_function
    def cell_vectors(traits, t, lower, upper, left, right):
        low = 0.5
        near = 0.5
        q = 0.0
        mirror_z = 0.0
        if half_cells:
            low = traits[t + lower_weight]
            near = traits[t + left_weight]
            q = traits[t + mirror_field]
            mirror_z = traits[t + mirror_z_field]
        return covariant_vectors(
            lower, upper, left, right, low, near, q, q * membrane[5], q * membrane[6], mirror_z, i1, i2
        )

    return cell_vectors


@cache
def compile_survey(layout: Layout, constants: Constants, threads: int) -> Any:
    """Kernel: what each row finds, into an array of shape [rows, R_TOOLS + 2 tools]."""
    stride = np.uint64(layout.stride)
    columns = constants.columns
    moving_row, traits_row = MOVING * layout.stride, layout.traits * layout.stride
    up = np.uint64(moving_row)
    velocity = np.uint64(at.VELOCITY * layout.stride)
    area_field, inertia_field, warp_line, weft_line, volume_field = (
        np.uint64(field * layout.stride) for field in (at.AREA, at.INERTIA, at.WARP_LINE, at.WEFT_LINE, at.VOLUME)
    )
    tools = layout.tools
    entries = R_TOOLS + 2 * tools
    i1, i2 = constants.membrane[0], constants.membrane[1]
    cell_vectors = compile_cell_vectors(layout, constants)
    fastest_allowed = survey.LARGEST_SPEED**2
    longest_allowed = (1.0 + survey.LARGEST_STRAIN) ** 2

    rounded, tangent = device_function(rounded_edge), device_function(half_tangent)

    @device_function
    def look_at_crossing(moving, traits, table, poses, shared, thread, m, t):
        """Speed, gaps and stretches of the connectors that start here; whether the crossing is out of all bounds."""
        here = vector_at(moving, m, stride)
        pace = vector_at(moving, m + velocity, stride)
        speed = dot(pace, pace)
        if not (speed < fastest_allowed and math.isfinite(here[0] + here[1] + here[2])):
            return True
        shared[R_INERTIA * threads + thread] += traits[t + inertia_field] * speed
        keep_largest(shared, R_FASTEST * threads + thread, speed)
        away = math.sqrt(here[0] * here[0] + here[1] * here[1])
        for k in range(tools):
            distance, _, _ = rounded(
                away, here[2] - poses[k, 0], table[k, 0], table[k, 1], table[k, 2], table[k, 3], table[k, 4]
            )
            keep_largest(shared, (R_TOOLS + 2 * k) * threads + thread, table[k, 5] - distance)
            keep_largest(shared, (R_TOOLS + 2 * k + 1) * threads + thread, table[k, 0] * (away - table[k, 1]))
        bad = False
        if traits[t + warp_line] > 0.0:
            squared = squared_stretch(moving, m, ONE, stride, i1)
            keep_largest(shared, R_WARP * threads + thread, squared)
            keep_largest(shared, R_SHORTEST * threads + thread, -squared)
            bad = squared > longest_allowed
        if traits[t + weft_line] > 0.0:
            squared = squared_stretch(moving, m, up, stride, i2)
            keep_largest(shared, R_WEFT * threads + thread, squared)
            keep_largest(shared, R_SHORTEST * threads + thread, -squared)
            bad = bad or squared > longest_allowed
        return bad

    @device_function
    def look_at_cell(moving, traits, shared, thread, m, t):
        """Shear of a cell."""
        lower, upper, left, right = edges_of_cell(moving, m, stride, up)
        g1, g2 = cell_vectors(traits, t, lower, upper, left, right)
        sheared = abs(tangent(dot(g1, g1), dot(g2, g2), dot(g1, g2)))
        keep_largest(shared, R_HALF_TANGENT * threads + thread, sheared)

    def look(moving, traits, trait_rows, table, poses, found):
        shared = cuda.shared.array(0, numba.float64)
        thread = cuda.threadIdx.x
        row = cuda.blockIdx.x
        for entry in range(entries):
            shared[entry * threads + thread] = -math.inf
        shared[R_INERTIA * threads + thread] = 0.0
        worst = 0
        for i in range(thread, columns, threads):
            m = np.uint64(row * moving_row + i)
            t = np.uint64(trait_rows[row] * traits_row + i)
            if traits[t + area_field] > 0.0:
                bad = look_at_crossing(moving, traits, table, poses, shared, thread, m, t)
                if bad:
                    worst = i + 1
            if traits[t + volume_field] > 0.0:
                look_at_cell(moving, traits, shared, thread, m, t)
        shared[R_WORST * threads + thread] = float(worst)
        width = threads
        cuda.syncthreads()
        while width > 1:
            half = (width + 1) // 2
            if thread < width - half:
                shared[R_INERTIA * threads + thread] += shared[R_INERTIA * threads + thread + half]
                for entry in range(1, entries):
                    keep_largest(shared, entry * threads + thread, shared[entry * threads + thread + half])
            cuda.syncthreads()
            width = half
        if thread == 0:
            for entry in range(entries):
                found[row, entry] = shared[entry * threads]

    return cuda.jit(look)


@cache
def compile_ledger(layout: Layout, constants: Constants, threads: int) -> Any:
    """Kernel: energies of each row [mJ] (for the whole density 1), into an array of shape [rows, energies.ENTRIES]."""
    stride = np.uint64(layout.stride)
    columns = constants.columns
    moving_row, kept_row, traits_row, grip_row = (
        fields * layout.stride for fields in (MOVING, kept_fields(layout), layout.traits, 3)
    )
    up = np.uint64(moving_row)
    velocity = np.uint64(at.VELOCITY * layout.stride)
    area_field, inertia_field, warp_line, weft_line, volume_field = (
        np.uint64(field * layout.stride) for field in (at.AREA, at.INERTIA, at.WARP_LINE, at.WEFT_LINE, at.VOLUME)
    )
    lower_weight, left_weight, mirror_field, mirror_z_field = (
        np.uint64(field * layout.stride) for field in (at.LOWER_WEIGHT, at.LEFT_WEIGHT, at.MIRROR, at.MIRROR_Z)
    )
    half_cells, tools = bool(layout.half_cells), layout.tools
    entries = energies.ENTRIES
    kinetic, connectors, membrane_work, hourglass, contact, closed = (
        entry * threads
        for entry in (
            energies.KINETIC, energies.CONNECTORS, energies.MEMBRANE, energies.HOURGLASS, energies.CONTACT, energies.CLOSED
        )
    )  # fmt: skip
    warp_law, weft_law, law = constants.warp_law, constants.weft_law, constants.shear_law
    series, membrane = constants.series, constants.membrane
    i1, i2 = membrane[0], membrane[1]
    rounded, tangent = device_function(rounded_edge), device_function(half_tangent)
    stress, log_of = device_function(shear_stress), device_function(log_stretch)
    half_way, change_of, root_of = (
        device_function(mean_half_tangent), device_function(angle_between), device_function(root_of_secants)
    )  # fmt: skip
    cell_vectors = compile_cell_vectors(layout, constants)

    @device_function
    def add_crossing(moving, traits, grip, table, poses, shared, thread, m, t, row, i):
        """Kinetic energy and contact of a crossing."""
        area = traits[t + area_field]
        here = vector_at(moving, m, stride)
        pace = vector_at(moving, m + velocity, stride)
        shared[kinetic + thread] += 0.5 * traits[t + inertia_field] * dot(pace, pace)
        away = math.sqrt(here[0] * here[0] + here[1] * here[1])
        for k in range(tools):
            distance, _, _ = rounded(
                away, here[2] - poses[k, 0], table[k, 0], table[k, 1], table[k, 2], table[k, 3], table[k, 4]
            )
            gap = distance - table[k, 5]
            if gap < 0.0:
                held = vector_at(grip, np.uint64((row * tools + k) * grip_row + i), stride)
                stretched = dot(held, held) / (table[k, 8] * table[k, 6])
                shared[contact + thread] += 0.5 * area * (table[k, 6] * gap * gap + stretched)

    @device_function
    def add_cell(moving, kept, traits, shared, thread, m, n, t):
        """Hourglass energy of a cell, and its membrane work since the last entry, as weftform.solver.energies has them."""
        volume = traits[t + volume_field]
        lower, upper, left, right = edges_of_cell(moving, m, stride, up)
        whole = 1.0
        if half_cells:
            low = traits[t + lower_weight]
            near = traits[t + left_weight]
            whole = 16.0 * low * (1.0 - low) * near * (1.0 - near)
        twist = minus(upper, lower)
        shared[hourglass + thread] += 0.5 * membrane[4] * volume * whole * dot(twist, twist)
        g1, g2 = cell_vectors(traits, t, lower, upper, left, right)
        g11 = dot(g1, g1)
        g22 = dot(g2, g2)
        now = tangent(g11, g22, dot(g1, g2))
        h1, h2, before = vector_at(kept, n, stride)
        h11, h22 = 1.0 + h1, 1.0 + h2
        root = root_of(now, before)
        middle = half_way(now, before, root)
        e1, e2, o1, o2 = log_of(g11, series), log_of(g22, series), log_of(h11, series), log_of(h22, series)
        m1 = 0.5 * (e1 + o1)
        m2 = 0.5 * (e2 + o2)
        stretched, stretched_before = math.sqrt(g11 * g22), math.sqrt(h11 * h22)
        old = stretched_before * cosine_of(before)
        mid = math.sqrt(stretched * stretched_before) * cosine_of(middle)
        new = stretched * cosine_of(now)
        old_tau = stress(law[0], law[1], law[2], law[3], law[4], before)
        mid_tau = stress(law[0], law[1], law[2], law[3], law[4], middle)
        tau = stress(law[0], law[1], law[2], law[3], law[4], now)
        work = kept[n + stride + stride + stride] + volume / 6.0 * (
            membrane[2] * simpson(old * o1, mid * m1, new * e1) * (e1 - o1)
            + membrane[3] * simpson(old * o2, mid * m2, new * e2) * (e2 - o2)
            + simpson(old * old_tau, mid * mid_tau, new * tau) * change_of(now, before, root)
        )
        put_vector(kept, n, stride, (g11 - 1.0, g22 - 1.0, now))
        kept[n + stride + stride + stride] = work
        shared[membrane_work + thread] += work

    @device_function
    def add_corners(moving, traits, shared, thread, m, t, above):
        """Angles at the corners of a cell at which two connectors are, as :func:`weftform.solver.measures.closed_row`."""
        lower, upper, left, right = edges_of_cell(moving, m, stride, up)
        has_lower, has_upper = traits[t + warp_line] > 0.0, traits[above + warp_line] > 0.0
        has_left, has_right = traits[t + weft_line] > 0.0, traits[t + weft_line + ONE] > 0.0
        if half_cells and traits[t + mirror_field] > 0.0:
            low, near = traits[t + lower_weight], traits[t + left_weight]
            # a share is a half
            x, y = 2.0 * traits[t + mirror_field] * membrane[5], 2.0 * traits[t + mirror_field] * membrane[6]
            z = 2.0 * traits[t + mirror_z_field]
            warp, weft = combine(low, lower, 1.0 - low, upper), combine(near, left, 1.0 - near, right)
            of_warp = (x * warp[0], y * warp[1], z * warp[2])
            of_weft = (x * weft[0], y * weft[1], z * weft[2])
            lower, upper = chosen(of_weft, low == 0.0, lower), chosen(of_weft, low == 1.0, upper)
            left, right = chosen(of_warp, near == 0.0, left), chosen(of_warp, near == 1.0, right)
            has_lower = has_upper = has_left = has_right = True
        if has_lower and has_left:
            keep_largest(shared, closed + thread, squared_sine(lower, left))
        if has_lower and has_right:
            keep_largest(shared, closed + thread, squared_sine(lower, right))
        if has_upper and has_right:
            keep_largest(shared, closed + thread, squared_sine(upper, right))
        if has_upper and has_left:
            keep_largest(shared, closed + thread, squared_sine(upper, left))

    def enter(moving, kept, traits, trait_rows, grip, table, poses, warp_integrals, weft_integrals, found):
        shared = cuda.shared.array(0, numba.float64)
        thread = cuda.threadIdx.x
        row = cuda.blockIdx.x
        for entry in range(entries):
            shared[entry * threads + thread] = 0.0
        for i in range(thread, columns, threads):
            m = np.uint64(row * moving_row + i)
            n = np.uint64(row * kept_row + i)
            t = np.uint64(trait_rows[row] * traits_row + i)
            if traits[t + area_field] > 0.0:
                add_crossing(moving, traits, grip, table, poses, shared, thread, m, t, row, i)
            warp = traits[t + warp_line]
            if warp > 0.0:
                shared[connectors + thread] += line_energy(moving, m, ONE, stride, warp, i1, warp_law, warp_integrals)
            weft = traits[t + weft_line]
            if weft > 0.0:
                shared[connectors + thread] += line_energy(moving, m, up, stride, weft, i2, weft_law, weft_integrals)
            if traits[t + volume_field] > 0.0:
                add_cell(moving, kept, traits, shared, thread, m, n, t)
                add_corners(
                    moving, traits, shared, thread, m, t, np.uint64(trait_rows[row + 1] * traits_row + i)
                )  # fmt: skip
        width = threads
        cuda.syncthreads()
        while width > 1:
            half = (width + 1) // 2
            if thread < width - half:
                for entry in range(energies.CLOSED):
                    shared[entry * threads + thread] += shared[entry * threads + thread + half]
                keep_largest(shared, closed + thread, shared[closed + thread + half])
            cuda.syncthreads()
            width = half
        if thread == 0:
            for entry in range(entries):
                found[row, entry] = shared[entry * threads]

    return cuda.jit(enter)
