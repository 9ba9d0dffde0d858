"""Forces of the elements on the device: connector, cell, contact. Tuples of three are vectors.

The same equations as the row loops of the processor (:mod:`weftform.solver.fabric_rows`,
:mod:`weftform.solver.contact_rows`), each by the scalar functions of :mod:`weftform.mechanics`; a thread has one
element, so nothing is arranged for vector units here.
"""

from __future__ import annotations

from weftform.mechanics.connector import connector_pull
from weftform.mechanics.contact import coulomb, rounded_edge
from weftform.mechanics.membrane import covariant_forces, half_tangent, log_stretch, shear_stress
from weftform.mechanics.roots import inverse_root
from weftform.solver.contact_rows import SMALL
from weftform.solver.cuda.functions import combine, device_function, dot, minus


@device_function
def line_force(way, rate, weight, inverse_length, viscosity, law):
    """Force along a connector and the power its dashpot takes.

    Parameters
    ----------
    way, rate
        From its start to its end [mm], and how that changes [mm/s].
    weight
        Yarns it stands for.
    viscosity
        Of its dashpot, over the squared initial length [N s/mm3].
    law
        (coefficients, degree, pieces, width, end slope, slack slope).

    Returns
    -------
    Force on the start [N], a vector, and heat [mJ/s].
    """
    squared = dot(way, way)
    inverse = inverse_root(squared)
    pull, drag, heat = connector_pull(
        squared * inverse, dot(way, rate), inverse_length, viscosity, law[0], law[1], law[2], law[3], law[4], law[5]
    )
    f = weight * (pull * inverse + drag)
    return (f * way[0], f * way[1], f * way[2]), weight * heat


@device_function
def covariant_vectors(lower, upper, left, right, low, near, mirror, mirror_x, mirror_y, mirror_z, i1, i2):
    """Mean yarn vectors of a cell over their initial lengths; half cells on a plane of symmetry are completed.

    ``low`` and ``near`` are the weights of the lower and left edge, ``mirror`` is the share of the mirror image and
    ``mirror_x, mirror_y, mirror_z`` are that times its signs (:meth:`weftform.blank.grid.YarnGrid.mirrors`).
    """
    g1 = combine(i1 * low, lower, i1 * (1.0 - low), upper)
    g2 = combine(i2 * near, left, i2 * (1.0 - near), right)
    own = 1.0 - mirror
    return (
        (own * g1[0] + mirror_x * g2[0], own * g1[1] + mirror_y * g2[1], own * g1[2] + mirror_z * g2[2]),
        (own * g2[0] + mirror_x * g1[0], own * g2[1] + mirror_y * g1[1], own * g2[2] + mirror_z * g1[2]),
    )


@device_function
def cell_forces(lower, upper, left, right, low, near, mirror, mirror_z, volume, membrane, law, series):
    """Forces along the four edges of a cell [N]: lower, upper, left, right.

    ``membrane`` = (1 / warp pitch, 1 / weft pitch, E warp, E weft, hourglass, mirror signs x, y); ``law`` is that of
    shear (coefficients, degree, pieces, width, end slope) and ``series`` that of the logarithm.
    """
    g1, g2 = covariant_vectors(
        lower, upper, left, right, low, near,
        mirror, mirror * membrane[5], mirror * membrane[6], mirror_z, membrane[0], membrane[1],
    )  # fmt: skip
    g11 = dot(g1, g1)
    g22 = dot(g2, g2)
    g12 = dot(g1, g2)
    tau = shear_stress(law[0], law[1], law[2], law[3], law[4], half_tangent(g11, g22, g12))
    a11, a12, a22 = covariant_forces(
        volume, g11, g22, g12, membrane[2] * log_stretch(g11, series), membrane[3] * log_stretch(g22, series), tau
    )
    p = combine(membrane[0] * a11, g1, membrane[0] * a12, g2)
    q = combine(membrane[1] * a12, g1, membrane[1] * a22, g2)
    hourglass = membrane[4] * volume * (16.0 * low * (1.0 - low) * near * (1.0 - near))
    twist = minus(upper, lower)
    return (
        combine(low, p, -hourglass, twist),
        combine(1.0 - low, p, hourglass, twist),
        (near * q[0], near * q[1], near * q[2]),
        ((1.0 - near) * q[0], (1.0 - near) * q[1], (1.0 - near) * q[2]),
    )


@device_function
def tool_traction(position, velocity, held, tools, k, tool_z, tool_step, step, on_face):
    """Force per area of tool ``k`` on a crossing, penalty and Coulomb friction.

    Parameters
    ----------
    held
        Friction traction at the last evaluation [MPa].
    tools
        Table of the tools (``T_`` constants of :mod:`weftform.solver.loop`).
    tool_step, step
        Way of the tool [mm] and time [s] since the last evaluation.
    on_face
        The whole row lies against the flat face of the tool, so the normal is its axis.

    Returns
    -------
    Traction on the crossing, its friction part [MPa], and the friction heat per area times tangential stiffness per
    area [MPa^2].
    """
    if on_face:
        distance = tools[k, 2] * (position[2] - tool_z - tools[k, 3]) - tools[k, 4]
        normal = (0.0, 0.0, tools[k, 2])
    else:
        squared = position[0] * position[0] + position[1] * position[1]
        inverse = inverse_root(max(squared, SMALL))
        distance, normal_s, normal_z = rounded_edge(
            squared * inverse, position[2] - tool_z, tools[k, 0], tools[k, 1], tools[k, 2], tools[k, 3], tools[k, 4]
        )
        radial = normal_s * inverse
        normal = (position[0] * radial, position[1] * radial, normal_z)
    stiffness = tools[k, 6]
    press = stiffness * max(tools[k, 5] - distance, 0.0)
    tangential = tools[k, 8] * stiffness
    wx = held[0] - tangential * (velocity[0] * step)
    wy = held[1] - tangential * (velocity[1] * step)
    wz = held[2] - tangential * (velocity[2] * step - tool_step)
    along = wx * normal[0] + wy * normal[1] + wz * normal[2]
    fx, fy, fz, heat = coulomb(
        wx - along * normal[0], wy - along * normal[1], wz - along * normal[2], tools[k, 7] * press
    )
    return (
        (press * normal[0] + fx, press * normal[1] + fy, press * normal[2] + fz),
        (fx, fy, fz),
        heat,
    )
