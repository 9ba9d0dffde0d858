"""Shear angles from tangents, by operations that vector units have."""

from __future__ import annotations

import math

from weftform.mechanics.compiled import scalar
from weftform.mechanics.piecewise import polynomial

HALVINGS = 3
SERIES = tuple((-1.0) ** k / (2 * k + 1) for k in reversed(range(12)))
"""Of the arc tangent over its argument, highest power of the square first; cut at 2e-17 for arguments up to 0.2."""


@scalar
def arc_tangent(x: float) -> float:
    """Arc tangent, to 5e-16 relative: the angle is halved until the series takes few terms.

    ``tan(a / 2) = tan a / (1 + sqrt(1 + tan^2 a))``; three times, any angle is below 0.2.
    """
    for _ in range(HALVINGS):
        x = x / (1.0 + math.sqrt(1.0 + x * x))
    value: float = polynomial(SERIES, x * x)
    return 2.0**HALVINGS * x * value


@scalar
def angle_between(t: float, before: float) -> float:
    """Change of the shear angle [rad], less than a right angle, from ``tan(gamma / 2)`` then and now."""
    return 2.0 * arc_tangent((t - before) / (1.0 + t * before))


@scalar
def mean_half_tangent(t: float, before: float) -> float:
    """``tan(gamma / 2)`` of the angle halfway between two."""
    return (t + before) / (1.0 - t * before + math.sqrt((1.0 + t * t) * (1.0 + before * before)))


@scalar
def cosine(t: float) -> float:
    """``cos(gamma)`` from ``tan(gamma / 2)``."""
    return (1.0 - t * t) / (1.0 + t * t)
