"""Noise of a curve without a law for it: of single points, and how much neighbours err alike."""

from __future__ import annotations

import numpy as np

from weftform.fabric.laws import Floats

MOST_CORRELATION = 0.99
"""Largest correlation of neighbouring errors that is believed; beyond it a curve would hold no information."""


def neighbour_misses(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """How far each inner point lies from the straight line between its neighbours.

    Parameters
    ----------
    x, y
        Increasing places and values, shape [n], n > 2.

    Returns
    -------
    miss, gain
        Line less point, and the standard deviation of that for points with independent errors of unit size; shape
        [n - 2].
    """
    before = (x[2:] - x[1:-1]) / (x[2:] - x[:-2])
    after = 1.0 - before
    return before * y[:-2] + after * y[2:] - y[1:-1], np.sqrt(before**2 + after**2 + 1.0)


def point_scatter(x: Floats, y: Floats) -> float:
    """Standard deviation of points about an unknown smooth curve, from each point and its two neighbours.

    A point misses the straight line between its neighbours by its own error and theirs; the curve itself adds only
    its curvature between neighbours. No law is fitted, so a law can be judged by it.

    Parameters
    ----------
    x, y
        Increasing places and values, shape [n], n > 2.

    References
    ----------
    Gasser, Sroka, Jennen-Steinmetz (1986), Residual variance and residual pattern in nonlinear regression, Biometrika
    73:625-633.
    """
    miss, gain = neighbour_misses(x, y)
    return float(np.sqrt(np.mean((miss / gain) ** 2)))


def neighbour_correlation(residuals: Floats) -> float:
    """Correlation of neighbouring residuals of a curve about zero, at most :data:`MOST_CORRELATION`; nought where it is
    negative."""
    squares = float(0.5 * (residuals[1:] @ residuals[1:] + residuals[:-1] @ residuals[:-1]))
    return min(max(float(residuals[1:] @ residuals[:-1]) / squares, 0.0), MOST_CORRELATION) if squares > 0.0 else 0.0


def student(level: float, freedom: float) -> float:
    """Quantile of Student's t for a two-sided interval of that level."""
    from scipy.stats import t

    return float(t.ppf(0.5 + 0.5 * level, freedom))
