"""The edge of the whole blank, mirrored from its part, and the draw-in of known deformations."""

from __future__ import annotations

import math

import numpy as np
import pytest

from weftform.blank import build_grid, disc, rectangle
from weftform.result.outline import draw_in, formed_outline

PLANES = {"full": (), "half-x": ("x",), "half-y": ("y",), "quarter": ("x", "y")}


def shaped(grid):
    """A deformation with the symmetry of both planes."""
    x, y = grid.flat[..., 0], grid.flat[..., 1]
    return np.stack([0.9 * x - 1e-4 * x * y * y, 0.8 * y, 5.0 - 0.001 * (x * x + y * y)], axis=-1)


def area(points):
    x, y = points[:-1, 0], points[:-1, 1]
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))


@pytest.mark.parametrize("planes", PLANES.values(), ids=PLANES)
@pytest.mark.parametrize("degrees", [0, 45])
def test_outline_is_closed_in_order_and_mirrored(planes, degrees):
    """One loop around the whole blank with its area and perimeter, every formed point the image of its flat one."""
    grid = build_grid(rectangle(60, 40), cell_length=3.6, warp_angle=math.radians(degrees), planes=planes)
    flat, formed, modelled = formed_outline(grid, shaped(grid))
    np.testing.assert_array_equal(flat[0], flat[-1])
    np.testing.assert_array_equal(formed[0], formed[-1])
    assert area(flat) == pytest.approx(2400.0, rel=1e-9)
    assert np.linalg.norm(np.diff(flat, axis=0), axis=1).sum() == pytest.approx(200.0, rel=1e-9)
    assert len(np.unique(np.round(flat, 6), axis=0)) == len(flat) - 1
    x, y = flat.T
    expected = np.stack([0.9 * x - 1e-4 * x * y * y, 0.8 * y, 5.0 - 0.001 * (x * x + y * y)], axis=-1)
    np.testing.assert_allclose(formed, expected, atol=1e-9)
    for axis, plane in enumerate(("x", "y")):
        if plane in planes:
            assert (flat[modelled][:, axis] > -1e-9).all()
    assert modelled.all() == (planes == ())


@pytest.mark.parametrize("planes", PLANES.values(), ids=PLANES)
@pytest.mark.parametrize("degrees", [0, 45])
def test_draw_in_of_an_affine_deformation(planes, degrees):
    """x scaled by 0.9 and y by 0.8: 3 mm at the mid edge x = 30, 4 mm at y = 20; the corner (30, 20) moves by (3,
    4)."""
    grid = build_grid(rectangle(60, 40), cell_length=3.6, warp_angle=math.radians(degrees), planes=planes)
    positions = grid.flat * np.array([0.9, 0.8, 1.0]) + np.array([0.0, 0.0, 3.0])
    flat, formed, _ = formed_outline(grid, positions)
    corner = math.atan2(20, 30)
    found = draw_in(flat, formed, corner)
    assert found["edge_x"] == pytest.approx(3.0, rel=1e-9)
    assert found["edge_y"] == pytest.approx(4.0, rel=1e-9)
    assert found["corner"] == pytest.approx(3.0 * math.cos(corner) + 4.0 * math.sin(corner), rel=1e-9)


def test_draw_in_of_a_disc():
    """A staircase edge scaled by 0.9 moves in by a tenth of its distance, at most a cell off the radius."""
    grid = build_grid(disc(60), cell_length=2.0, warp_angle=math.radians(20))
    flat, formed, _ = formed_outline(grid, 0.9 * grid.flat)
    for value in draw_in(flat, formed, math.pi / 4).values():
        assert value == pytest.approx(3.0, abs=0.1 * 2.0)


def test_blank_that_did_not_move_was_not_drawn_in():
    grid = build_grid(rectangle(60, 40), cell_length=5.0, warp_angle=0.0, planes=("x", "y"))
    flat, formed, _ = formed_outline(grid, np.array(grid.flat))
    assert draw_in(flat, formed, 0.5) == pytest.approx({"edge_x": 0.0, "edge_y": 0.0, "corner": 0.0}, abs=1e-12)
