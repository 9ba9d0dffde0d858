"""The loops over the cells of a row and the connectors that start at its crossings, from positions to forces.

What lies between the positions and the forces of a cell is one chain of roots, a quotient, a polynomial and two dozen products.
A processor keeps about a hundred operations waiting for their inputs, fewer than one such chain has, so a loop over all of it
waits most of the time (docs/architecture.md). Therefore five loops share the work, each short enough for the next eight cells to
begin while the last are under way: :func:`measure_row`, :func:`invert_row`, :func:`stress_row`, :func:`tension_row`,
:func:`pull_row`. They take at most ``layout.PIECE`` cells at a time and hand them on in ``between``, a block of scratch that
stays in the first-level cache; where they read and write it, it is at the same place.

Written like the loops of :mod:`weftform.solver.rows`, whose scratch they fill: ``edge`` gets the forces of the warp edges, those
carried to the edges of the row above, and what the cells give to the weft edges on their right; ``node`` gets the weft
edges with the share of the cells on their right.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from weftform.mechanics.connector import connector_pull
from weftform.mechanics.contact import TINY
from weftform.mechanics.membrane import SMALLEST_AREA_RATIO, shear_stress
from weftform.mechanics.piecewise import polynomial
from weftform.mechanics.roots import inverse_root
from weftform.solver import layout as at
from weftform.solver.rows import LEAD, U1
from weftform.solver.vector_loops import add_lanes, loop_part, row_loop, use_full_width

S = np.uint64(at.PIECE)
G11, G22, G12 = np.uint64(0), S, 2 * S
WARP_LENGTH, WEFT_SQUARED, WARP_RATE, WEFT_RATE = 3 * S, 4 * S, 5 * S, 6 * S
Y1, Y2, TANGENT, AREA, BY_G11, BY_G22 = G11, G22, 7 * S, 8 * S, 9 * S, 10 * S
A11, A22, A12, PULL, TOW = G11, G22, G12, WARP_LENGTH, WEFT_SQUARED
"""Rows of scratch ``between``; each loop writes over what no later one reads."""


@loop_part
def even_piece(count):
    """Cells of the pieces that a row is cut into: whole blocks of lanes, as even as can be."""
    pieces = max(1, -(-count // at.PIECE))
    return -(-count // (pieces * at.LANES)) * at.LANES


@loop_part
def edges_of(state, here, above, i):
    """One component of the lower edge of a cell, its left edge, and how far its upper edge differs from the lower."""
    low = state[here + U1 + i] - state[here + i]
    return low, state[above + i] - state[here + i], state[above + U1 + i] - state[above + i] - low


@loop_part
def covariant(low, left, twist, upper, right, own, mirror):
    """One component of the covariant vectors of a half cell: means of opposite edges by the weights of the upper and the right.

    The other half of a cell on a plane of symmetry is its mirror image (blank.grid.mirrors).
    """
    g1 = low + upper * twist
    g2 = left + right * twist
    return own * g1 + mirror * g2, own * g2 + mirror * g1


@loop_part
def cell_of(state, row, s, step, traits, trait, half_cells, signs, i):
    """Geometry of the cell above and to the right of a crossing.

    Returns its lower and its left edge, how far the opposite edges differ from them, the covariant vectors (with half cells the
    means of opposite edges, else their sums), and what the lower, upper, left and right edge get of the forces on these.
    """
    lx, ax, hx = edges_of(state, row, row + step, i)
    ly, ay, hy = edges_of(state, row + s, row + s + step, i)
    lz, az, hz = edges_of(state, row + s + s, row + s + s + step, i)
    if half_cells:
        wl = traits[trait + s * np.uint64(at.LOWER_WEIGHT) + i]
        wa = traits[trait + s * np.uint64(at.LEFT_WEIGHT) + i]
        q = traits[trait + s * np.uint64(at.MIRROR) + i]
        qz = traits[trait + s * np.uint64(at.MIRROR_Z) + i]
        wu, wb = 1.0 - wl, 1.0 - wa
        g1x, g2x = covariant(lx, ax, hx, wu, wb, 1.0 - q, q * signs[0])
        g1y, g2y = covariant(ly, ay, hy, wu, wb, 1.0 - q, q * signs[1])
        g1z, g2z = covariant(lz, az, hz, wu, wb, 1.0 - q, qz)
    else:
        wl, wu, wa, wb = 1.0, 1.0, 1.0, 1.0
        g1x, g2x = 2.0 * lx + hx, 2.0 * ax + hx
        g1y, g2y = 2.0 * ly + hy, 2.0 * ay + hy
        g1z, g2z = 2.0 * lz + hz, 2.0 * az + hz
    return (lx, ly, lz), (ax, ay, az), (hx, hy, hz), (g1x, g1y, g1z), (g2x, g2y, g2z), (wl, wu, wa, wb)


@row_loop
def measure_row(state, row, traits, trait, count, between, stride, row_length, half_cells, membrane):
    """Metric of the cells of a piece; lengths of its connectors (of wefts the square) and half the rates of the squares.

    One root of two, because that is what the divider can do while the rest of the loop is computed.

    ``membrane`` = (c11, c22, c12, E warp, E weft, hourglass, mirror signs x, y): ``c11 = 1 / (n warp pitch)^2`` and so
    on make the metric of the yarn directions out of the edge vectors, which come as the sum of two edges (n = 2), or
    with half cells as their weighted mean (n = 1).
    """
    use_full_width()
    numba.literally(stride)
    numba.literally(row_length)
    s = np.uint64(stride)
    step = np.uint64(row_length)
    vx = row + s * np.uint64(at.VELOCITY)
    vy, vz = vx + s, vx + s + s
    c11, c22, c12 = membrane[0], membrane[1], membrane[2]
    signs = membrane[6], membrane[7]
    for i in range(count):
        (lx, ly, lz), (ax, ay, az), _, (g1x, g1y, g1z), (g2x, g2y, g2z), _ = cell_of(
            state, row, s, step, traits, trait, half_cells, signs, i
        )
        between[G11 + i] = c11 * (g1x * g1x + g1y * g1y + g1z * g1z)
        between[G22 + i] = c22 * (g2x * g2x + g2y * g2y + g2z * g2z)
        between[G12 + i] = c12 * (g1x * g2x + g1y * g2y + g1z * g2z)
        between[WARP_LENGTH + i] = math.sqrt(max(lx * lx + ly * ly + lz * lz, TINY))
        between[WEFT_SQUARED + i] = ax * ax + ay * ay + az * az
        between[WARP_RATE + i] = (
            lx * (state[vx + U1 + i] - state[vx + i])
            + ly * (state[vy + U1 + i] - state[vy + i])
            + lz * (state[vz + U1 + i] - state[vz + i])
        )
        between[WEFT_RATE + i] = (
            ax * (state[vx + step + i] - state[vx + i])
            + ay * (state[vy + step + i] - state[vy + i])
            + az * (state[vz + step + i] - state[vz + i])
        )


@row_loop
def invert_row(count, between):
    """Roots and quotients of the cells: area ratio, ``tan(gamma / 2)``, ``y`` of the stretches, one over the metric.

    See :func:`weftform.mechanics.membrane.half_tangent` and ``log_stretch``; one reciprocal serves four quotients, and roots are
    made by multiplications because two quotients keep the divider busy.
    """
    use_full_width()
    for i in range(count):
        g11, g22, g12 = between[G11 + i], between[G22 + i], between[G12 + i]
        product = g11 * g22
        squared = max(product - g12 * g12, SMALLEST_AREA_RATIO)
        p1, p2 = g11 + 1.0, g22 + 1.0
        pp = p1 * p2
        inverse = 1.0 / (product * pp)
        area = squared * inverse_root(squared)
        between[AREA + i] = area
        between[TANGENT + i] = g12 / (product * inverse_root(product) + area)
        by_pp = inverse * product
        between[Y1 + i] = (g11 - 1.0) * (p2 * by_pp)
        between[Y2 + i] = (g22 - 1.0) * (p1 * by_pp)
        by_product = inverse * pp
        between[BY_G11 + i] = by_product * g22
        between[BY_G22 + i] = by_product * g11


@row_loop
def stress_row(traits, trait, count, between, stride, membrane, series, degree, pieces, law, ends):
    """Forces of the cells conjugate to their covariant vectors: that to ``g1`` is ``a11 g1 + a12 g2``.

    See :func:`weftform.mechanics.membrane.covariant_forces`.
    """
    use_full_width()
    numba.literally(stride)
    volume = trait + np.uint64(stride) * np.uint64(at.VOLUME)
    c11, c22, c12 = membrane[0], membrane[1], membrane[2]
    e1, e2 = membrane[3], membrane[4]
    for i in range(count):
        y1, y2, area = between[Y1 + i], between[Y2 + i], between[AREA + i]
        s1 = (e1 * y1) * polynomial(series, y1 * y1)
        s2 = (e2 * y2) * polynomial(series, y2 * y2)
        tau = shear_stress(law, degree, pieces, ends[0], ends[1], between[TANGENT + i])
        turned = between[G12 + i] * tau
        v = traits[volume + i]
        between[A12 + i] = (c12 * v) * tau
        between[A11 + i] = (c11 * v) * between[BY_G11 + i] * (area * s1 - turned)
        between[A22 + i] = (c22 * v) * between[BY_G22 + i] * (area * s2 - turned)


@row_loop
def tension_row(
    traits, trait, count, between, stride,
    warp_inverse, warp_viscosity, warp_degree, warp_pieces, warp_law,
    weft_inverse, weft_viscosity, weft_degree, weft_pieces, weft_law, ends,
):  # fmt: skip
    """Forces of the connectors per length of the vector between their ends; returns the power their dashpots take [mJ/s]."""
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    warp_weight = trait + s * np.uint64(at.WARP_LINE)
    weft_weight = trait + s * np.uint64(at.WEFT_LINE)
    heat = 0.0
    for i in range(count):
        length = between[WARP_LENGTH + i]
        squared = between[WEFT_SQUARED + i]
        inverse = inverse_root(squared)
        pull, warp_drag, warp_heat = connector_pull(
            length, between[WARP_RATE + i], warp_inverse, warp_viscosity,
            warp_law, warp_degree, warp_pieces, ends[0][0], ends[0][1], ends[0][2],
        )  # fmt: skip
        tow, weft_drag, weft_heat = connector_pull(
            squared * inverse, between[WEFT_RATE + i], weft_inverse, weft_viscosity,
            weft_law, weft_degree, weft_pieces, ends[1][0], ends[1][1], ends[1][2],
        )  # fmt: skip
        between[PULL + i] = traits[warp_weight + i] * (pull / length + warp_drag)
        between[TOW + i] = traits[weft_weight + i] * (tow * inverse + weft_drag)
        heat = add_lanes(heat, traits[warp_weight + i] * warp_heat + traits[weft_weight + i] * weft_heat)
    return heat


@row_loop
def pull_row(state, row, traits, trait, count, between, edge, node, stride, row_length, half_cells, membrane):
    """Forces along the edges of the cells of a piece: its connectors, its cells, and what the cells below carried up."""
    use_full_width()
    numba.literally(stride)
    numba.literally(row_length)
    s = np.uint64(stride)
    step = np.uint64(row_length)
    volume = trait + s * np.uint64(at.VOLUME)
    block = s + s + s + LEAD + LEAD
    warp = LEAD
    upper = LEAD + block
    half = upper + block
    weft = LEAD
    signs = membrane[6], membrane[7]
    for i in range(count):
        (lx, ly, lz), (ax, ay, az), (hx, hy, hz), (g1x, g1y, g1z), (g2x, g2y, g2z), (wl, wu, wa, wb) = cell_of(
            state, row, s, step, traits, trait, half_cells, signs, i
        )
        a11, a22, a12 = between[A11 + i], between[A22 + i], between[A12 + i]
        pull, tow = between[PULL + i], between[TOW + i]
        k = membrane[5] * traits[volume + i]
        if half_cells:
            k = k * (16.0 * (wl * wu) * (wa * wb))
        px = a11 * g1x + a12 * g2x
        py = a11 * g1y + a12 * g2y
        pz = a11 * g1z + a12 * g2z
        qx = a22 * g2x + a12 * g1x
        qy = a22 * g2y + a12 * g1y
        qz = a22 * g2z + a12 * g1z
        hx *= k
        hy *= k
        hz *= k
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


@row_loop
def warp_row(
    state, row, traits, trait, count, edge, node, stride, inverse_length, viscosity, degree, pieces, law, ends
):  # fmt: skip
    """Warp connectors of the last row of a band, plus what the cells below carried to their upper edges.

    Returns the power the dashpots take [mJ/s].

    ``viscosity`` [N s/mm3] is that of the dashpots over the squared pitch (docs/theory/dynamics.md).
    """
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    weight = trait + s * np.uint64(at.WARP_LINE)
    block = s + s + s + LEAD + LEAD
    warp = LEAD
    upper = LEAD + block
    half = upper + block
    weft = LEAD
    heat = 0.0
    for i in range(count):
        dx = state[x + U1 + i] - state[x + i]
        dy = state[y + U1 + i] - state[y + i]
        dz = state[z + U1 + i] - state[z + i]
        rate = (
            dx * (state[vx + U1 + i] - state[vx + i])
            + dy * (state[vy + U1 + i] - state[vy + i])
            + dz * (state[vz + U1 + i] - state[vz + i])
        )
        length = math.sqrt(max(dx * dx + dy * dy + dz * dz, TINY))
        pull, drag, hot = connector_pull(
            length, rate, inverse_length, viscosity, law, degree, pieces, ends[0], ends[1], ends[2]
        )
        f = traits[weight + i] * (pull / length + drag)
        heat = add_lanes(heat, traits[weight + i] * hot)
        edge[warp + i] = f * dx + edge[upper + i]
        edge[warp + s + i] = f * dy + edge[upper + s + i]
        edge[warp + s + s + i] = f * dz + edge[upper + s + s + i]
        node[weft + i] = 0.0
        node[weft + s + i] = 0.0
        node[weft + s + s + i] = 0.0
        edge[half + i] = 0.0
        edge[half + s + i] = 0.0
        edge[half + s + s + i] = 0.0
    return heat
