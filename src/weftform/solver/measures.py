"""Strains and metric of a row, as surveys and the ledger take them from the state.

Apart from the time loop, which has its own: the ledger is a check on it. Written like the loops of
:mod:`weftform.solver.rows`, but for any stride.
"""

from __future__ import annotations

import math

import numpy as np

from weftform.mechanics.compiled import scalar
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


@row_loop
def closed_row(
    state, row, above, traits, trait, trait_above, count, stride, weights, lower, left, half_cells, sign_x, sign_y, largest
):  # fmt: skip
    """Largest squared sine, so far in each column, of the angle by which two connectors that meet have closed or opened.

    Of the cells above a row, at the corners where both are there. The legs that a half cell on a plane of symmetry lacks
    are mirror images of those it has (:func:`weftform.blank.grid.mirrors`).
    """
    use_full_width()
    s = np.uint64(stride)
    warp = trait + s * np.uint64(at.WARP_LINE)
    warp_above = trait_above + s * np.uint64(at.WARP_LINE)
    weft = trait + s * np.uint64(at.WEFT_LINE)
    volume = trait + s * np.uint64(at.VOLUME)
    mirror = trait + s * np.uint64(at.MIRROR)
    mirror_z = trait + s * np.uint64(at.MIRROR_Z)
    for i in range(count):
        ll, uu, ff, rr = 0.0, 0.0, 0.0, 0.0
        lf, lr, ur, uf = 0.0, 0.0, 0.0, 0.0
        cut = False
        for c in range(3):
            p = row + i + s * np.uint64(c)
            q = above + i + s * np.uint64(c)
            low, up = state[p + U1] - state[p], state[q + U1] - state[q]
            start, end = state[q] - state[p], state[q + U1] - state[p + U1]
            if half_cells:
                share = traits[mirror + i]
                cut = share > 0.0
                wl, wa = weights[lower + i], weights[left + i]
                # a share is a half
                image = 2.0 * (traits[mirror_z + i] if c == 2 else share * (sign_x if c == 0 else sign_y))
                of_weft = image * (wa * start + (1.0 - wa) * end)
                of_warp = image * (wl * low + (1.0 - wl) * up)
                low = of_weft if cut and wl == 0.0 else low
                up = of_weft if cut and wl == 1.0 else up
                start = of_warp if cut and wa == 0.0 else start
                end = of_warp if cut and wa == 1.0 else end
            ll += low * low
            uu += up * up
            ff += start * start
            rr += end * end
            lf += low * start
            lr += low * end
            ur += up * end
            uf += up * start
        there = traits[volume + i] > 0.0
        has_l, has_u = traits[warp + i] > 0.0, traits[warp_above + i] > 0.0
        has_f, has_r = traits[weft + i] > 0.0, traits[weft + U1 + i] > 0.0
        found = max(
            max(_sine(lf, ll * ff, (has_l and has_f) or cut), _sine(lr, ll * rr, (has_l and has_r) or cut)),
            max(_sine(ur, uu * rr, (has_u and has_r) or cut), _sine(uf, uu * ff, (has_u and has_f) or cut)),
        )
        largest[i] = max(largest[i], found if there else 0.0)


@scalar
def _sine(product, squares, there):
    """Squared sine of what is missing from a right angle, from a scalar product and the product of squared lengths."""
    return product * product / max(squares, 1e-300) if there else 0.0
