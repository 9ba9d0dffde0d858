"""Tabulated laws: a rising table fitted over all points of all specimens."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats, TabulatedLaw

FIRST_KNOT = 0.01
"""Share of the range within which the first knot lies, where there are points so near to the origin: dry friction
lets a shear test start with a step, which a first knot further off would smear over the first degrees."""

Design = Callable[[Floats, Callable[[Floats], Floats]], Floats]
"""From the points of a specimen and a basis to the linear map from coefficients to measured values."""


@dataclass(frozen=True, eq=False)
class TableFit:
    """A rising table.

    Attributes
    ----------
    x, y
        Points of the law, shape [k], both increasing; the origin is the first.
    specimens, points
        How many were used.
    rms
        Root mean square of the residuals of all points, of the law with its monotone cubic interpolation.
    r_squared
        1 - residual / total sum of squares.
    """

    x: Floats
    y: Floats
    specimens: int
    points: int
    rms: float
    r_squared: float

    @property
    def valid_to(self) -> float:
        return float(self.x[-1])

    def law(self) -> TabulatedLaw:
        """The table as a law of :mod:`weftform.fabric`."""
        return TabulatedLaw(tuple(map(float, self.x)), tuple(map(float, self.y)))


def fit_table(
    xs: Sequence[Floats], responses: Sequence[Floats], design: Design, valid_to: float, *, knots: int = 24
) -> TableFit:
    """Fit a continuous, piecewise straight, rising curve with so many knots, then drop the knots where it
    is level.

    The unknowns are the increments from knot to knot, none negative: non-negative least squares, with every
    specimen of the same weight. Knots are spread so that as many points lie between any two, but for the first,
    which lies near the origin (:data:`FIRST_KNOT`).

    Raises
    ------
    MeasurementError
        Too few points, or nothing that rises.
    """
    from scipy.optimize import nnls

    everything = np.concatenate(list(xs))
    points = len(everything)
    if points < 4 or knots < 2:
        raise MeasurementError("too few points for a table", expected="4 points and 2 knots at least", got=f"{points}")
    count = min(knots, points // 2)
    first = everything[everything >= FIRST_KNOT * valid_to].min(initial=valid_to)
    spread = np.quantile(everything, np.linspace(0.0, 1.0, count + 1)[1:-1])
    places = np.unique(np.concatenate([[first], spread[spread > first], [valid_to]]))
    places = np.concatenate([[0.0], places[(places > 1e-6 * valid_to) & (places <= valid_to)]])

    def increments(x: Floats) -> Floats:
        return np.asarray(np.clip((x[:, None] - places[:-1]) / np.diff(places), 0.0, 1.0))

    a = np.vstack([design(x, increments) / np.sqrt(len(x)) for x in xs])
    y = np.concatenate([r / np.sqrt(len(r)) for r in responses])
    size = np.linalg.norm(a, axis=0)
    size[size == 0.0] = 1.0
    steps, _ = nnls(a / size, y, maxiter=50 * len(places))
    steps = steps / size
    total = float(steps.sum())
    if total <= 0.0:
        raise MeasurementError("the curve does not rise, so no law fits it")
    values = np.append(0.0, np.cumsum(steps))
    rises = steps > 1e-6 * total
    # Of a level stretch only its end is kept, so that the table rises strictly; the end of the range always
    # stays.
    rises[-1] = True
    x_law, y_law = np.append(0.0, places[1:][rises]), np.append(0.0, values[1:][rises])
    if y_law[-1] <= y_law[-2]:
        x_law, y_law = np.delete(x_law, -2), np.delete(y_law, -2)
    law = TabulatedLaw(tuple(map(float, x_law)), tuple(map(float, y_law)))
    fitted = np.concatenate([design(x, lambda v: law.value(v)[:, None])[:, 0] for x in xs])
    measured = np.concatenate(list(responses))
    rest = measured - fitted
    spread = float(((measured - measured.mean()) ** 2).sum())
    return TableFit(
        x=x_law,
        y=y_law,
        specimens=len(xs),
        points=points,
        rms=float(np.sqrt(np.mean(rest**2))),
        r_squared=1.0 - float(rest @ rest) / spread if spread > 0.0 else 0.0,
    )
