"""The largest stable step of central differences, from the current tangent stiffness."""

from __future__ import annotations

import math


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


def stable_step(crossing: float, contact: float, mass: float, viscosity: float = 0.0) -> float:
    """Largest step [s] of central differences: ``2 / omega`` with ``omega^2 = (4 crossing + contact) / mass``.

    The highest mode is a zig-zag from node to node. With dashpots ``c = viscosity mass / step`` that see the
    velocity of half a step ago it obeys ``x^2 - (2 - 4 viscosity - h^2 omega^2) x + 1 - 4 viscosity = 0``, which
    is stable for ``h omega < 2 sqrt(1 - 2 viscosity)``.
    """
    return 2.0 * math.sqrt((1.0 - 2.0 * viscosity) * mass / (4.0 * crossing + contact))
