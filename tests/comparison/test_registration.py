"""A measured outline finds its place on the simulated one from any turn."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import circle, lopsided, moved, square

from weftform.comparison.gaps import outline_gap
from weftform.comparison.outline import Ring
from weftform.comparison.registration import register_markers, register_outline


def laid_over(measured, simulated, **options):
    placement = register_outline(Ring(measured), Ring(simulated), **options)
    return placement, outline_gap(Ring(placement.apply(measured)), Ring(simulated))


# Vertices of a turned copy lie on the curve itself, so nothing but the iteration's last step (1e-14 of a size of 100 mm)
# and round-off of coordinates of up to 1000 mm (1e-13 mm) is left; 1e-9 mm leaves room for another machine's arithmetic.
ZERO = 1e-9


@pytest.mark.parametrize(("degrees", "shift"), [(0.0, (0, 0)), (137.0, (900.0, -400.0)), (-91.0, (3.0, 1.0))])
def test_own_copy_has_no_gap(degrees, shift) -> None:
    shape = lopsided()
    placement, gap = laid_over(moved(shape, degrees, shift), shape)
    assert gap.hausdorff < ZERO and np.abs(gap.normal).max() < ZERO
    assert placement.turn_deg == pytest.approx(-degrees, abs=1e-9) and placement.scale == 1.0


def test_neither_sense_nor_first_point_matter() -> None:
    shape = lopsided()
    copy = moved(shape, 40.0, (5.0, 6.0))
    for points in (copy[::-1], np.roll(copy, 31, axis=0)):
        assert laid_over(points, shape)[1].hausdorff < ZERO


@pytest.mark.parametrize("degrees", [20.0, 44.0, 70.0])
def test_square_takes_the_smallest_of_its_turns(degrees) -> None:
    placement, gap = laid_over(moved(square(50.0), degrees, (1.0, 2.0)), square(50.0))
    assert gap.hausdorff < ZERO
    assert placement.turn_deg == pytest.approx(-degrees if degrees < 45.0 else 90.0 - degrees, abs=1e-6)
    assert len(placement.as_good_deg) == 3


def test_nearly_square_is_told_apart() -> None:
    """A rectangle 1 % longer than wide: the quarter turns are worse, however little."""
    shape = square(50.0, 10)
    shape[shape[:, 0] == 50.0, 0] += 1.0
    placement, gap = laid_over(moved(shape, 65.0), shape)
    assert gap.hausdorff < ZERO and placement.turn_deg == pytest.approx(-65.0, abs=1e-6)
    assert placement.as_good_deg == pytest.approx((115.0,), abs=1e-6)


def test_circle_is_not_turned() -> None:
    placement, _ = laid_over(moved(circle(52.0, 90), 33.0, (4.0, -3.0)), circle(50.0, 90))
    assert not placement.turn_known and placement.turn_deg == 0.0
    assert placement.shift_mm[:2] == pytest.approx((-4.0, 3.0), abs=1e-6)


@pytest.mark.parametrize("scale", [0.1, 1.07])
def test_scale_is_found_when_asked_for(scale) -> None:
    shape = lopsided()
    placement, gap = laid_over(moved(shape, 25.0, (7.0, 0.0), scale), shape, scale=True)
    assert placement.scale == pytest.approx(1.0 / scale, rel=1e-9) and gap.hausdorff < ZERO


def test_a_corner_cut_off_does_not_pull_the_rest() -> None:
    """Least squares alone would shift the outline by about a mm; where it is whole it must lie on the simulated one."""
    shape = lopsided()
    cut = np.array(shapely.Polygon(shape).difference(shapely.box(40, 20, 100, 100)).exterior.coords)[:-1]
    placement, _ = laid_over(moved(cut, 50.0, (3.0, 3.0)), shape)
    assert placement.turn_deg == pytest.approx(-50.0, abs=0.01)
    left = placement.apply(moved(shape, 50.0, (3.0, 3.0))) - shape
    assert np.linalg.norm(left, axis=1).max() < 0.02


def test_scatter_averages_out() -> None:
    """The mean of n = 160 points with 0.2 mm is known to 0.2 / sqrt(160) = 0.016 mm; 5 of those are allowed."""
    shape = lopsided()
    noisy = moved(shape + np.random.default_rng(5).normal(0.0, 0.2, shape.shape), 10.0)
    placement, _ = laid_over(noisy, shape)
    left = placement.apply(moved(shape, 10.0)).mean(axis=0) - shape.mean(axis=0)
    assert np.linalg.norm(left) < 5 * 0.016


@settings(max_examples=3, deadline=None)
@given(st.floats(-180, 180), st.floats(-300, 300), st.floats(-300, 300))
def test_gap_does_not_depend_on_how_the_measurement_lies(degrees, x, y) -> None:
    simulated = lopsided()
    measured = 1.03 * simulated * (1.0, 0.98)
    expected = laid_over(measured, simulated)[1]
    found = laid_over(moved(measured, degrees, (x, y)), simulated)[1]
    # two descents end within the root of the optimiser's 1e-14 of each other: 1e-7 of 70 mm
    assert found.hausdorff == pytest.approx(expected.hausdorff, abs=1e-5)
    assert found.pieces.mean(np.abs(found.normal)) == pytest.approx(
        expected.pieces.mean(np.abs(expected.normal)), abs=1e-5
    )


def test_many_points_are_thinned_and_found_all_the_same() -> None:
    """Thinned within 1e-4 of the size of 70 mm, so that the gap stays below it."""
    shape = lopsided(6_000)
    assert laid_over(moved(shape, 77.0, (4.0, 4.0)), shape)[1].hausdorff < 0.007


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_markers_by_least_squares(scale) -> None:
    places = np.random.default_rng(2).uniform(-50, 50, (12, 3))
    measured = np.column_stack([moved(places[:, :2], 123.0, (8.0, 9.0), scale), scale * places[:, 2] + 4.0])
    placement = register_markers(measured, places, scale=scale != 1.0)
    np.testing.assert_allclose(placement.apply(measured), places, atol=ZERO)
    assert placement.rms_mm < ZERO and placement.scale == pytest.approx(1.0 / scale)
