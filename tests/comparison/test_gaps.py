"""Gaps between outlines whose distance is known."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import circle, lopsided, moved, square

from weftform.comparison.gaps import PIECES, outline_gap
from weftform.comparison.outline import Ring


def gap_of(measured, simulated):
    return outline_gap(Ring(measured), Ring(simulated))


@pytest.mark.parametrize("radius", [54.0, 47.0])
def test_circle_against_circle(radius) -> None:
    """Along the normal the difference of the radii; along X it follows from where a line of one height meets both."""
    gap = gap_of(circle(radius), circle(50.0))
    chord = 54.0 * (1.0 - np.cos(np.pi / 720))  # a 720-gon lies so far inside its circle
    np.testing.assert_allclose(gap.normal, radius - 50.0, atol=2 * chord)
    assert gap.hausdorff == pytest.approx(abs(radius - 50.0), abs=2 * chord)
    y = gap.pieces.middles[:, 1]
    expected = np.sqrt(radius**2 - y**2) - np.sqrt(np.maximum(50.0**2 - y**2, 0.0))
    known = np.isfinite(gap.along_x)
    # the slope of a side of up to 45 degrees doubles a chord at most
    np.testing.assert_allclose(gap.along_x[known], expected[known], atol=4 * chord)
    # both circles face X up to 45 degrees: up to the height at which the smaller one stops doing so
    assert np.abs(y[known]).max() == pytest.approx(np.sqrt(0.5) * min(radius, 50.0), abs=2 * np.pi * 50 / 720)


def test_square_shifted() -> None:
    gap = gap_of(moved(square(50.0), shift=(1.5, -2.5)), square(50.0))
    x, y = gap.statistics(gap.along_x), gap.statistics(gap.along_y)
    assert x["max"] == pytest.approx(1.5, abs=1e-12) and x["mean"] == pytest.approx(1.5, abs=1e-12)
    # outside on the right, inside on the left; one piece of 2000 may be met on one side only
    assert y["max"] == pytest.approx(2.5, abs=1e-12) and abs(x["signed_mean"]) < 0.01
    assert gap.hausdorff == pytest.approx(np.hypot(1.5, 2.5), abs=1e-12)


def test_larger_square_is_outside_everywhere() -> None:
    gap = gap_of(square(52.0), square(50.0))
    assert (gap.normal > 0.0).all() and (gap_of(square(50.0), square(52.0)).normal < 0.0).all()
    # along a side the normal gap is 2; around the corner it grows to the diagonal
    assert gap.hausdorff == pytest.approx(2.0 * np.sqrt(2.0), abs=1e-12)
    assert gap.statistics(gap.along_x)["max"] == pytest.approx(2.0, abs=1e-12)


def test_hausdorff_is_that_of_shapely() -> None:
    one, other = lopsided(), moved(lopsided(90), 12.0, (3.0, -2.0))
    fine = 1.0 / 400
    expected = shapely.hausdorff_distance(shapely.LinearRing(one), shapely.LinearRing(other), densify=fine)
    # both look at points of the curves only; the distance changes by no more than the step between them
    step = max(shapely.LinearRing(p).length for p in (one, other)) / PIECES
    assert gap_of(one, other).hausdorff == pytest.approx(expected, abs=step)


def test_a_part_that_only_the_simulation_has_counts() -> None:
    """Every measured point lies on the simulated outline, yet the simulated tab is 20 mm from the measured one."""
    tab = shapely.box(-50, -50, 50, 50).union(shapely.box(-5, 50, 5, 70))
    gap = gap_of(square(50.0), np.array(tab.exterior.coords)[:-1])
    # from the middle of the tab's end 20 mm, and no measured point further than the 5 mm across its foot
    assert gap.hausdorff == pytest.approx(20.0, abs=1e-9) and np.abs(gap.normal).max() <= 5.0


@settings(max_examples=12, deadline=None)
@given(st.floats(-180, 180), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.integers(0, 159), st.booleans())
def test_gap_is_invariant_under_a_common_motion_and_the_order_of_points(degrees, x, y, first, back) -> None:
    one, other = 1.02 * lopsided(), lopsided(120)
    expected = gap_of(one, other)
    turned = np.roll(moved(one, degrees, (x, y)), first, axis=0)[:: -1 if back else 1]
    found = gap_of(turned, moved(other, degrees, (x, y)))
    # round-off of coordinates of 1e3 mm; a piece near an equal distance may take the other foot without a change
    assert found.hausdorff == pytest.approx(expected.hausdorff, abs=1e-9)
    for statistic in ("max", "mean", "signed_mean"):
        assert found.statistics(found.normal)[statistic] == pytest.approx(
            expected.statistics(expected.normal)[statistic], abs=1e-9
        )
