"""From a law to the polynomial pieces that the time loop evaluates (:mod:`weftform.mechanics.piecewise`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weftform.fabric.laws import Floats, Law, LinearLaw, PolynomialLaw, Scaled

TABLE_PIECES = 1024
"""Pieces of a law that is no polynomial: cubic Hermite, so the error falls with the fourth power of their width."""

SHEAR_FIT_TOLERANCE = 1.0e-8
"""Largest error of the polynomial in ``tan(gamma / 2)``, relative to the law's largest stress over the fitted range."""


@dataclass(frozen=True)
class PiecewiseLaw:
    """Packed law.

    Attributes
    ----------
    coefficients
        shape [pieces * (degree + 1)], highest power first within a piece, in the local coordinate.
    integrals
        shape [pieces], the integral of the law from 0 to the start of each piece.
    degree, pieces
        Size of the packing.
    width
        Width of a piece.
    end_slope
        Slope beyond the last piece.
    """

    coefficients: Floats
    integrals: Floats
    degree: int
    pieces: int
    width: float
    end_slope: float


def pack_polynomial(powers: Floats, end: float) -> PiecewiseLaw:
    """One piece from the coefficients of ``x^0, x^1, ...`` up to ``end``, straight beyond."""
    p = np.polynomial.Polynomial(powers)
    return PiecewiseLaw(
        coefficients=np.asarray(powers, float)[::-1].copy(),
        integrals=np.zeros(1),
        degree=len(powers) - 1,
        pieces=1,
        width=end,
        end_slope=float(p.deriv()(end)),
    )


def pack_law(law: Law, end: float) -> PiecewiseLaw:
    """Pack a law for ``0 <= x``; exact for (scaled) polynomial and linear laws, cubic Hermite pieces for others.

    Parameters
    ----------
    law
        The law, in the variable of the time loop.
    end
        Where the pieces end for a law without a limit of validity.
    """
    scale_x, scale_y, inner = 1.0, 1.0, law
    while isinstance(inner, Scaled):
        scale_x, scale_y, inner = scale_x * inner.factor_x, scale_y * inner.factor_y, inner.law
    if isinstance(inner, LinearLaw):
        return pack_polynomial(np.array([0.0, scale_x * scale_y * inner.stiffness]), end)
    if isinstance(inner, PolynomialLaw):
        powers = np.array([inner.constant, *inner.coefficients]) * scale_x ** np.arange(len(inner.coefficients) + 1)
        return pack_polynomial(scale_y * powers, inner.valid_to / scale_x)
    from scipy.interpolate import CubicHermiteSpline

    x = np.linspace(0.0, min(end, law.valid_to), TABLE_PIECES + 1)
    spline = CubicHermiteSpline(x, law.value(x), law.slope(x))
    antiderivative = spline.antiderivative()
    return PiecewiseLaw(
        coefficients=np.ascontiguousarray(spline.c.T).ravel(),
        integrals=np.asarray(antiderivative(x[:-1])),
        degree=3,
        pieces=TABLE_PIECES,
        width=float(x[1]),
        end_slope=float(law.slope(x[-1])),
    )


def pack_shear(stress: Law) -> PiecewiseLaw:
    """Pack ``tau / t`` as a function of ``t = tan(gamma / 2)`` on 0..1 (shear angles 0..90 degrees).

    A smooth law becomes one polynomial, of the lowest degree that keeps the error below :data:`SHEAR_FIT_TOLERANCE`; a law that
    no polynomial follows so closely (tabulated points) becomes cubic pieces.
    """
    nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(400) + 0.5) / 400)
    angle = 2.0 * np.arctan(nodes)
    ratio = stress.value(angle) / nodes
    scale = float(np.abs(ratio).max())
    if scale == 0.0:
        return pack_polynomial(np.zeros(2), 1.0)
    for degree in range(3, 15):
        fit = np.polynomial.Chebyshev.fit(nodes, ratio, degree, domain=[0.0, 1.0])
        if np.abs(fit(nodes) - ratio).max() <= SHEAR_FIT_TOLERANCE * scale:
            powers = fit.convert(kind=np.polynomial.Polynomial, domain=[-1, 1], window=[-1, 1]).coef
            return pack_polynomial(np.asarray(powers), 1.0)
    from scipy.interpolate import PchipInterpolator

    t = np.linspace(0.0, 1.0, TABLE_PIECES + 1)
    values = np.empty_like(t)
    values[1:] = stress.value(2.0 * np.arctan(t[1:])) / t[1:]
    values[0] = 2.0 * float(stress.slope(0.0))
    spline = PchipInterpolator(t, values)
    return PiecewiseLaw(
        coefficients=np.ascontiguousarray(spline.c.T).ravel(),
        integrals=np.asarray(spline.antiderivative()(t[:-1])),
        degree=3,
        pieces=TABLE_PIECES,
        width=float(t[1]),
        end_slope=float(spline(1.0, 1)),
    )
