"""The loops over one row of the yarn grid, each written so that LLVM turns it into vector code.

What makes that work: all reads are from the state, all writes to scratch arrays (or the other way round), offsets
between the fields are constants once inlined, indices are unsigned, and there is no branch in a loop body.
Shifted reads (``i - 1``) are from another array than the one written: a load that overlaps a store of the
previous iteration would stop the vectoriser.

Scratch ``edge`` holds three blocks: warp edge forces, upper-edge forces carried to the next row, and half the
weft edge forces. Scratch ``node`` holds three: weft edge forces, force on the crossings, and the axial contact
force.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from weftform.mechanics.compiled import FASTMATH
from weftform.mechanics.connector import connector_force
from weftform.mechanics.contact import coulomb, rounded_edge
from weftform.mechanics.membrane import shear_stress
from weftform.mechanics.piecewise import polynomial
from weftform.solver import layout as at

U1 = np.uint64(1)
U4 = np.uint64(4)
LEAD = np.uint64(at.LEAD)
SMALL = 1.0e-12


def row_loop(function: Callable[..., Any]) -> Any:
    """Compile a loop over one row so that it is inlined where its constants are known."""
    return numba.njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)(function)


@row_loop
def warp_row(state, row, count, edge, node, stride, inverse_length, viscosity, degree, pieces, law):
    """Warp connectors of a row, plus what the cells below carried to their upper edges; starts the nodal force."""
    s = np.uint64(stride)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    weight = row + s * np.uint64(at.WARP_LINE)
    warp = LEAD
    upper = LEAD + s + s + s + LEAD + LEAD
    weft = LEAD
    force = LEAD + s + s + s + LEAD + LEAD
    heat = force + s + s + s + LEAD + LEAD + s
    for i in range(count):
        dx = state[x + U1 + i] - state[x + i]
        dy = state[y + U1 + i] - state[y + i]
        dz = state[z + U1 + i] - state[z + i]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        pull = connector_force(law[0], degree, pieces, law[2], law[3], law[4], length * inverse_length - 1.0)
        rate = (
            dx * (state[vx + U1 + i] - state[vx + i])
            + dy * (state[vy + U1 + i] - state[vy + i])
            + dz * (state[vz + U1 + i] - state[vz + i])
        ) / length
        drag = viscosity * rate
        node[heat + i] = state[weight + i] * drag * rate
        f = state[weight + i] * (pull + drag) / length
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
    count,
    edge,
    stride,
    row_length,
    half_cells,
    edge_weight,
    membrane,
    degree,
    pieces,
    law,
    series,
):
    """Membrane of the cells between a row and the next: forces on their four edges.

    ``membrane`` = (1 / warp pitch, 1 / weft pitch, E warp, E weft, hourglass stiffness). The force conjugate to
    ``g1`` is ``a11 g1 + a12 g2`` (mechanics.membrane.covariant_forces); one reciprocal serves all five quotients
    of a cell.
    """
    s = np.uint64(stride)
    step = np.uint64(row_length)
    x, y, z = row, row + s, row + s + s
    xu, yu, zu = x + step, y + step, z + step
    volume = row + s * np.uint64(at.VOLUME)
    lower_weight = row + s * np.uint64(edge_weight)
    left_weight = lower_weight + s
    block = s + s + s + LEAD + LEAD
    warp = LEAD
    upper = LEAD + block
    weft = LEAD + block + block
    right = weft + block
    e1, e2 = membrane[2], membrane[3]
    i1, i2 = membrane[0], membrane[1]
    stabilise = membrane[4]
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
        if half_cells:
            wl = state[lower_weight + i]
            wa = state[left_weight + i]
        else:
            wl = 0.5
            wa = 0.5
        wu = 1.0 - wl
        wb = 1.0 - wa
        g1x = i1 * (wl * lx + wu * ux)
        g1y = i1 * (wl * ly + wu * uy)
        g1z = i1 * (wl * lz + wu * uz)
        g2x = i2 * (wa * ax + wb * bx)
        g2y = i2 * (wa * ay + wb * by)
        g2z = i2 * (wa * az + wb * bz)
        g11 = g1x * g1x + g1y * g1y + g1z * g1z
        g22 = g2x * g2x + g2y * g2y + g2z * g2z
        g12 = g1x * g2x + g1y * g2y + g1z * g2z
        product = g11 * g22
        area = math.sqrt(max(product - g12 * g12, 1.0e-6))
        diagonal = math.sqrt(product) + area
        p1 = g11 + 1.0
        p2 = g22 + 1.0
        pp = p1 * p2
        inverse = 1.0 / (product * pp * diagonal)
        t = g12 * (inverse * product * pp)
        by_product_pp = inverse * diagonal
        by_product = by_product_pp * pp
        by_pp = by_product_pp * product
        y1 = (g11 - 1.0) * p2 * by_pp
        y2 = (g22 - 1.0) * p1 * by_pp
        s1 = e1 * y1 * polynomial(series, y1 * y1)
        s2 = e2 * y2 * polynomial(series, y2 * y2)
        tau = shear_stress(law[0], degree, pieces, law[2], law[3], t)
        v = state[volume + i]
        a12 = v * tau
        a11 = v * (area * s1 - g12 * tau) * (by_product * g22)
        a22 = v * (area * s2 - g12 * tau) * (by_product * g11)
        px = i1 * (a11 * g1x + a12 * g2x)
        py = i1 * (a11 * g1y + a12 * g2y)
        pz = i1 * (a11 * g1z + a12 * g2z)
        qx = i2 * (a22 * g2x + a12 * g1x)
        qy = i2 * (a22 * g2y + a12 * g1y)
        qz = i2 * (a22 * g2z + a12 * g1z)
        k = stabilise * v
        if half_cells:
            k = k * (4.0 * wl * wu * wa * wb * 4.0)
        hx = k * (ux - lx)
        hy = k * (uy - ly)
        hz = k * (uz - lz)
        edge[warp + i] += wl * px - hx
        edge[warp + s + i] += wl * py - hy
        edge[warp + s + s + i] += wl * pz - hz
        edge[upper + i] = wu * px + hx
        edge[upper + s + i] = wu * py + hy
        edge[upper + s + s + i] = wu * pz + hz
        edge[weft + i] = wa * qx
        edge[weft + s + i] = wa * qy
        edge[weft + s + s + i] = wa * qz
        if half_cells:
            edge[right + i] = wb * qx
            edge[right + s + i] = wb * qy
            edge[right + s + s + i] = wb * qz


@row_loop
def weft_row(
    state, row, count, edge, node, stride, row_length, half_cells, inverse_length, viscosity, degree, pieces, law
):  # fmt: skip
    """Weft connectors between a row and the next, plus the share of the cells on both sides."""
    s = np.uint64(stride)
    step = np.uint64(row_length)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    weight = row + s * np.uint64(at.WEFT_LINE)
    block = s + s + s + LEAD + LEAD
    left = LEAD + block + block
    right = left + (block if half_cells else np.uint64(0)) - U1
    weft = LEAD
    heat = LEAD + block + block + s + s
    for i in range(count):
        dx = state[x + step + i] - state[x + i]
        dy = state[y + step + i] - state[y + i]
        dz = state[z + step + i] - state[z + i]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        pull = connector_force(law[0], degree, pieces, law[2], law[3], law[4], length * inverse_length - 1.0)
        rate = (
            dx * (state[vx + step + i] - state[vx + i])
            + dy * (state[vy + step + i] - state[vy + i])
            + dz * (state[vz + step + i] - state[vz + i])
        ) / length
        drag = viscosity * rate
        node[heat + i] = state[weight + i] * drag * rate
        f = state[weight + i] * (pull + drag) / length
        node[weft + i] = f * dx + (edge[left + i] + edge[right + i])
        node[weft + s + i] = f * dy + (edge[left + s + i] + edge[right + s + i])
        node[weft + s + s + i] = f * dz + (edge[left + s + s + i] + edge[right + s + s + i])


@row_loop
def gather_row(count, edge, node, stride):
    """Internal force on the crossings of a row: what its edges pull with."""
    s = np.uint64(stride)
    warp = LEAD
    before = LEAD - U1
    weft = LEAD
    force = LEAD + s + s + s + LEAD + LEAD
    for i in range(count):
        node[force + i] += edge[warp + i] - edge[before + i] + node[weft + i]
        node[force + s + i] += edge[warp + s + i] - edge[before + s + i] + node[weft + s + i]
        node[force + s + s + i] += edge[warp + s + s + i] - edge[before + s + s + i] + node[weft + s + s + i]


@row_loop
def keep_row(state, row, count, node, stride, field):
    """Keep the internal force of a row in the state, for the reactions of driven crossings."""
    s = np.uint64(stride)
    force = LEAD + s + s + s + LEAD + LEAD
    kept = row + s * np.uint64(field)
    for i in range(count):
        state[kept + i] = node[force + i]
        state[kept + s + i] = node[force + s + i]
        state[kept + s + s + i] = node[force + s + s + i]


@row_loop
def sum_axial(node, count, axial):
    """Sum of a scratch row in four lanes, which a vector unit adds at once and always in the same order."""
    # what an earlier, longer row left beyond the end of this one does not count
    for k in range(3):
        node[axial + count + np.uint64(k)] = 0.0
    a = 0.0
    b = 0.0
    c = 0.0
    d = 0.0
    i = np.uint64(0)
    while i < count:
        a += node[axial + i]
        b += node[axial + U1 + i]
        c += node[axial + U1 + U1 + i]
        d += node[axial + U1 + U1 + U1 + i]
        i += U4
    return (a + b) + (c + d)


@row_loop
def face_row(state, row, count, node, stride, field, tool, tool_z, step):
    """:func:`contact_row` for a row that lies wholly against the flat face of a tool: the normal is the axis."""
    s = np.uint64(stride)
    z = row + s + s
    vx = z + s
    vy = vx + s
    area = row + s * np.uint64(at.AREA)
    tx = row + s * np.uint64(field)
    ty = tx + s
    tz = ty + s
    slipped = tz + s
    block = s + s + s + LEAD + LEAD
    force = LEAD + block
    axial = LEAD + block + block
    side, z0, radius = tool[2], tool[3], tool[4]
    half_thickness, stiffness, friction, ratio = tool[5], tool[6], tool[7], tool[8]
    for i in range(count):
        distance = side * (state[z + i] - tool_z - z0) - radius
        k = stiffness * state[area + i]
        press = k * max(half_thickness - distance, 0.0)
        kt = ratio * k
        fx, fy, _, heat = coulomb(
            state[tx + i] - kt * (state[vx + i] * step),
            state[ty + i] - kt * (state[vy + i] * step),
            0.0,
            friction * press,
        )
        state[tx + i] = fx
        state[ty + i] = fy
        state[tz + i] = 0.0
        state[slipped + i] += heat
        node[force + i] += fx
        node[force + s + i] += fy
        node[force + s + s + i] += press * side
        node[axial + i] = press * side
    return sum_axial(node, count, axial)


@row_loop
def contact_row(state, row, count, node, stride, field, tool, tool_z, tool_step, step):
    """Penalty contact and Coulomb friction of a row with one tool; returns the axial force on the fabric [N].

    ``tool`` = (side_s, s0, side_z, z0, radius, half thickness, stiffness per area, friction, tangential ratio).
    ``tool_step`` is the way of the tool and ``step`` the time since the last evaluation. The friction force is a
    tangential spring, cut to the Coulomb limit; only its tangential part is kept, so it turns with the surface.
    """
    s = np.uint64(stride)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    area = row + s * np.uint64(at.AREA)
    tx = row + s * np.uint64(field)
    ty = tx + s
    tz = ty + s
    slipped = tz + s
    block = s + s + s + LEAD + LEAD
    force = LEAD + block
    axial = LEAD + block + block
    side_s, s0, side_z, z0, radius = tool[0], tool[1], tool[2], tool[3], tool[4]
    half_thickness, stiffness, friction, ratio = tool[5], tool[6], tool[7], tool[8]
    for i in range(count):
        px = state[x + i]
        py = state[y + i]
        away = math.sqrt(px * px + py * py)
        distance, normal_s, normal_z = rounded_edge(away, state[z + i] - tool_z, side_s, s0, side_z, z0, radius)
        k = stiffness * state[area + i]
        press = k * max(half_thickness - distance, 0.0)
        radial = normal_s / max(away, SMALL)
        nx = px * radial
        ny = py * radial
        nz = normal_z
        kt = ratio * k
        wx = state[tx + i] - kt * (state[vx + i] * step)
        wy = state[ty + i] - kt * (state[vy + i] * step)
        wz = state[tz + i] - kt * (state[vz + i] * step - tool_step)
        along = wx * nx + wy * ny + wz * nz
        fx, fy, fz, heat = coulomb(wx - along * nx, wy - along * ny, wz - along * nz, friction * press)
        state[tx + i] = fx
        state[ty + i] = fy
        state[tz + i] = fz
        state[slipped + i] += heat
        total = press * nz + fz
        node[force + i] += press * nx + fx
        node[force + s + i] += press * ny + fy
        node[force + s + s + i] += total
        node[axial + i] = total
    return sum_axial(node, count, axial)


@row_loop
def update_row(state, row, count, node, stride, step, mean_step, keep, damping):
    """Central differences: velocities, then positions. ``keep`` is what mass damping leaves of a velocity in a step."""
    s = np.uint64(stride)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    mx, my, mz = vz + s, vz + s + s, vz + s + s + s
    damped = row + s * np.uint64(at.DAMPED)
    inertia = row + s * np.uint64(at.INERTIA)
    force = LEAD + s + s + s + LEAD + LEAD
    warp_heat = force + s + s + s + LEAD + LEAD + s
    weft_heat = warp_heat + s
    for i in range(count):
        ox = state[vx + i]
        oy = state[vy + i]
        oz = state[vz + i]
        nx = keep * ox + mean_step * state[mx + i] * node[force + i]
        ny = keep * oy + mean_step * state[my + i] * node[force + s + i]
        nz = keep * oz + mean_step * state[mz + i] * node[force + s + s + i]
        state[vx + i] = nx
        state[vy + i] = ny
        state[vz + i] = nz
        state[x + i] += step * nx
        state[y + i] += step * ny
        state[z + i] += step * nz
        mx2 = ox + nx
        my2 = oy + ny
        mz2 = oz + nz
        state[damped + i] += damping * state[inertia + i] * (mx2 * mx2 + my2 * my2 + mz2 * mz2) + step * (
            node[warp_heat + i] + node[weft_heat + i]
        )
