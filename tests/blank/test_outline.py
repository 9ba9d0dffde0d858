"""Outlines: sizes, symmetry, and cell lengths that meet them."""

from __future__ import annotations

import math

import pytest

from weftform.blank import disc, polygon, rectangle
from weftform.blank.outline import (
    bounds_along,
    diagonal_angle,
    fit_along_bias,
    fit_along_yarns,
    kept_part,
    symmetric,
)


def test_rectangle_and_disc_are_centred_on_the_press():
    assert rectangle(60, 40).bounds == (-30, -20, 30, 20)
    assert disc(50).bounds == pytest.approx((-25, -25, 25, 25))


def test_chords_of_a_disc_miss_its_area_by_little():
    """n chords cover (n / 2 pi) sin(2 pi / n) of the circle: 1 - (2 pi / n)^2 / 6 with n = 720."""
    assert disc(50).area == pytest.approx(math.pi * 25**2, rel=1.3e-5)


@pytest.mark.parametrize("plane", ["x", "y"])
def test_symmetry_of_outlines(plane):
    assert symmetric(rectangle(60, 40), plane)
    assert symmetric(disc(40), plane)
    assert not symmetric(polygon([(0, 0), (10, 0), (0, 5)]), plane)
    tall = polygon([(-1, 0), (1, 0), (0, 3)])
    assert symmetric(tall, "x") and not symmetric(tall, "y")


def test_kept_part_lies_on_the_positive_side():
    part = kept_part(rectangle(60, 40), ("x", "y"))
    assert part.bounds == (0, 0, 30, 20)
    assert kept_part(rectangle(60, 40), ("y",)).bounds == (-30, 0, 30, 20)
    assert kept_part(rectangle(60, 40), ()).area == 2400


@pytest.mark.parametrize(
    ("length", "target", "even", "count"),
    [(150, 2.69, False, 56), (150, 2.69, True, 56), (10, 3, True, 4), (10, 3, False, 3)],
)
def test_nearest_count_of_cells_divides_the_side(length, target, even, count):
    found, fitted = fit_along_yarns(length, target, even)
    assert found == count
    assert fitted * count == pytest.approx(length, rel=1e-15)


@pytest.mark.parametrize(
    ("width", "height", "target"), [(150, 150, 2.69), (60, 40, 3.6), (150, 50, 2.69), (100, 40, 2.0)]
)
@pytest.mark.parametrize("even", [True, False])
def test_both_sides_span_whole_cell_diagonals(width, height, target, even):
    length = fit_along_bias(width, height, target, even)
    step = 2 if even else 1
    for side in (width, height):
        diagonals = side / (math.sqrt(2) * length) / step
        assert diagonals == pytest.approx(round(diagonals), abs=1e-9)
    assert length == pytest.approx(target, rel=0.15)


def test_corner_angle_and_turned_bounds():
    assert diagonal_angle(rectangle(60, 60)) == pytest.approx(math.pi / 4)
    assert diagonal_angle(rectangle(60, 40)) == pytest.approx(math.atan2(20, 30))
    side = 60 / math.sqrt(2)
    assert bounds_along(rectangle(60, 60), math.pi / 4) == pytest.approx((-side, -side, side, side))
