"""The hypoelastic membrane in total form.

The paper accumulates stress increments in two orthonormal frames, one on each yarn direction, and takes the mean of the
two shears (Eqs. 12-24). For any motion the increments of engineering shear in the two frames are
``dgamma +- (dln l2 - dln l1) tan(gamma)``, so the mean is exactly ``dgamma`` and the law integrates to a state function of the
yarn stretches ``l1, l2`` and the shear angle ``gamma``: ``s1 = E1 ln l1``, ``s2 = E2 ln l2``, ``tau = tau(gamma)``. See
``docs/theory/membrane.md``. Indices 1 and 2 stand for warp and weft in this file's formulas only.
"""

from __future__ import annotations

import math
from typing import Any

from weftform.mechanics.compiled import scalar
from weftform.mechanics.piecewise import horner, odd, piecewise_slope, piecewise_value

SMALLEST_AREA_RATIO = 1.0e-6
"""Floor of the squared area ratio of a cell: a folded cell keeps a finite force until the run is stopped."""


@scalar
def log_stretch(squared_stretch: float, coefficients: Any, terms: int) -> float:
    """``ln l`` from ``l**2`` by the odd series in ``y = (l**2 - 1) / (l**2 + 1)``; ``coefficients`` are fitted."""
    y = (squared_stretch - 1.0) / (squared_stretch + 1.0)
    return y * horner(coefficients, terms - 1, 0, y * y)


@scalar
def half_tangent(g11: float, g22: float, g12: float) -> float:
    """``tan(gamma / 2)`` from the metric of the yarn directions (products of the covariant vectors)."""
    area = math.sqrt(max(g11 * g22 - g12 * g12, SMALLEST_AREA_RATIO))
    return g12 / (math.sqrt(g11 * g22) + area)


@scalar
def shear_angle(g11: float, g22: float, g12: float) -> float:
    """Shear angle [rad]: the decrease of the angle between the yarns, positive when they close."""
    return 2.0 * math.atan(half_tangent(g11, g22, g12))


@scalar
def shear_stress(coefficients: Any, degree: int, pieces: int, width: float, end_slope: float, t: float) -> float:
    """``tau`` [MPa] as a law in ``t = tan(gamma / 2)``, odd in ``t``. The fitted polynomial is of ``tau / t``."""
    size = abs(t)
    return odd(size * piecewise_value(coefficients, degree, pieces, width, end_slope, size), t)


@scalar
def shear_stress_slope(
    coefficients: Any, degree: int, pieces: int, width: float, end_slope: float, t: float
) -> float:
    """Derivative of :func:`shear_stress` with respect to ``t`` [MPa]."""
    size = abs(t)
    return piecewise_value(coefficients, degree, pieces, width, end_slope, size) + size * piecewise_slope(
        coefficients, degree, pieces, width, end_slope, size
    )


@scalar
def covariant_forces(
    volume: float, g11: float, g22: float, g12: float, warp_stress: float, weft_stress: float, shear: float
) -> tuple[float, float, float]:
    """Coefficients ``a11, a12, a22`` of the forces conjugate to the covariant vectors.

    The force on ``g1`` is ``a11 g1 + a12 g2`` and on ``g2`` ``a12 g1 + a22 g2``. From the power per current volume
    ``s1 dln l1 + s2 dln l2 + tau dgamma`` with ``J dgamma = dg12 - g12 (dln l1 + dln l2)`` and constant thickness, where
    ``volume`` is thickness times the initial area.
    """
    area = math.sqrt(max(g11 * g22 - g12 * g12, SMALLEST_AREA_RATIO))
    a12 = volume * shear
    a11 = volume * (area * warp_stress - g12 * shear) / g11
    a22 = volume * (area * weft_stress - g12 * shear) / g22
    return a11, a12, a22
