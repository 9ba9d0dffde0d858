"""Contact of a point of the fabric with a rigid tool: signed distance, penalty, Coulomb friction.

One shape covers the analytic tools: the *rounded edge*. In the half plane ``(s, z)``, with ``s`` the
distance to the axis of the tool, a tool is the set of points within ``radius`` of the quadrant ``u <= 0,
w <= 0`` where ``u = +-(s - s0)`` and ``w = +-(z - z0)``.

- punch: ``u = s - 0``, a quarter circle that meets the axis: a hemisphere with its shank; ``s0 > 0`` a
  flat-bottomed punch;
- die: ``u = s0 - s``: a flat face, a fillet and the wall of the hole;
- blank-holder: the same turned over, usually with a small edge radius.
"""

from __future__ import annotations

from weftform.mechanics.compiled import scalar
from weftform.mechanics.roots import inverse_root

TINY = 1.0e-300
"""Smallest square of a length or a traction that is not taken for zero."""


@scalar
def rounded_edge(
    s: float, z: float, side_s: float, s0: float, side_z: float, z0: float, radius: float
) -> tuple[float, float, float]:
    """Signed distance [mm] to a rounded edge and its outward normal ``(n_s, n_z)``; negative inside."""
    u = side_s * (s - s0)
    w = side_z * (z - z0)
    outside_u = max(u, 0.0)
    outside_w = max(w, 0.0)
    squared = outside_u * outside_u + outside_w * outside_w
    deep = 1.0 if squared < TINY else 0.0
    inverse = (1.0 - deep) * inverse_root(max(squared, TINY))
    depth = min(max(u, w), 0.0)
    flat = deep if w >= u else 0.0
    normal_u = outside_u * inverse + (deep - flat)
    normal_w = outside_w * inverse + flat
    return squared * inverse + depth - radius, side_s * normal_u, side_z * normal_w


@scalar
def coulomb(trial_x: float, trial_y: float, trial_z: float, limit: float) -> tuple[float, float, float, float]:
    """Return mapping of the trial friction on the Coulomb disc of radius ``limit``, both forces or tractions.

    Returns the three components and the product of the excess cut off and what is kept: the excess over the
    tangential stiffness is the slip of the step, made against the friction that is kept, so the product over that
    stiffness is the heat.
    """
    squared = trial_x * trial_x + trial_y * trial_y + trial_z * trial_z
    inverse = inverse_root(max(squared, TINY))
    share = min(1.0, limit * inverse)
    size = squared * inverse
    kept = share * size
    return share * trial_x, share * trial_y, share * trial_z, (size - kept) * kept
