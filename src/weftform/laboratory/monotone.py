"""Polynomials that rise: the basis of powers and least squares under a slope that is nowhere negative."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats

LEAST_SLOPE = 1.0e-6
"""Smallest slope of a monotone fit, relative to its mean slope; keeps rounding from turning 0 into a fall."""


def power_basis(x: Floats, powers: Sequence[int], kind: Literal["value", "slope"] = "value") -> Floats:
    """``x^k``, or its derivative, for each ``k`` of ``powers``; shape [len(x), len(powers)]."""
    k = np.asarray(powers, float)
    if kind == "value":
        return np.asarray(x[:, None] ** k)
    return np.asarray(k * x[:, None] ** np.maximum(k - 1.0, 0.0))


def rising_coefficients(a: Floats, y: Floats, free: Floats, powers: Sequence[int]) -> Floats:
    """Least-squares coefficients (x scaled to 0..1) whose polynomial rises; ``free`` itself where it does.

    Slope constraints are put where the slope is smallest, solved, and put again until it falls nowhere.
    """
    places = np.linspace(0.0, 1.0, 65)
    end = float(np.abs(power_basis(np.array([1.0]), powers) @ free)[0])
    least = LEAST_SLOPE * max(end, 1e-300)
    best = free
    for _ in range(30):
        worst = _lowest_slopes(best, powers)
        slopes = power_basis(worst, powers, "slope") @ best
        if (slopes >= 0.5 * least).all():
            return best
        places = np.unique(np.concatenate([places, worst]))
        best = _bounded(a, y, power_basis(places, powers, "slope"), np.full(len(places), least))
    raise MeasurementError(
        "no rising polynomial of this degree follows the points",
        hint="use another degree, a shorter interval, or a tabulated law",
    )


def _lowest_slopes(coefficients: Floats, powers: Sequence[int]) -> Floats:
    """Ends of 0..1 and the places between where the slope has a minimum or maximum."""
    dense = np.zeros(max(powers) + 1)
    dense[list(powers)] = coefficients
    roots = np.polynomial.Polynomial(dense).deriv(2).roots() if max(powers) > 2 else np.empty(0)
    inside = np.real(roots[np.abs(np.imag(roots)) < 1e-9])
    return np.concatenate([[0.0, 1.0], inside[(inside > 0.0) & (inside < 1.0)]])


def _bounded(a: Floats, y: Floats, g: Floats, h: Floats) -> Floats:
    """Minimise ``|a c - y|`` subject to ``g c >= h`` by non-negative least squares.

    Reference: Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23.
    """
    from scipy.optimize import nnls

    q, r = np.linalg.qr(a)
    inverse = np.linalg.inv(r)
    middle = q.T @ y
    sides = g @ inverse
    room = h - sides @ middle
    norm = np.maximum(np.linalg.norm(sides, axis=1), 1e-300)
    sides, room = sides / norm[:, None], room / norm
    size = float(np.abs(room).max()) or 1.0
    u, _ = nnls(np.vstack([sides.T, room[None, :] / size]), np.append(np.zeros(len(middle)), 1.0), maxiter=3000)
    rest = np.append(sides.T @ u, room @ u / size - 1.0)
    if abs(rest[-1]) < 1e-14:
        raise MeasurementError(
            "no rising polynomial of this degree exists", hint="use another degree, or a tabulated law"
        )
    z = -rest[:-1] / rest[-1] * size
    return np.asarray(inverse @ (z + middle))
