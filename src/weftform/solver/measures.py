"""Strains and metric of a row, as surveys and the ledger take them from the state.

Apart from the time loop, which has its own: the ledger is a check on it. Written like the loops of
:mod:`weftform.solver.rows`, but for any stride.
"""

from __future__ import annotations

import math

import numpy as np

from weftform.solver import layout as at
from weftform.solver.rows import U1
from weftform.solver.vector_loops import row_loop, use_full_width


@row_loop
def strain_row(state, row, other, count, stride, inverse, strain):
    """Nominal strain of the connectors from one row to another place."""
    use_full_width()
    s = np.uint64(stride)
    for i in range(count):
        dx = state[other + i] - state[row + i]
        dy = state[other + s + i] - state[row + s + i]
        dz = state[other + s + s + i] - state[row + s + s + i]
        strain[i] = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse - 1.0


@row_loop
def metric_row(
    state, row, above, traits, trait, count, stride, weights, lower, left, half_cells, sign_x, sign_y,
    warp_inverse, weft_inverse, g11, g22, g12,
):  # fmt: skip
    """Metric of the yarn directions of the cells above a row; that of a flat cell where there is none."""
    use_full_width()
    s = np.uint64(stride)
    volume = trait + s * np.uint64(at.VOLUME)
    mirror = trait + s * np.uint64(at.MIRROR)
    mirror_z = trait + s * np.uint64(at.MIRROR_Z)
    for i in range(count):
        wl = weights[lower + i]
        wa = weights[left + i]
        a11 = 0.0
        a22 = 0.0
        a12 = 0.0
        for c in range(3):
            p = row + i + s * np.uint64(c)
            q = above + i + s * np.uint64(c)
            low, up = state[p + U1] - state[p], state[q + U1] - state[q]
            start, end = state[q] - state[p], state[q + U1] - state[p + U1]
            g1 = (wl * low + (1.0 - wl) * up) * warp_inverse
            g2 = (wa * start + (1.0 - wa) * end) * weft_inverse
            if half_cells:
                # completed by its mirror image (blank.grid.mirrors)
                share = traits[mirror + i]
                image = traits[mirror_z + i] if c == 2 else share * (sign_x if c == 0 else sign_y)
                g1, g2 = (1.0 - share) * g1 + image * g2, (1.0 - share) * g2 + image * g1
            a11 += g1 * g1
            a22 += g2 * g2
            a12 += g1 * g2
        there = traits[volume + i] > 0.0
        g11[i] = a11 if there else 1.0
        g22[i] = a22 if there else 1.0
        g12[i] = a12 if there else 0.0
