"""The loops over a piece of a row that lies against a rigid tool: penalty contact and Coulomb friction.

All work in tractions (force per area of fabric, MPa), so that stiffness and its inverse are constants of the tool:
the traction of a crossing times its area is its force. Written like the loops of :mod:`weftform.solver.rows`, and cut where a
chain of operations would become too long, for the reason given in :mod:`weftform.solver.fabric_rows`: against the rounded edge of
a tool :func:`radius_row`, :func:`normal_row` and :func:`friction_row` have one root each, and :func:`trial_row` has none. A piece
is at most ``layout.PIECE`` long.

``tool`` = (side_s, s0, side_z, z0, radius, half thickness, stiffness per area, friction, tangential ratio).
"""

from __future__ import annotations

import numba
import numpy as np

from weftform.mechanics.contact import coulomb, rounded_edge
from weftform.mechanics.roots import inverse_root
from weftform.solver import layout as at
from weftform.solver.rows import LEAD
from weftform.solver.vector_loops import row_loop, use_full_width

SMALL = 1.0e-24
"""Square of a distance from the axis [mm2] below which there is no radial direction."""

S = np.uint64(at.PIECE)
INVERSE, AWAY = np.uint64(0), S
RADIAL, AXIAL, PRESS = INVERSE, AWAY, 2 * S
"""Rows of scratch ``between``."""


@row_loop
def face_row(state, row, traits, trait, grip, held, count, node, stride, tool, tool_z, step):
    """Contact of crossings that lie against the flat face of a tool, where the normal is the axis.

    The axial component of the friction traction is zero there and stays so. Leaves what :func:`friction_row` leaves.
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


@row_loop
def radius_row(state, row, count, between, stride):
    """Distance of crossings from the axis, and one over it."""
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    x, y = row, row + s
    for i in range(count):
        px, py = state[x + i], state[y + i]
        squared = px * px + py * py
        inverse = inverse_root(max(squared, SMALL))
        between[INVERSE + i] = inverse
        between[AWAY + i] = squared * inverse


@row_loop
def normal_row(state, row, count, between, stride, tool, tool_z):
    """Outward normal of the rounded edge of a tool (radial part over the distance from the axis, axial part) and pressure."""
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    z = row + s + s
    side_s, s0, side_z, z0, radius = tool[0], tool[1], tool[2], tool[3], tool[4]
    half_thickness, stiffness = tool[5], tool[6]
    for i in range(count):
        distance, normal_s, normal_z = rounded_edge(
            between[AWAY + i], state[z + i] - tool_z, side_s, s0, side_z, z0, radius
        )
        between[RADIAL + i] = normal_s * between[INVERSE + i]
        between[AXIAL + i] = normal_z
        between[PRESS + i] = stiffness * max(half_thickness - distance, 0.0)


@row_loop
def trial_row(state, row, grip, held, count, between, stride, tool, tool_step, step):
    """Friction traction that would be if nothing slipped: a tangential spring, of which only the tangential part is kept.

    So it turns with the surface. ``tool_step`` is the way of the tool and ``step`` the time since the last evaluation.
    """
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    x, y, z = row, row + s, row + s + s
    vx, vy, vz = z + s, z + s + s, z + s + s + s
    tx, ty, tz = held, held + s, held + s + s
    spring = tool[8] * tool[6]
    drag = spring * step
    towed = spring * tool_step
    for i in range(count):
        radial, nz = between[RADIAL + i], between[AXIAL + i]
        nx = state[x + i] * radial
        ny = state[y + i] * radial
        wx = grip[tx + i] - drag * state[vx + i]
        wy = grip[ty + i] - drag * state[vy + i]
        wz = grip[tz + i] - (drag * state[vz + i] - towed)
        along = wx * nx + wy * ny + wz * nz
        grip[tx + i] = wx - along * nx
        grip[ty + i] = wy - along * ny
        grip[tz + i] = wz - along * nz


@row_loop
def friction_row(state, row, traits, trait, grip, held, count, between, node, stride, tool):
    """Cut the trial friction to the Coulomb limit and add the force of the tool to that on the crossings.

    Leaves the axial part of the force [N] and the friction heat of the step times the tangential stiffness per area.
    """
    use_full_width()
    numba.literally(stride)
    s = np.uint64(stride)
    x, y = row, row + s
    area = trait + s * np.uint64(at.AREA)
    tx, ty, tz = held, held + s, held + s + s
    force = LEAD + s + s + s + LEAD + LEAD
    axial = force + s + s + s + LEAD + LEAD + s
    heat = axial + s
    friction = tool[7]
    for i in range(count):
        press = between[PRESS + i]
        fx, fy, fz, slipped = coulomb(grip[tx + i], grip[ty + i], grip[tz + i], friction * press)
        grip[tx + i] = fx
        grip[ty + i] = fy
        grip[tz + i] = fz
        a = traits[area + i]
        outward = press * between[RADIAL + i]
        total = a * (press * between[AXIAL + i] + fz)
        node[force + i] += a * (outward * state[x + i] + fx)
        node[force + s + i] += a * (outward * state[y + i] + fy)
        node[force + s + s + i] += total
        node[axial + i] = total
        node[heat + i] = a * slipped
