"""Packed laws: value, slope and integral against the laws they stand for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from weftform.fabric import LinearLaw, LogStrainLaw, PolynomialLaw, Scaled, Sum, TabulatedLaw
from weftform.fabric.piecewise import TABLE_PIECES, pack_law
from weftform.mechanics.piecewise import (
    horner,
    piecewise_integral,
    piecewise_slope,
    piecewise_value,
    polynomial,
)

QUARTIC = PolynomialLaw((19.75, -123.13, 573.0, -91.645), 3.9)
END = 3.0
"""Where the packing ends for a law without a limit."""

EXACT = {
    "polynomial": QUARTIC,
    "linear": LinearLaw(12_250.0),
    "scaled": Scaled(Scaled(QUARTIC, factor_x=150.0), factor_y=1 / 51),
    "scaled linear": Scaled(LinearLaw(10.0), factor_x=2.0, factor_y=3.0),
}
FITTED = {
    "log-strain": LogStrainLaw(12_250.0, 1.0),
    "tabulated": TabulatedLaw((0.0, 1.0, 2.0, 3.0, 3.9), (0.0, 378.0, 2665.0, 6999.0, 10_992.0)),
    "sum": Sum((QUARTIC, LogStrainLaw(10.0, 1.0))),
}
ALL = EXACT | FITTED


def packed(law):
    p = pack_law(law, END)
    return p, (p.coefficients, p.degree, p.pieces, p.width, p.end_slope)


def samples(p):
    end = p.width * p.pieces
    return np.concatenate([[0.0], np.random.default_rng(0).uniform(0.0, end, 200), [end]])


def largest_curvature(law, end):
    x = np.linspace(0.0, end, 4001)
    return np.abs(np.diff(law.slope(x))).max() / x[1]


@pytest.mark.parametrize("name", ALL)
def test_value_is_that_of_the_law(name):
    law, (p, call) = ALL[name], packed(ALL[name])
    x = samples(p)
    got = np.array([piecewise_value(*call, v) for v in x])
    # Exact but for rounding; or cubic Hermite pieces of a function with a bounded second derivative, within
    # width^2 / 8 of it (far less where the law is smoother).
    curvature = largest_curvature(law, x[-1])
    atol = 0.0 if name in EXACT else p.width**2 / 8 * curvature
    np.testing.assert_allclose(got, law.value(x), rtol=1e-12, atol=atol + 1e-13 * float(law.value(x[-1])))
    assert p.pieces == (1 if name in EXACT else TABLE_PIECES)


@pytest.mark.parametrize("name", ALL)
def test_beyond_the_end_it_is_straight(name):
    law, (p, call) = ALL[name], packed(ALL[name])
    end = p.width * p.pieces
    for x in (1.01 * end, 2.0 * end, 50.0 * end):
        expected = float(law.value(end)) + float(law.slope(end)) * (x - end)
        assert piecewise_value(*call, x) == pytest.approx(expected, rel=1e-12)
        assert piecewise_slope(*call, x) == p.end_slope == pytest.approx(float(law.slope(end)), rel=1e-12)
        if np.isfinite(law.valid_to):
            assert piecewise_value(*call, x) == pytest.approx(float(law.value(x)), rel=1e-12)


@pytest.mark.parametrize("name", ALL)
def test_slope_is_the_derivative_of_the_value(name):
    p, call = packed(ALL[name])
    step = 1e-4 * p.width if p.pieces > 1 else 1e-6 * p.width
    scale = piecewise_slope(*call, p.width * p.pieces)
    # The middle of each piece, so that no knot lies within the step. Rounding: 1e-16 * value / step.
    for k in range(0, p.pieces, 37):
        x = (k + 0.5) * p.width
        difference = (piecewise_value(*call, x + step) - piecewise_value(*call, x - step)) / (2 * step)
        rounding = 4e-16 * piecewise_value(*call, x) / step
        assert piecewise_slope(*call, x) == pytest.approx(difference, rel=1e-7, abs=rounding + 1e-8 * scale)


@pytest.mark.parametrize("name", ALL)
def test_integral_is_that_of_quadrature(name):
    p, call = packed(ALL[name])
    end = p.width * p.pieces
    for x in (0.0, 0.123 * end, 0.5 * end, 0.97 * end, end, 1.5 * end):
        # Quadrature of the law itself; the packed value differs from it by what test_value allows, so by
        # that over x.
        expected = sum(
            quad(ALL[name].value, a, b, points=None, epsabs=1e-10, epsrel=1e-12, limit=200)[0]
            for a, b in ((0.0, min(x, end)), (end, max(x, end)))
        )
        if np.isinf(ALL[name].valid_to) and x > end:  # the law curves on, the packed one does not
            at_end, slope = float(ALL[name].value(end)), p.end_slope
            expected = quad(ALL[name].value, 0.0, end, epsrel=1e-12)[0] + (x - end) * at_end
            expected += 0.5 * slope * (x - end) ** 2
        atol = 0.0 if name in EXACT else p.width**2 / 8 * largest_curvature(ALL[name], end) * x
        got = piecewise_integral(p.coefficients, p.integrals, *call[1:], x)
        assert got == pytest.approx(expected, rel=1e-9, abs=atol)


@pytest.mark.parametrize("name", FITTED)
def test_pieces_join(name):
    """Value and integral do not jump at a knot: one ulp to its left and right they differ by rounding
    only."""
    p, call = packed(FITTED[name])
    scale = piecewise_value(*call, p.width * p.pieces)
    for k in range(1, p.pieces + 1, 61):
        left, right = np.nextafter(k * p.width, 0.0), np.nextafter(k * p.width, np.inf)
        assert abs(piecewise_value(*call, right) - piecewise_value(*call, left)) < 1e-13 * scale
        integrals = [piecewise_integral(p.coefficients, p.integrals, *call[1:], x) for x in (left, right)]
        assert abs(integrals[1] - integrals[0]) < 1e-13 * scale * p.width * p.pieces


def test_horner_begins_with_the_highest_power():
    assert horner(np.array([9.0, 2.0, -1.0, 5.0]), 2, 1, 3.0) == 2.0 * 9 - 3.0 + 5.0
    assert polynomial((2.0, -1.0, 5.0), 3.0) == polynomial(np.array([2.0, -1.0, 5.0]), 3.0) == 20.0
