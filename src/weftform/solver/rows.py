"""The loops over one row of the yarn grid, each written so that LLVM turns it into vector code.

What makes that work: all reads are from the state, all writes to scratch arrays (or the other way round), offsets
between the fields are constants once inlined, indices are unsigned, and there is no branch in a loop body.
Shifted reads (``i - 1``) are from another array than the one written: a load that overlaps a store of the
previous iteration would stop the vectoriser. Every loop runs over whole blocks of ``layout.LANES`` places, so no row
ends in a scalar remainder; what lies in the padding has no mass, no weight and no area.

Scratch ``edge`` holds three blocks of three components: warp edge forces, upper-edge forces carried to the next row, and
what the cells give to the weft edges on their right. Scratch ``node`` holds: weft edge forces (with the share of the
cells on their right), force on the crossings, and rows of heats.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from weftform.mechanics.connector import connector_pull
from weftform.mechanics.membrane import SMALLEST_AREA_RATIO, shear_stress
from weftform.mechanics.piecewise import polynomial
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
):  # fmt: skip
    """Warp connectors of the last row of a band, plus what the cells below carried to their upper edges.

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
    half = upper + s + s + s + LEAD + LEAD
    weft = LEAD
    heat = half
    for i in range(count):
        dx = state[x + U1 + i] - state[x + i]
        dy = state[y + U1 + i] - state[y + i]
        dz = state[z + U1 + i] - state[z + i]
        f, hot = connector_pull(
            dx, dy, dz,
            state[vx + U1 + i] - state[vx + i], state[vy + U1 + i] - state[vy + i], state[vz + U1 + i] - state[vz + i],
            inverse_length, viscosity, law, degree, pieces, width, end_slope, slack,
        )  # fmt: skip
        f *= traits[weight + i]
        node[heat + i] = traits[weight + i] * hot
        edge[warp + i] = f * dx + edge[upper + i]
        edge[warp + s + i] = f * dy + edge[upper + s + i]
        edge[warp + s + s + i] = f * dz + edge[upper + s + s + i]
        node[weft + i] = 0.0
        node[weft + s + i] = 0.0
        node[weft + s + s + i] = 0.0
        edge[half + i] = 0.0
        edge[half + s + i] = 0.0
        edge[half + s + s + i] = 0.0


@row_loop
def fabric_row(
    state, row, traits, trait, count, edge, node, stride, row_length, half_cells, membrane, series,
    warp_inverse, warp_viscosity, warp_degree, warp_pieces, warp_law,
    weft_inverse, weft_viscosity, weft_degree, weft_pieces, weft_law,
    shear_degree, shear_pieces, shear_law, ends,
):  # fmt: skip
    """Warp connectors of a row, the cells and the weft connectors between it and the next.

    One loop, because the three hold long chains of operations that do not wait for each other.

    ``membrane`` = (c11, c22, c12, E warp, E weft, hourglass, mirror signs x, y): ``c11 = 1 / (n warp pitch)^2`` and so
    on make the metric of the yarn directions out of the edge vectors, which come as the sum of two edges (n = 2), or
    with half cells as their weighted mean (n = 1). The force conjugate to ``g1`` is ``a11 g1 + a12 g2``
    (mechanics.membrane.covariant_forces); one reciprocal serves four of the five quotients.
    """
    use_full_width()
    numba.literally(stride)
    numba.literally(row_length)
    s = np.uint64(stride)
    step = np.uint64(row_length)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    xu, yu, zu = x + step, y + step, z + step
    vxu, vyu, vzu = vx + step, vy + step, vz + step
    warp_weight = trait + s * np.uint64(at.WARP_LINE)
    weft_weight = trait + s * np.uint64(at.WEFT_LINE)
    volume = trait + s * np.uint64(at.VOLUME)
    lower_weight = trait + s * np.uint64(at.LOWER_WEIGHT)
    left_weight = trait + s * np.uint64(at.LEFT_WEIGHT)
    mirror = trait + s * np.uint64(at.MIRROR)
    mirror_z = trait + s * np.uint64(at.MIRROR_Z)
    block = s + s + s + LEAD + LEAD
    warp = LEAD
    upper = LEAD + block
    half = upper + block
    weft = LEAD
    heat = LEAD + block + block
    c11, c22, c12 = membrane[0], membrane[1], membrane[2]
    e1, e2 = membrane[3], membrane[4]
    stabilise = membrane[5]
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
        root = math.sqrt(product)
        area = math.sqrt(max(product - g12 * g12, SMALLEST_AREA_RATIO))
        p1 = g11 + 1.0
        p2 = g22 + 1.0
        pp = p1 * p2
        inverse = 1.0 / (product * pp)
        by_pp = inverse * product
        y1 = (g11 - 1.0) * (p2 * by_pp)
        y2 = (g22 - 1.0) * (p1 * by_pp)
        s1 = (e1 * y1) * polynomial(series, y1 * y1)
        s2 = (e2 * y2) * polynomial(series, y2 * y2)
        t = g12 / (root + area)
        tau = shear_stress(shear_law, shear_degree, shear_pieces, ends[2][0], ends[2][1], t)
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
        pull, warp_heat = connector_pull(
            lx, ly, lz,
            state[vx + U1 + i] - state[vx + i], state[vy + U1 + i] - state[vy + i], state[vz + U1 + i] - state[vz + i],
            warp_inverse, warp_viscosity, warp_law, warp_degree, warp_pieces, ends[0][0], ends[0][1], ends[0][2],
        )  # fmt: skip
        tow, weft_heat = connector_pull(
            ax, ay, az,
            state[vxu + i] - state[vx + i], state[vyu + i] - state[vy + i], state[vzu + i] - state[vz + i],
            weft_inverse, weft_viscosity, weft_law, weft_degree, weft_pieces, ends[1][0], ends[1][1], ends[1][2],
        )  # fmt: skip
        pull *= traits[warp_weight + i]
        tow *= traits[weft_weight + i]
        node[heat + i] = traits[warp_weight + i] * warp_heat + traits[weft_weight + i] * weft_heat
        if half_cells:
            edge[warp + i] = pull * lx + edge[upper + i] + (wl * px - hx)
            edge[warp + s + i] = pull * ly + edge[upper + s + i] + (wl * py - hy)
            edge[warp + s + s + i] = pull * lz + edge[upper + s + s + i] + (wl * pz - hz)
            edge[upper + i] = wu * px + hx
            edge[upper + s + i] = wu * py + hy
            edge[upper + s + s + i] = wu * pz + hz
            node[weft + i] = tow * ax + wa * qx
            node[weft + s + i] = tow * ay + wa * qy
            node[weft + s + s + i] = tow * az + wa * qz
            edge[half + i] = wb * qx
            edge[half + s + i] = wb * qy
            edge[half + s + s + i] = wb * qz
        else:
            edge[warp + i] = pull * lx + edge[upper + i] + (px - hx)
            edge[warp + s + i] = pull * ly + edge[upper + s + i] + (py - hy)
            edge[warp + s + s + i] = pull * lz + edge[upper + s + s + i] + (pz - hz)
            edge[upper + i] = px + hx
            edge[upper + s + i] = py + hy
            edge[upper + s + s + i] = pz + hz
            node[weft + i] = tow * ax + qx
            node[weft + s + i] = tow * ay + qy
            node[weft + s + s + i] = tow * az + qz
            edge[half + i] = qx
            edge[half + s + i] = qy
            edge[half + s + s + i] = qz


@row_loop
def carry_row(count, edge, node, stride):
    """Start the force on the crossings of a row with the weft edges below it."""
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    weft = LEAD
    force = LEAD + s + s + s + LEAD + LEAD
    half = force + s + s + s + LEAD + LEAD - U1
    for i in range(count):
        node[force + i] = -(node[weft + i] + edge[half + i])
        node[force + s + i] = -(node[weft + s + i] + edge[half + s + i])
        node[force + s + s + i] = -(node[weft + s + s + i] + edge[half + s + s + i])


@row_loop
def update_row(
    state, row, traits, trait, count, edge, node, stride, step, kick, keep, damping, driven, force_field
):  # fmt: skip
    """Sum of what the edges of each crossing pull with, then central differences; returns the damping heat of the row.

    ``keep`` is what mass damping leaves of a velocity in a step, ``damping`` its heat per area of fabric and squared
    sum of the velocities before and after. Where crossings are driven their force is kept in the state.
    Leaves the pull of the weft edges above as the first force on the next row.
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
    half = dashpots - U1
    heat = dashpots + s
    for i in range(count):
        ux = node[weft + i] + edge[half + i]
        uy = node[weft + s + i] + edge[half + s + i]
        uz = node[weft + s + s + i] + edge[half + s + s + i]
        fx = node[force + i] + ux + (edge[warp + i] - edge[before + i])
        fy = node[force + s + i] + uy + (edge[warp + s + i] - edge[before + s + i])
        fz = node[force + s + s + i] + uz + (edge[warp + s + s + i] - edge[before + s + s + i])
        node[force + i] = -ux
        node[force + s + i] = -uy
        node[force + s + s + i] = -uz
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
