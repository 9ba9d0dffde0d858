"""The largest stable step of central differences, from the current tangent stiffness."""

from __future__ import annotations

import math

from weftform.mechanics.compiled import scalar


@scalar
def crossing_stiffness(warp: float, weft: float, membrane: float, sine: float) -> float:
    """Largest eigenvalue of the stiffness that opposes a zig-zag of one crossing [N/mm].

    ``warp`` and ``weft`` are connector tangents [N/mm] in directions whose cosine is ``sine`` of the shear
    angle: ``k1 n1 n1' + k2 n2 n2'`` has the largest eigenvalue
    ``(k1+k2)/2 + sqrt((k1-k2)^2/4 + k1 k2 sine^2)``.
    ``membrane`` [N/mm] bounds the stiffness of the cells and is added.
    """
    mean = 0.5 * (warp + weft)
    half = 0.5 * (warp - weft)
    return mean + math.sqrt(half * half + warp * weft * sine * sine) + membrane


@scalar
def stable_step(crossing: float, contact: float, mass: float) -> float:
    """``2 / omega`` [s] with ``omega^2 = (4 crossing + contact) / mass`` (a zig-zag from node to node)."""
    return 2.0 * math.sqrt(mass / (4.0 * crossing + contact))
