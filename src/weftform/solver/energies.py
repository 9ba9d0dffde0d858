"""Energies for the ledger, evaluated independently of the time loop.

Energies of connectors, hourglass control and contact are functions of the state. The membrane's stress is a
function of the state but, with constant thickness, has no potential, so its work is integrated with Simpson's
rule from entry to entry. (Friction and damping heat are sums of the time loop.) The ledger therefore closes only if
the time loop integrates the same physics.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from weftform.mechanics.compiled import FASTMATH
from weftform.mechanics.connector import connector_energy
from weftform.mechanics.contact import rounded_edge
from weftform.mechanics.membrane import half_tangent, log_stretch, shear_stress
from weftform.solver import layout as at

KINETIC = 0
CONNECTORS = 1
MEMBRANE = 2
HOURGLASS = 3
CONTACT = 4
ENTRIES = 5


@numba.njit(fastmath=FASTMATH, error_model="numpy", cache=True, nogil=True)
def enter_ledger(
    state, traits, trait_rows, row_index, columns, stride, fields, trait_fields, half_cells, tools, density,
    membrane, series, warp_law, weft_law, shear_law, shapes, warp_pitch, weft_pitch, tool_table, poses, grip,
):  # fmt: skip
    """Sum the energies and integrate the membrane's work since the last entry.

    Parameters
    ----------
    density
        Mass per area, mass scaling included [tonne/mm2].
    shapes
        (warp degree, warp pieces, weft degree, weft pieces, shear degree, shear pieces).

    Returns
    -------
    Energies [mJ], shape [ENTRIES].
    """
    out = np.zeros(ENTRIES)
    rows = row_index.shape[0]
    wd, wp, fd, fp, sd, sp = shapes
    length = fields * stride
    for j in range(rows):
        base = row_index[j] * length
        trait = trait_rows[row_index[j]] * trait_fields * stride
        above = row_index[j + 1] * length if j < rows - 1 else base
        for i in range(columns):
            n = base + i
            m = trait + i
            area = traits[m + at.AREA * stride]
            if area <= 0.0:
                continue
            x = state[n]
            y = state[n + stride]
            z = state[n + 2 * stride]
            speed2 = state[n + 3 * stride] ** 2 + state[n + 4 * stride] ** 2 + state[n + 5 * stride] ** 2
            out[KINETIC] += 0.5 * density * traits[m + at.INERTIA * stride] * speed2
            away = math.sqrt(x * x + y * y)
            for k in range(tools):
                t = tool_table[k]
                distance, _, _ = rounded_edge(away, z - poses[k, 0], t[0], t[1], t[2], t[3], t[4])
                gap = distance - t[5]
                stiffness = t[6] * area
                if gap < 0.0:
                    held = grip[row_index[j], k, :, i]
                    stick = held[0] ** 2 + held[1] ** 2 + held[2] ** 2
                    out[CONTACT] += 0.5 * stiffness * gap * gap + 0.5 * area * stick / (t[8] * t[6])
            weight = traits[m + at.WARP_LINE * stride]
            if weight > 0.0:
                dx = state[n + 1] - x
                dy = state[n + 1 + stride] - y
                dz = state[n + 1 + 2 * stride] - z
                strain = math.sqrt(dx * dx + dy * dy + dz * dz) / warp_pitch - 1.0
                out[CONNECTORS] += (
                    weight
                    * warp_pitch
                    * connector_energy(warp_law[0], warp_law[1], wd, wp, warp_law[2], warp_law[3], warp_law[4], strain)
                )
            u = above + i
            weight = traits[m + at.WEFT_LINE * stride]
            if weight > 0.0:
                dx = state[u] - x
                dy = state[u + stride] - y
                dz = state[u + 2 * stride] - z
                strain = math.sqrt(dx * dx + dy * dy + dz * dz) / weft_pitch - 1.0
                out[CONNECTORS] += (
                    weight
                    * weft_pitch
                    * connector_energy(weft_law[0], weft_law[1], fd, fp, weft_law[2], weft_law[3], weft_law[4], strain)
                )
        if j == rows - 1:
            continue
        for i in range(columns - 1):
            n = base + i
            m = trait + i
            volume = traits[m + at.VOLUME * stride]
            if volume <= 0.0:
                continue
            u = above + i
            low = 0.5
            left = 0.5
            if half_cells:
                low = traits[m + at.LOWER_WEIGHT * stride]
                left = traits[m + at.LEFT_WEIGHT * stride]
            whole = 16.0 * low * (1.0 - low) * left * (1.0 - left)
            g11 = 0.0
            g22 = 0.0
            g12 = 0.0
            hourglass = 0.0
            q = 0.0
            if half_cells:
                q = traits[m + at.MIRROR * stride]
            for c in range(3):
                p = c * stride
                lower = state[n + 1 + p] - state[n + p]
                upper = state[u + 1 + p] - state[u + p]
                start = state[u + p] - state[n + p]
                end = state[u + 1 + p] - state[n + 1 + p]
                g1 = (low * lower + (1.0 - low) * upper) / warp_pitch
                g2 = (left * start + (1.0 - left) * end) / weft_pitch
                if q > 0.0:
                    # completed by its mirror image (blank.grid.mirrors)
                    sign = traits[m + at.MIRROR_Z * stride] / q if c == 2 else membrane[6 + c]
                    g1, g2 = (1.0 - q) * g1 + q * sign * g2, (1.0 - q) * g2 + q * sign * g1
                g11 += g1 * g1
                g22 += g2 * g2
                g12 += g1 * g2
                hourglass += (upper - lower) ** 2
            out[HOURGLASS] += 0.5 * membrane[5] * volume * whole * hourglass
            t = half_tangent(g11, g22, g12)
            tau = shear_stress(shear_law[0], sd, sp, shear_law[2], shear_law[3], t)
            e1 = log_stretch(g11, series)
            e2 = log_stretch(g22, series)
            angle = 2.0 * math.atan(t)
            field = n + at.LEDGER * stride
            o1 = state[field]
            o2 = state[field + stride]
            oa = state[field + 2 * stride]
            ot = shear_stress(shear_law[0], sd, sp, shear_law[2], shear_law[3], math.tan(0.5 * oa))
            # Simpson's rule over the way since the last entry, straight in (ln l1, ln l2, gamma)
            m1 = 0.5 * (e1 + o1)
            m2 = 0.5 * (e2 + o2)
            ma = 0.5 * (angle + oa)
            mt = shear_stress(shear_law[0], sd, sp, shear_law[2], shear_law[3], math.tan(0.5 * ma))
            new = math.exp(e1 + e2) * math.cos(angle)
            mid = 4.0 * math.exp(m1 + m2) * math.cos(ma)
            old = math.exp(o1 + o2) * math.cos(oa)
            state[field + 3 * stride] += (
                volume
                / 6.0
                * (
                    membrane[3] * (new * e1 + mid * m1 + old * o1) * (e1 - o1)
                    + membrane[4] * (new * e2 + mid * m2 + old * o2) * (e2 - o2)
                    + (new * tau + mid * mt + old * ot) * (angle - oa)
                )
            )
            state[field] = e1
            state[field + stride] = e2
            state[field + 2 * stride] = angle
            out[MEMBRANE] += state[field + 3 * stride]
    return out
