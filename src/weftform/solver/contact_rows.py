"""The loops over a piece of a row that lies against a rigid tool: penalty contact and Coulomb friction.

Both work in tractions (force per area of fabric, MPa), so that stiffness and its inverse are constants of the tool:
the traction of a crossing times its area is its force. Written like the loops of :mod:`weftform.solver.rows`.
"""

from __future__ import annotations

import numba
import numpy as np

from weftform.mechanics.contact import coulomb, rounded_edge
from weftform.mechanics.roots import inverse_root
from weftform.solver import layout as at
from weftform.solver.rows import LEAD, sum_lanes
from weftform.solver.vector_loops import row_loop, use_full_width

SMALL = 1.0e-24
"""Square of a distance from the axis [mm2] below which there is no radial direction."""


@row_loop
def face_row(state, row, traits, trait, grip, held, count, node, stride, tool, tool_z, step):
    """:func:`contact_row` for crossings against the flat face of a tool only: the normal is the axis.

    The axial component of the friction traction is zero there and stays so.
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
    axial = force + s + s + s + LEAD + LEAD + s
    heat = axial + s
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
        node[axial + i] = total
        node[heat + i] = a * slipped
    return sum_lanes(node, axial, count), sum_lanes(node, heat, count)


@row_loop
def contact_row(state, row, traits, trait, grip, held, count, node, stride, tool, tool_z, tool_step, step):
    """Penalty contact and Coulomb friction of crossings with one tool.

    Returns the axial force on the fabric [N] and the friction heat of the step times the tangential stiffness per
    area. ``tool`` = (side_s, s0, side_z, z0, radius, half thickness, stiffness per area, friction, tangential ratio).
    ``tool_step`` is the way of the tool and ``step`` the time since the last evaluation. The friction traction is a
    tangential spring, cut to the Coulomb limit; only its tangential part is kept (in ``grip``), so it turns with the
    surface.
    """
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    area = trait + s * np.uint64(at.AREA)
    tx, ty, tz = held, held + s, held + s + s
    force = LEAD + s + s + s + LEAD + LEAD
    axial = force + s + s + s + LEAD + LEAD + s
    heat = axial + s
    side_s, s0, side_z, z0, radius = tool[0], tool[1], tool[2], tool[3], tool[4]
    half_thickness, stiffness, friction, ratio = tool[5], tool[6], tool[7], tool[8]
    drag = ratio * stiffness * step
    towed = ratio * stiffness * tool_step
    for i in range(count):
        px = state[x + i]
        py = state[y + i]
        squared = px * px + py * py
        inverse = inverse_root(max(squared, SMALL))
        away = squared * inverse
        distance, normal_s, nz = rounded_edge(away, state[z + i] - tool_z, side_s, s0, side_z, z0, radius)
        press = stiffness * max(half_thickness - distance, 0.0)
        radial = normal_s * inverse
        nx = px * radial
        ny = py * radial
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
        node[axial + i] = total
        node[heat + i] = a * slipped
    return sum_lanes(node, axial, count), sum_lanes(node, heat, count)
