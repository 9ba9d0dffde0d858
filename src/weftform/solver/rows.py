"""The loops over one row of the yarn grid, each written so that LLVM turns it into vector code.

What makes that work: all reads are from the state, all writes to scratch arrays (or the other way round), offsets
between the fields are constants once inlined, indices are unsigned, and there is no branch in a loop body.
Shifted reads (``i - 1``) are from another array than the one written: a load that overlaps a store of the
previous iteration would stop the vectoriser. Every loop runs over whole blocks of ``layout.LANES`` places, so no row
ends in a scalar remainder; what lies in the padding has no mass, no weight and no area.

Scratch ``edge`` holds blocks of three components: warp edge forces, upper-edge forces carried to the next row, and
the share of the weft edges (two blocks with half cells). Scratch ``node`` holds three: weft edge forces, force on
the crossings, and heats.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from weftform.mechanics.connector import connector_force
from weftform.mechanics.membrane import SMALLEST_AREA_RATIO, shear_stress
from weftform.mechanics.piecewise import polynomial
from weftform.mechanics.roots import inverse_root
from weftform.solver import layout as at
from weftform.solver.vector_loops import row_loop, use_full_width

U1 = np.uint64(1)
LEAD = np.uint64(at.LEAD)
LANES = np.uint64(at.LANES)


@row_loop
def sum_lanes(values, first, count):
    """Sum of scratch numbers in eight lanes, which a vector unit adds at once and always in the same order."""
    a0, a1, a2, a3, a4, a5, a6, a7 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    i = first
    end = first + count
    while i < end:
        a0 += values[i]
        a1 += values[i + U1]
        a2 += values[i + np.uint64(2)]
        a3 += values[i + np.uint64(3)]
        a4 += values[i + np.uint64(4)]
        a5 += values[i + np.uint64(5)]
        a6 += values[i + np.uint64(6)]
        a7 += values[i + np.uint64(7)]
        i += LANES
    return ((a0 + a4) + (a1 + a5)) + ((a2 + a6) + (a3 + a7))


@row_loop
def warp_row(
    state, row, traits, trait, count, edge, node, stride, inverse_length, viscosity, degree, pieces, law, ends
):
    """Warp connectors of a row, plus what the cells below carried to their upper edges; starts the nodal force.

    ``viscosity`` [N s/mm3] is that of the dashpots over the squared pitch (docs/theory/dynamics.md).
    """
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    weight = trait + s * np.uint64(at.WARP_LINE)
    width, end_slope, slack = ends[0], ends[1], ends[2]
    warp = LEAD
    upper = LEAD + s + s + s + LEAD + LEAD
    weft = LEAD
    force = LEAD + s + s + s + LEAD + LEAD
    heat = force + s + s + s + LEAD + LEAD
    for i in range(count):
        dx = state[x + U1 + i] - state[x + i]
        dy = state[y + U1 + i] - state[y + i]
        dz = state[z + U1 + i] - state[z + i]
        squared = dx * dx + dy * dy + dz * dz
        inverse = inverse_root(squared)
        strain = squared * inverse * inverse_length - 1.0
        pull = connector_force(law, degree, pieces, width, end_slope, slack, strain)
        rate = (
            dx * (state[vx + U1 + i] - state[vx + i])
            + dy * (state[vy + U1 + i] - state[vy + i])
            + dz * (state[vz + U1 + i] - state[vz + i])
        )
        drag = viscosity * rate
        node[heat + i] = traits[weight + i] * (drag * rate)
        f = traits[weight + i] * (pull * inverse + drag)
        edge[warp + i] = f * dx + edge[upper + i]
        edge[warp + s + i] = f * dy + edge[upper + s + i]
        edge[warp + s + s + i] = f * dz + edge[upper + s + s + i]
        node[force + i] = -node[weft + i]
        node[force + s + i] = -node[weft + s + i]
        node[force + s + s + i] = -node[weft + s + s + i]


@row_loop
def cell_row(
    state,
    row,
    traits,
    trait,
    count,
    edge,
    stride,
    row_length,
    half_cells,
    membrane,
    degree,
    pieces,
    law,
    ends,
    series,
):
    """Membrane of the cells between a row and the next: forces on their four edges.

    ``membrane`` = (c11, c22, c12, E warp, E weft, hourglass, mirror signs x, y): ``c11 = 1 / (n warp pitch)^2`` and so
    on make the metric of the yarn directions out of the edge vectors, which come as the sum of two edges (n = 2), or
    with half cells as their weighted mean (n = 1). The force conjugate to ``g1`` is ``a11 g1 + a12 g2``
    (mechanics.membrane.covariant_forces); one reciprocal serves all five quotients of a cell.
    """
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    numba.literally(row_length)
    step = np.uint64(row_length)
    x, y, z = row, row + s, row + s + s
    xu, yu, zu = x + step, y + step, z + step
    volume = trait + s * np.uint64(at.VOLUME)
    lower_weight = trait + s * np.uint64(at.LOWER_WEIGHT)
    left_weight = trait + s * np.uint64(at.LEFT_WEIGHT)
    mirror = trait + s * np.uint64(at.MIRROR)
    mirror_z = trait + s * np.uint64(at.MIRROR_Z)
    block = s + s + s + LEAD + LEAD
    warp = LEAD
    upper = LEAD + block
    weft = LEAD + block + block
    right = weft + block
    c11, c22, c12 = membrane[0], membrane[1], membrane[2]
    e1, e2 = membrane[3], membrane[4]
    stabilise = membrane[5]
    width, end_slope = ends[0], ends[1]
    for i in range(count):
        lx = state[x + U1 + i] - state[x + i]
        ly = state[y + U1 + i] - state[y + i]
        lz = state[z + U1 + i] - state[z + i]
        ux = state[xu + U1 + i] - state[xu + i]
        uy = state[yu + U1 + i] - state[yu + i]
        uz = state[zu + U1 + i] - state[zu + i]
        ax = state[xu + i] - state[x + i]
        ay = state[yu + i] - state[y + i]
        az = state[zu + i] - state[z + i]
        bx = state[xu + U1 + i] - state[x + U1 + i]
        by = state[yu + U1 + i] - state[y + U1 + i]
        bz = state[zu + U1 + i] - state[z + U1 + i]
        v = traits[volume + i]
        k = stabilise * v
        if half_cells:
            wl = traits[lower_weight + i]
            wa = traits[left_weight + i]
            wu = 1.0 - wl
            wb = 1.0 - wa
            g1x, g1y, g1z = wl * lx + wu * ux, wl * ly + wu * uy, wl * lz + wu * uz
            g2x, g2y, g2z = wa * ax + wb * bx, wa * ay + wb * by, wa * az + wb * bz
            # the other half of a cell on a plane of symmetry is its mirror image (blank.grid.mirrors)
            q = traits[mirror + i]
            rx = q * membrane[6]
            ry = q * membrane[7]
            rz = traits[mirror_z + i]
            k1 = 1.0 - q
            mx, my, mz = k1 * g1x + rx * g2x, k1 * g1y + ry * g2y, k1 * g1z + rz * g2z
            g2x, g2y, g2z = k1 * g2x + rx * g1x, k1 * g2y + ry * g1y, k1 * g2z + rz * g1z
            g1x, g1y, g1z = mx, my, mz
            k = k * (16.0 * (wl * wu) * (wa * wb))
        else:
            g1x, g1y, g1z = lx + ux, ly + uy, lz + uz
            g2x, g2y, g2z = ax + bx, ay + by, az + bz
        g11 = c11 * (g1x * g1x + g1y * g1y + g1z * g1z)
        g22 = c22 * (g2x * g2x + g2y * g2y + g2z * g2z)
        g12 = c12 * (g1x * g2x + g1y * g2y + g1z * g2z)
        product = g11 * g22
        p1 = g11 + 1.0
        p2 = g22 + 1.0
        pp = p1 * p2
        inverse = 1.0 / (product * pp)
        by_pp = inverse * product
        y1 = (g11 - 1.0) * (p2 * by_pp)
        y2 = (g22 - 1.0) * (p1 * by_pp)
        s1 = (e1 * y1) * polynomial(series, y1 * y1)
        s2 = (e2 * y2) * polynomial(series, y2 * y2)
        area = math.sqrt(max(product - g12 * g12, SMALLEST_AREA_RATIO))
        t = g12 / (math.sqrt(product) + area)
        tau = shear_stress(law, degree, pieces, width, end_slope, t)
        vp = v * (inverse * pp)
        a12 = (c12 * v) * tau
        a11 = (c11 * vp) * g22 * (area * s1 - g12 * tau)
        a22 = (c22 * vp) * g11 * (area * s2 - g12 * tau)
        px = a11 * g1x + a12 * g2x
        py = a11 * g1y + a12 * g2y
        pz = a11 * g1z + a12 * g2z
        qx = a22 * g2x + a12 * g1x
        qy = a22 * g2y + a12 * g1y
        qz = a22 * g2z + a12 * g1z
        hx = k * (ux - lx)
        hy = k * (uy - ly)
        hz = k * (uz - lz)
        if half_cells:
            edge[warp + i] += wl * px - hx
            edge[warp + s + i] += wl * py - hy
            edge[warp + s + s + i] += wl * pz - hz
            edge[upper + i] = wu * px + hx
            edge[upper + s + i] = wu * py + hy
            edge[upper + s + s + i] = wu * pz + hz
            edge[weft + i] = wa * qx
            edge[weft + s + i] = wa * qy
            edge[weft + s + s + i] = wa * qz
            edge[right + i] = wb * qx
            edge[right + s + i] = wb * qy
            edge[right + s + s + i] = wb * qz
        else:
            edge[warp + i] += px - hx
            edge[warp + s + i] += py - hy
            edge[warp + s + s + i] += pz - hz
            edge[upper + i] = px + hx
            edge[upper + s + i] = py + hy
            edge[upper + s + s + i] = pz + hz
            edge[weft + i] = qx
            edge[weft + s + i] = qy
            edge[weft + s + s + i] = qz


@row_loop
def weft_row(
    state, row, traits, trait, count, edge, node, stride, row_length, half_cells,
    inverse_length, viscosity, degree, pieces, law, ends,
):  # fmt: skip
    """Weft connectors between a row and the next, plus the share of the cells on both sides."""
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    numba.literally(row_length)
    step = np.uint64(row_length)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    weight = trait + s * np.uint64(at.WEFT_LINE)
    width, end_slope, slack = ends[0], ends[1], ends[2]
    block = s + s + s + LEAD + LEAD
    left = LEAD + block + block
    right = left + (block if half_cells else np.uint64(0)) - U1
    weft = LEAD
    heat = LEAD + block + block
    for i in range(count):
        dx = state[x + step + i] - state[x + i]
        dy = state[y + step + i] - state[y + i]
        dz = state[z + step + i] - state[z + i]
        squared = dx * dx + dy * dy + dz * dz
        inverse = inverse_root(squared)
        strain = squared * inverse * inverse_length - 1.0
        pull = connector_force(law, degree, pieces, width, end_slope, slack, strain)
        rate = (
            dx * (state[vx + step + i] - state[vx + i])
            + dy * (state[vy + step + i] - state[vy + i])
            + dz * (state[vz + step + i] - state[vz + i])
        )
        drag = viscosity * rate
        node[heat + i] += traits[weight + i] * (drag * rate)
        f = traits[weight + i] * (pull * inverse + drag)
        node[weft + i] = f * dx + (edge[left + i] + edge[right + i])
        node[weft + s + i] = f * dy + (edge[left + s + i] + edge[right + s + i])
        node[weft + s + s + i] = f * dz + (edge[left + s + s + i] + edge[right + s + s + i])


@row_loop
def update_row(
    state, row, traits, trait, count, edge, node, stride, step, kick, keep, damping, driven, force_field
):  # fmt: skip
    """Sum of what the edges of each crossing pull with, then central differences; returns the damping heat of the row.

    ``keep`` is what mass damping leaves of a velocity in a step, ``damping`` its heat per area of fabric and squared
    sum of the velocities before and after. Where crossings are driven their force is kept in the state.
    """
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    mx = trait + s * np.uint64(at.INVERSE_MASS)
    my, mz = mx + s, mx + s + s
    inertia = trait + s * np.uint64(at.INERTIA)
    kept = row + s * np.uint64(force_field)
    warp = LEAD
    before = LEAD - U1
    weft = LEAD
    force = LEAD + s + s + s + LEAD + LEAD
    dashpots = force + s + s + s + LEAD + LEAD
    heat = dashpots + s
    for i in range(count):
        fx = node[force + i] + node[weft + i] + (edge[warp + i] - edge[before + i])
        fy = node[force + s + i] + node[weft + s + i] + (edge[warp + s + i] - edge[before + s + i])
        fz = node[force + s + s + i] + node[weft + s + s + i] + (edge[warp + s + s + i] - edge[before + s + s + i])
        if driven:
            state[kept + i] = fx
            state[kept + s + i] = fy
            state[kept + s + s + i] = fz
        ox = state[vx + i]
        oy = state[vy + i]
        oz = state[vz + i]
        nx = keep * ox + kick * traits[mx + i] * fx
        ny = keep * oy + kick * traits[my + i] * fy
        nz = keep * oz + kick * traits[mz + i] * fz
        state[vx + i] = nx
        state[vy + i] = ny
        state[vz + i] = nz
        state[x + i] += step * nx
        state[y + i] += step * ny
        state[z + i] += step * nz
        mx2 = ox + nx
        my2 = oy + ny
        mz2 = oz + nz
        node[heat + i] = damping * traits[inertia + i] * (mx2 * mx2 + my2 * my2 + mz2 * mz2) + step * node[dashpots + i]
    return sum_lanes(node, heat, count)
