"""The loops over one row of the yarn grid, each written so that LLVM turns it into vector code.

What makes that work: offsets between the fields are constants once inlined, indices are unsigned, there is no branch in a loop
body, and shifted reads (``i - 1``, ``i + 1``) are never from fields that the loop writes: a load that overlaps a store of the
previous iteration would stop the vectoriser. Every loop runs over whole blocks of ``layout.LANES`` places, so no row
ends in a scalar remainder; what lies in the padding has no mass, no weight and no area.

Scratch ``edge`` holds three blocks of three components: warp edge forces, upper-edge forces carried to the next row, and
what the cells give to the weft edges on their right. Scratch ``node`` holds: weft edge forces (with the share of the
cells on their right), and force on the crossings.
"""

from __future__ import annotations

import numba
import numpy as np

from weftform.solver import layout as at
from weftform.solver.vector_loops import add_lanes, row_loop, use_full_width

U1 = np.uint64(1)
LEAD = np.uint64(at.LEAD)


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
    """Sum of what the edges of each crossing pull with, then central differences; returns the heat of mass damping.

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
    half = force + s + s + s + LEAD + LEAD - U1
    heat = 0.0
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
        heat = add_lanes(heat, traits[inertia + i] * (mx2 * mx2 + my2 * my2 + mz2 * mz2))
    return damping * heat
