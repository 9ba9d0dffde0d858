"""The loops over a piece of a row that lies against a rigid tool: penalty contact and Coulomb friction.

All work in tractions (force per area of fabric, MPa), so that stiffness and its inverse are constants of the tool:
the traction of a crossing times its area is its force. Written like the loops of :mod:`weftform.solver.rows`, and against the
rounded edge of a tool cut in two, :func:`normal_row` and :func:`friction_row`, for the reason given in
:mod:`weftform.solver.fabric_rows`. A piece is at most ``layout.PIECE`` long.

``tool`` = (side_s, s0, side_z, z0, radius, half thickness, stiffness per area, friction, tangential ratio).
"""

from __future__ import annotations

import numba
import numpy as np

from weftform.mechanics.contact import coulomb, rounded_edge
from weftform.mechanics.roots import inverse_root
from weftform.solver import layout as at
from weftform.solver.rows import LEAD
from weftform.solver.vector_loops import add_lanes, row_loop, use_full_width

SMALL = 1.0e-24
"""Square of a distance from the axis [mm2] below which there is no radial direction."""

S = np.uint64(at.PIECE)
RADIAL, AXIAL, PRESS = np.uint64(0), S, 2 * S
"""Rows of scratch ``between``."""


@row_loop
def face_row(state, row, traits, trait, grip, held, count, node, stride, tool, tool_z, step):
    """Contact of crossings that lie against the flat face of a tool, where the normal is the axis.

    The axial component of the friction traction is zero there and stays so. Returns what :func:`friction_row` returns.
    """
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    z = row + s + s
    vx = z + s
    vy = vx + s
    area = trait + s * np.uint64(at.AREA)
    tx, ty = held, held + s
    force = LEAD + s + s + s + LEAD + LEAD
    axial, heat = 0.0, 0.0
    side, z0, radius = tool[2], tool[3], tool[4]
    half_thickness, stiffness, friction, ratio = tool[5], tool[6], tool[7], tool[8]
    drag = ratio * stiffness * step
    top = half_thickness + radius + side * (tool_z + z0)
    for i in range(count):
        a = traits[area + i]
        press = stiffness * max(top - side * state[z + i], 0.0)
        fx, fy, _, slipped = coulomb(
            grip[tx + i] - drag * state[vx + i], grip[ty + i] - drag * state[vy + i], 0.0, friction * press
        )
        grip[tx + i] = fx
        grip[ty + i] = fy
        node[force + i] += a * fx
        node[force + s + i] += a * fy
        total = a * (press * side)
        node[force + s + s + i] += total
        axial = add_lanes(axial, total)
        heat = add_lanes(heat, a * slipped)
    return axial, heat


@row_loop
def normal_row(state, row, count, between, stride, tool, tool_z):
    """Outward normal of the rounded edge of a tool (radial part over the distance from the axis, axial part) and pressure."""
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    z = row + s + s
    side_s, s0, side_z, z0, radius = tool[0], tool[1], tool[2], tool[3], tool[4]
    half_thickness, stiffness = tool[5], tool[6]
    x, y = row, row + s
    for i in range(count):
        px, py = state[x + i], state[y + i]
        squared = px * px + py * py
        inverse = inverse_root(max(squared, SMALL))
        distance, normal_s, normal_z = rounded_edge(
            squared * inverse, state[z + i] - tool_z, side_s, s0, side_z, z0, radius
        )
        between[RADIAL + i] = normal_s * inverse
        between[AXIAL + i] = normal_z
        between[PRESS + i] = stiffness * max(half_thickness - distance, 0.0)


@row_loop
def friction_row(state, row, traits, trait, grip, held, count, between, node, stride, tool, tool_step, step):
    """Coulomb friction under the pressure that :func:`normal_row` found; adds the force of the tool to that on the crossings.

    The friction traction is a tangential spring, cut to the Coulomb limit; only its tangential part is kept (in ``grip``), so
    it turns with the surface. ``tool_step`` is the way of the tool and ``step`` the time since the last evaluation. Returns the
    axial force on the fabric [N] and the friction heat of the step times the tangential stiffness per area.
    """
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    area = trait + s * np.uint64(at.AREA)
    tx, ty, tz = held, held + s, held + s + s
    force = LEAD + s + s + s + LEAD + LEAD
    axial, heat = 0.0, 0.0
    stiffness, friction, ratio = tool[6], tool[7], tool[8]
    drag = ratio * stiffness * step
    towed = ratio * stiffness * tool_step
    for i in range(count):
        radial, nz, press = between[RADIAL + i], between[AXIAL + i], between[PRESS + i]
        nx = state[x + i] * radial
        ny = state[y + i] * radial
        wx = grip[tx + i] - drag * state[vx + i]
        wy = grip[ty + i] - drag * state[vy + i]
        wz = grip[tz + i] - (drag * state[vz + i] - towed)
        along = wx * nx + wy * ny + wz * nz
        fx, fy, fz, slipped = coulomb(wx - along * nx, wy - along * ny, wz - along * nz, friction * press)
        grip[tx + i] = fx
        grip[ty + i] = fy
        grip[tz + i] = fz
        a = traits[area + i]
        total = a * (press * nz + fz)
        node[force + i] += a * (press * nx + fx)
        node[force + s + i] += a * (press * ny + fy)
        node[force + s + s + i] += total
        axial = add_lanes(axial, total)
        heat = add_lanes(heat, a * slipped)
    return axial, heat
