"""Laws: a number in, a number out, with its derivative and its range of validity.

A law knows nothing of yarns or cells. It is a function on ``x >= 0`` that starts at zero; beyond
``valid_to`` it goes on in a straight line (a polynomial fitted to a test says nothing there, and may turn
over). Laws compose: :class:`Scaled`, :class:`Sum`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from weftform.errors import CardError

Floats = NDArray[np.float64]


class Law(Protocol):
    """A function on ``x >= 0`` with ``value(0) = 0``, straight beyond ``valid_to``."""

    @property
    def valid_to(self) -> float: ...

    def value(self, x: Floats | float) -> Floats:
        """Value at ``x`` (array of any shape)."""
        ...

    def slope(self, x: Floats | float) -> Floats:
        """Derivative at ``x`` (array of any shape)."""
        ...


def _straight_beyond(
    x: Floats | float, valid_to: float, inner: Floats, at_end: Floats | float, end_slope: Floats | float
) -> Floats:
    x = np.asarray(x, dtype=float)
    return np.where(x > valid_to, at_end + end_slope * (x - valid_to), inner)


@dataclass(frozen=True)
class PolynomialLaw:
    """``sum_k c_k x^k`` for ``k = 1, 2, ...``; ``constant`` is added and is zero unless asked for."""

    coefficients: tuple[float, ...]
    valid_to: float
    constant: float = 0.0

    @cached_property
    def _polynomials(self) -> tuple[np.polynomial.Polynomial, np.polynomial.Polynomial]:
        """The polynomial and its derivative."""
        polynomial = np.polynomial.Polynomial([self.constant, *self.coefficients])
        return polynomial, polynomial.deriv()

    def value(self, x: Floats | float) -> Floats:
        p, d = self._polynomials
        inner = p(np.minimum(x, self.valid_to))
        return _straight_beyond(x, self.valid_to, inner, p(self.valid_to), d(self.valid_to))

    def slope(self, x: Floats | float) -> Floats:
        return np.asarray(self._polynomials[1](np.minimum(x, self.valid_to)))


@dataclass(frozen=True)
class LinearLaw:
    """``stiffness * x``, for ever."""

    stiffness: float
    valid_to: float = np.inf

    def value(self, x: Floats | float) -> Floats:
        return self.stiffness * np.asarray(x, dtype=float)

    def slope(self, x: Floats | float) -> Floats:
        return np.full(np.shape(x), self.stiffness)


@dataclass(frozen=True)
class LogStrainLaw:
    """``stiffness * length * ln(1 + x / length)``: linear in the specimen's logarithmic strain."""

    stiffness: float
    length: float
    valid_to: float = np.inf

    def value(self, x: Floats | float) -> Floats:
        return self.stiffness * self.length * np.log1p(np.asarray(x, dtype=float) / self.length)

    def slope(self, x: Floats | float) -> Floats:
        return np.asarray(self.stiffness / (1.0 + np.asarray(x, dtype=float) / self.length))


@dataclass(frozen=True)
class TabulatedLaw:
    """Monotone cubic interpolation (Fritsch and Carlson 1980, PCHIP) through points, from the origin."""

    x: tuple[float, ...]
    y: tuple[float, ...]
    _pchip: object = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        from scipy.interpolate import PchipInterpolator

        xs, ys = np.asarray(self.x, float), np.asarray(self.y, float)
        if len(xs) != len(ys) or len(xs) < 2:
            raise CardError(
                "a tabulated law needs two lists of the same length, two points at least",
                got=f"{len(xs)} and {len(ys)} numbers",
            )
        if not (np.diff(xs) > 0).all():
            k = int(np.argmin(np.diff(xs) > 0))
            raise CardError(
                "the abscissae of a tabulated law must increase", got=f"{xs[k]:g} followed by {xs[k + 1]:g}"
            )
        if xs[0] > 0.0:
            xs, ys = np.concatenate([[0.0], xs]), np.concatenate([[0.0], ys])
        if xs[0] < 0.0 or ys[0] != 0.0:
            raise CardError(
                "a tabulated law must start at the origin",
                expected="0 -> 0",
                got=f"{xs[0]:g} -> {ys[0]:g}",
                hint="give no point at x = 0 and the origin is added, or give (0, 0)",
            )
        object.__setattr__(self, "_pchip", PchipInterpolator(xs, ys))

    @property
    def valid_to(self) -> float:
        return float(self.x[-1])

    def value(self, x: Floats | float) -> Floats:
        pchip = self._pchip
        inner = pchip(np.minimum(x, self.valid_to))  # type: ignore[operator]
        return _straight_beyond(x, self.valid_to, inner, pchip(self.valid_to), self._end_slope())  # type: ignore[operator]

    def _end_slope(self) -> Floats:
        return np.asarray(self._pchip(self.valid_to, 1))  # type: ignore[operator]

    def slope(self, x: Floats | float) -> Floats:
        return np.asarray(self._pchip(np.minimum(x, self.valid_to), 1))  # type: ignore[operator]


@dataclass(frozen=True)
class Scaled:
    """``factor_y * law(factor_x * x)``: the same curve in other units or for another specimen."""

    law: Law
    factor_x: float = 1.0
    factor_y: float = 1.0

    @property
    def valid_to(self) -> float:
        return self.law.valid_to / self.factor_x

    def value(self, x: Floats | float) -> Floats:
        return np.asarray(self.factor_y * self.law.value(np.asarray(x, float) * self.factor_x))

    def slope(self, x: Floats | float) -> Floats:
        return np.asarray(self.factor_y * self.factor_x * self.law.slope(np.asarray(x, float) * self.factor_x))


@dataclass(frozen=True)
class Sum:
    """Several laws in parallel; straight where each of them is."""

    laws: tuple[Law, ...]

    @property
    def valid_to(self) -> float:
        return max((law.valid_to for law in self.laws if not _is_straight(law)), default=np.inf)

    def value(self, x: Floats | float) -> Floats:
        return np.asarray(np.sum([law.value(x) for law in self.laws], axis=0))

    def slope(self, x: Floats | float) -> Floats:
        return np.asarray(np.sum([law.slope(x) for law in self.laws], axis=0))


def _is_straight(law: Law) -> bool:
    while isinstance(law, Scaled):
        law = law.law
    return isinstance(law, LinearLaw) or (isinstance(law, Sum) and all(map(_is_straight, law.laws)))


@dataclass(frozen=True)
class Monotony:
    """Where a law falls: ``start`` to ``end`` of the first interval, and the slope at its worst point."""

    start: float
    end: float
    steepest_fall: float


ROUNDING = 1e-12
"""Share of the steepest slope below which a fall is rounding: a rising table may end level."""


def first_fall(law: Law, upper: float, samples: int = 4001) -> Monotony | None:
    """First interval of ``(0, upper]`` where the law falls, or None if it rises throughout."""
    x = np.linspace(0.0, upper, samples)[1:]
    slope = law.slope(x)
    falling = slope < -ROUNDING * float(np.abs(slope).max())
    if not falling.any():
        return None
    first = int(np.argmax(falling))
    rest = np.flatnonzero(~falling[first:])
    last = first + int(rest[0]) if rest.size else x.size - 1
    return Monotony(float(x[first]), float(x[last]), float(slope[first : last + 1].min()))
