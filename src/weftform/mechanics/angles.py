"""Shear angles from tangents of their halves, by operations that vector units have."""

from __future__ import annotations

import math

from weftform.mechanics.compiled import scalar
from weftform.mechanics.piecewise import polynomial

SERIES = tuple((-1.0) ** k / (2 * k + 1) for k in reversed(range(21)))
"""Of the arc tangent over its argument, highest power of the square first; cut at 2e-18 for arguments up to tan(pi / 8)."""


@scalar
def arc_tangent(x: float) -> float:
    """Arc tangent of a number between -1 and 1, to 1e-15 relative.

    Of half the angle, ``tan(a / 2) = tan a / (1 + sqrt(1 + tan^2 a))``, by the series.
    """
    half = x / (1.0 + math.sqrt(1.0 + x * x))
    return 2.0 * half * polynomial(SERIES, half * half)


@scalar
def root_of_secants(t: float, before: float) -> float:
    """``1 / (cos(gamma / 2) cos(gamma' / 2))`` of two angles, from the tangents of their halves."""
    return math.sqrt((1.0 + t * t) * (1.0 + before * before))


@scalar
def mean_half_tangent(t: float, before: float, root: float) -> float:
    """``tan(gamma / 2)`` of the angle halfway between two, whose :func:`root_of_secants` is ``root``."""
    return (t + before) / (1.0 - t * before + root)


@scalar
def angle_between(t: float, before: float, root: float) -> float:
    """Difference of two shear angles [rad], less than two right angles; ``root`` is their :func:`root_of_secants`."""
    return 4.0 * arc_tangent((t - before) / (1.0 + t * before + root))
