"""The loading part of a force curve."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from weftform.result.loading import loading_curve


def test_a_press_at_rest_counts_by_its_last_row_and_the_way_back_not_at_all() -> None:
    way = np.array([0.0, 0.0, 0.0, 1.0, 0.9, 2.0, np.nan, 3.0, 3.0, 1.0])
    force = np.array([0.0, 5.0, 7.0, 10.0, 99.0, 20.0, 99.0, 30.0, 99.0, 99.0])
    found = loading_curve(way, force)
    np.testing.assert_array_equal(found, [[0.0, 1.0, 2.0, 3.0], [7.0, 10.0, 20.0, 30.0]])


def test_nothing_finite_is_no_curve() -> None:
    assert [len(v) for v in loading_curve(np.array([np.nan]), np.array([1.0]))] == [0, 0]


@given(st.lists(st.integers(-5, 5), min_size=1, max_size=30))
def test_every_new_largest_displacement_is_there_once(steps) -> None:
    way = np.cumsum(np.array(steps, float))
    kept, _ = loading_curve(way, np.zeros(len(way)))
    np.testing.assert_array_equal(kept, np.unique(np.maximum.accumulate(way)))


def test_a_curve_that_only_grows_stays_as_it_is() -> None:
    way = np.linspace(0.0, 3.0, 7)
    np.testing.assert_array_equal(loading_curve(way, way**2), [way, way**2])
