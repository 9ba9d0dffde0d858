"""Contact of a point of the fabric with a rigid tool: signed distance, penalty, Coulomb friction.

One shape covers the analytic tools: the *rounded edge*. In the half plane ``(s, z)``, with ``s`` the distance to the axis of the
tool, a tool is the set of points within ``radius`` of the quadrant ``u <= 0, w <= 0`` where ``u = +-(s - s0)`` and ``w = +-(z - z0)``.

- punch: ``u = s - 0``, a quarter circle that meets the axis: a hemisphere with its shank; ``s0 > 0`` a flat-bottomed punch;
- die: ``u = s0 - s``: a flat face, a fillet and the wall of the hole;
- blank-holder: the same turned over, usually with a small edge radius.
"""

from __future__ import annotations

import math

from weftform.mechanics.compiled import scalar

TINY = 1.0e-300


@scalar
def rounded_edge(
    s: float, z: float, side_s: float, s0: float, side_z: float, z0: float, radius: float
) -> tuple[float, float, float]:
    """Signed distance [mm] to a rounded edge and its outward normal ``(n_s, n_z)``; negative inside."""
    u = side_s * (s - s0)
    w = side_z * (z - z0)
    outside_u = max(u, 0.0)
    outside_w = max(w, 0.0)
    reach = math.sqrt(outside_u * outside_u + outside_w * outside_w)
    depth = min(max(u, w), 0.0)
    inverse = 1.0 / max(reach, TINY)
    deep = 1.0 if depth < 0.0 else 0.0
    flat = 1.0 if w >= u else 0.0
    normal_u = outside_u * inverse + deep * (1.0 - flat)
    normal_w = outside_w * inverse + deep * flat
    return reach + depth - radius, side_s * normal_u, side_z * normal_w


@scalar
def coulomb(trial_x: float, trial_y: float, trial_z: float, limit: float) -> tuple[float, float, float, float]:
    """Return mapping of the trial friction force on the Coulomb disc of radius ``limit`` [N].

    Returns the three components and the excess that was cut off [N]: excess / tangential stiffness is the slip.
    """
    size = math.sqrt(trial_x * trial_x + trial_y * trial_y + trial_z * trial_z)
    share = min(1.0, limit / max(size, TINY))
    return share * trial_x, share * trial_y, share * trial_z, size - share * size
