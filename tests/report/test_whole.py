"""The whole part is the modelled part and its mirror images: same polygons, same area, no gap and no overlap."""

from __future__ import annotations

import math

import numpy as np
import pytest

from weftform.blank import build_grid, rectangle
from weftform.report.quantities import QUANTITIES
from weftform.report.whole import patches, whole_part

KINDS = [
    (0.0, ("x", "y")),
    (0.0, ("x",)),
    (0.0, ()),
    (math.pi / 4, ("x", "y")),
    (math.pi / 4, ("y",)),
    (-math.pi / 4, ("x", "y")),
]


def blank(angle, planes, cell_length=5.0):
    return build_grid(rectangle(60.0, 60.0), cell_length=cell_length, warp_angle=angle, planes=planes)


@pytest.mark.parametrize(("angle", "planes"), KINDS)
def test_polygons_are_copies_times_cells_and_cover_the_blank(angle, planes):
    grid = blank(angle, planes)
    part = whole_part(grid, grid.flat, grid.cell_share)
    assert len(part.corners) == grid.copies * grid.cell_count == len(part.values) == len(part.triangle)
    # Rounding of sums of a few hundred areas.
    assert part.areas.sum() == pytest.approx(grid.copies * grid.area, rel=1e-12)
    assert part.areas == pytest.approx(part.values * grid.cell_area, rel=1e-12)


@pytest.mark.parametrize(("angle", "planes"), KINDS)
def test_whole_part_is_its_own_mirror_image_without_overlap(angle, planes):
    grid = blank(angle, planes)
    part = whole_part(grid, grid.flat, grid.cell_share)
    own = np.where(part.triangle[:, None], part.corners[:, :3].mean(axis=1), part.corners.mean(axis=1))[:, :2]
    # To a micrometre; + 0.0 makes one zero of two.
    places = {tuple(np.round(c, 3) + 0.0) for c in own}
    assert len(places) == len(part.corners)
    for axis in ("x", "y"):
        if axis in planes:
            sign = np.where(np.array(["x", "y"]) == axis, -1.0, 1.0)
            assert {tuple(np.round(c * sign, 3) + 0.0) for c in own} == places


@pytest.mark.parametrize(("angle", "planes"), KINDS)
def test_all_polygons_show_the_same_side(angle, planes):
    grid = blank(angle, planes)
    part = whole_part(grid, grid.flat, grid.cell_share)
    assert part.normals[:, 2] == pytest.approx(1.0)


@pytest.mark.parametrize("angle", [0.0, math.pi / 4])
def test_half_cells_start_with_their_yarns(angle):
    grid = blank(angle, ("x", "y"))
    part = whole_part(grid, grid.flat, grid.cell_share)
    c, s = grid.axes
    for a, b in ((0, 1), (1, 2)):
        leg = (part.corners[:, b] - part.corners[:, a])[part.triangle]
        along = np.abs(np.stack([leg @ np.array([c, s, 0.0]), leg @ np.array([-s, c, 0.0])]))
        assert along.min(axis=0) == pytest.approx(0.0, abs=1e-9)
    assert part.triangle.any() == (angle != 0.0)


@pytest.mark.parametrize("angle", [0.0, math.pi / 4])
def test_coarse_drawing_keeps_area_and_mean(angle):
    grid = blank(angle, ("x", "y"), cell_length=1.0)
    values = np.arange(grid.cells.size, dtype=float).reshape(grid.cells.shape)
    fine = whole_part(grid, grid.flat, values)
    coarse = whole_part(grid, grid.flat, values, most=500)
    assert coarse.stride == math.ceil(math.sqrt(grid.cell_count * 4 / 500)) > 1
    assert len(coarse.corners) < 0.5 * len(fine.corners)
    assert coarse.areas.sum() == pytest.approx(fine.areas.sum(), rel=1e-12)
    assert (coarse.areas * coarse.values).sum() == pytest.approx((fine.areas * fine.values).sum(), rel=1e-12)
    assert str(coarse.stride) in coarse.note() and fine.note() == ""


def test_no_more_than_a_picture_can_show_by_default():
    grid = blank(0.0, (), cell_length=0.2)
    assert grid.cell_count > 80_000
    assert len(patches(grid).nodes) <= 40_000


def test_shear_angle_of_the_whole_part_is_a_size(along_yarns):
    fields = along_yarns.fields()
    part = QUANTITIES["shear"].on_whole_part(fields)
    assert part.values.min() >= 0.0
    assert part.values.max() == pytest.approx(fields.shear_statistics()["max_cell"])


def test_warp_beyond_a_plane_at_45_degrees_is_weft(along_bias):
    fields = along_bias.fields()
    here = fields.grid.cells > 0
    part = QUANTITIES["warp-force"].on_whole_part(fields)
    count = fields.grid.cell_count
    assert part.values[:count] == pytest.approx(fields.warp_force[here])
    # Copies in order: none, y, x, both.
    assert part.values[count : 2 * count] == pytest.approx(fields.weft_force[here])
    assert part.values[3 * count :] == pytest.approx(fields.warp_force[here])
