"""Noise of a curve without a law for it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from weftform.laboratory.scatter import MOST_CORRELATION, neighbour_correlation, point_scatter


def test_scatter_of_points_is_their_noise() -> None:
    """Known noise on a curve, unevenly sampled: the estimate has a standard error of about 1 / sqrt(n)."""
    rng = np.random.default_rng(1)
    x = np.sort(rng.uniform(0.0, 1.0, 4000))
    assert point_scatter(x, np.exp(2.0 * x) + 0.01 * rng.standard_normal(x.size)) == pytest.approx(0.01, rel=0.06)
    assert point_scatter(x, 3.0 * x + 1.0) < 1e-12


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_neighbours_of_an_autoregressive_curve_are_correlated_by_its_share(share) -> None:
    noise = lfilter([1.0], [1.0, -share], np.random.default_rng(2).standard_normal(20000))
    # standard error sqrt((1 - share^2) / n), at most 0.007
    assert neighbour_correlation(noise) == pytest.approx(share, abs=0.025)


def test_correlation_of_neighbours_stays_between_nought_and_its_limit() -> None:
    assert neighbour_correlation(np.ones(50)) == MOST_CORRELATION
    assert neighbour_correlation(np.array([1.0, -1.0, 1.0, -1.0])) == 0.0
    assert neighbour_correlation(np.zeros(5)) == 0.0 and neighbour_correlation(np.ones(1)) == 0.0
