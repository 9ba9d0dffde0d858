"""The yarn grid covers outlines: areas, lines, planes of symmetry, edges, and what it refuses."""

from __future__ import annotations

import math
import time
import tracemalloc

import numpy as np
import pytest

from weftform.blank import Cell, build_grid, disc, polygon, rectangle
from weftform.errors import StudyError

QUARTER = ("x", "y")
PARTS = {"full": (), "half-x": ("x",), "half-y": ("y",), "quarter": QUARTER}
each_part = pytest.mark.parametrize("planes", PARTS.values(), ids=PARTS)

DIAMOND = polygon([(50.0, 0.0), (0.0, 50.0), (-50.0, 0.0), (0.0, -50.0)])
L_SHAPE = polygon([(-40, -40), (40, -40), (40, 0), (0, 0), (0, 40), (-40, 40)])


def grid_of(outline, length=5.0, degrees=0.0, planes=(), **more):
    return build_grid(outline, cell_length=length, warp_angle=math.radians(degrees), planes=planes, **more)


# -- areas -----------------------------------------------------------------------------------------


@each_part
@pytest.mark.parametrize("degrees", [0, 90, 180, -90])
def test_rectangle_along_the_yarns_is_met_exactly_by_whole_cells(planes, degrees):
    """Rounding only: a sum of at most 1e4 equal areas."""
    grid = grid_of(rectangle(60, 40), 4.7, degrees, planes)
    assert not grid.has_half_cells
    assert grid.area * grid.copies == pytest.approx(60 * 40, rel=1e-12)
    assert grid.requested_area == pytest.approx(60 * 40 / grid.copies, rel=1e-12)
    assert grid.warp_pitch == pytest.approx(4.7, rel=0.5 * 2 * 4.7 / 40)


@each_part
@pytest.mark.parametrize("degrees", [45, -45, 135, -135])
@pytest.mark.parametrize("length", [3.6, 4.5])
def test_rectangle_along_the_bias_is_met_exactly_by_whole_and_half_cells(planes, degrees, length):
    """60 and 40 mm are 12 and 8 diagonals of 5 mm. At 4.5 mm, 9 and 6 fit the full blank: no crossing lies at its
    centre."""
    if planes and length == 4.5:
        length = 3.55
    grid = grid_of(rectangle(60, 40), length, degrees, planes)
    assert grid.has_half_cells
    assert grid.along_bias
    assert grid.area * grid.copies == pytest.approx(60 * 40, rel=1e-12)
    assert grid.warp_pitch == grid.weft_pitch == pytest.approx(length, rel=0.15)


@pytest.mark.parametrize("outline", [rectangle(150, 150), rectangle(60, 40)])
@pytest.mark.parametrize("degrees", [0, 45])
def test_whole_cells_count_one_and_half_cells_one_half(outline, degrees):
    grid = grid_of(outline, 3.0, degrees)
    whole, half = int((grid.cells == Cell.WHOLE).sum()), int((grid.cells > Cell.WHOLE).sum())
    assert grid.cell_count == whole + half
    assert (whole + 0.5 * half) * grid.warp_pitch * grid.weft_pitch == pytest.approx(outline.area, rel=1e-12)


@pytest.mark.parametrize(
    ("outline", "degrees"),
    [(disc(80), 0), (disc(80), 45), (disc(80), 20), (rectangle(80, 60), 20), (L_SHAPE, 33), (DIAMOND, 10)],
)
def test_any_other_outline_and_angle_misses_little_area_and_less_with_smaller_cells(outline, degrees):
    """A staircase with half cells misses, per cell that the edge crosses, at most a quarter of the cell, with a sign
    that varies: the error is below that of the crossed cells all on one side, which is perimeter x length / (4
    area)."""
    for length in (4.0, 2.0, 1.0):
        grid = grid_of(outline, length, degrees)
        bound = 0.25 * outline.length * length / outline.area
        assert grid.requested_area == pytest.approx(outline.area, rel=1e-12)
        assert abs(grid.area / grid.requested_area - 1.0) < bound
    assert abs(grid.area / outline.area - 1.0) < 0.01


def test_unfitted_cells_keep_their_length():
    grid = grid_of(rectangle(61, 43), 4.0, fitted=False)
    assert grid.warp_pitch == grid.weft_pitch == 4.0
    assert grid.area != pytest.approx(61 * 43, rel=1e-6)
    assert grid.area == pytest.approx(61 * 43, rel=0.25 * 2 * (61 + 43) * 4 / (61 * 43))


def test_diamond_at_0_degrees_is_met_by_half_cells_on_its_four_sides():
    """Its sides run at 45 degrees to the yarns through the crossings."""
    grid = grid_of(DIAMOND, 5.0)
    assert grid.area == pytest.approx(5000.0, rel=1e-12)
    assert {int(k) for k in np.unique(grid.cells)} == {0, 1, 2, 3, 4, 5}
    lacks = {Cell.LACKS_00: (-1, -1), Cell.LACKS_10: (1, -1), Cell.LACKS_11: (1, 1), Cell.LACKS_01: (-1, 1)}
    centres = grid.flat[:-1, :-1, :2] + 2.5
    for kind, side in lacks.items():
        assert (np.sign(centres[grid.cells == kind]) == side).all()


# -- position and angle ----------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [0, 90, 45, -45, 20, -135])
def test_warp_runs_at_the_angle_and_weft_a_quarter_turn_ahead(degrees):
    grid = grid_of(rectangle(60, 60), 5.0, degrees)
    warp, weft = grid.flat[0, 1] - grid.flat[0, 0], grid.flat[1, 0] - grid.flat[0, 0]
    a = math.radians(degrees)
    np.testing.assert_allclose(warp / grid.warp_pitch, [math.cos(a), math.sin(a), 0], atol=1e-12)
    np.testing.assert_allclose(weft / grid.weft_pitch, [-math.sin(a), math.cos(a), 0], atol=1e-12)
    np.testing.assert_allclose(grid.plan(grid.material), grid.flat[..., :2], atol=1e-12)
    np.testing.assert_allclose(grid.material_at(grid.flat[..., :2]), grid.material, atol=1e-12)


@pytest.mark.parametrize(("degrees", "length"), [(0, 5.0), (45, 3.6), (90, 7.0)])
def test_crossings_of_a_rectangle_reach_its_corners(degrees, length):
    grid = grid_of(rectangle(60, 40), length, degrees)
    plan = grid.flat[grid.active][:, :2]
    np.testing.assert_allclose([plan.min(0), plan.max(0)], [[-30, -20], [30, 20]], atol=1e-9)


@pytest.mark.parametrize(("degrees", "length"), [(0, 5.0), (45, 3.6)])
def test_the_quarter_is_the_full_blank_cut(degrees, length):
    """Cells, areas and line weights of four quarters make up the full blank with the same cell length."""
    part = grid_of(rectangle(60, 40), length, degrees, QUARTER)
    full = grid_of(rectangle(60, 40), part.warp_pitch, degrees)
    assert full.warp_pitch == pytest.approx(part.warp_pitch, rel=1e-12)
    for name in ("warp_lines", "weft_lines", "node_area"):
        total = getattr(part, name).sum() * 4
        if degrees == 45 and name != "node_area":
            # mirrored at 45 degrees, a warp line is a weft line
            total = (part.warp_lines.sum() + part.weft_lines.sum()) * 2
        assert total == pytest.approx(getattr(full, name).sum(), rel=1e-12)


def test_planes_at_45_degrees_run_along_cell_diagonals():
    """No line lies on a plane, and every cell whose centre is on a plane is a half cell."""
    grid = grid_of(rectangle(60, 60), 3.6, 45, QUARTER)
    assert set(np.unique(grid.warp_lines)) <= {0.0, 1.0}
    centres = grid.plan(grid.material[:-1, :-1] + 0.5 * np.array([grid.warp_pitch, grid.weft_pitch]))
    on_plane = (np.abs(centres) < 1e-9).any(axis=-1) & (grid.cells != Cell.ABSENT)
    assert on_plane.any()
    assert (grid.cells[on_plane] > Cell.WHOLE).all()
    assert grid.on_plane.any(axis=(0, 1)).all()
    assert (grid.flat[grid.active][:, :2] > -1e-9).all()


# -- connectors and crossings ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("planes", "warp", "weft"), [((), 9, 13), (("y",), 4.5, 13), (("x",), 9, 6.5), (QUARTER, 4.5, 6.5)]
)
def test_n_plus_one_lines_cross_a_section_and_those_on_planes_count_half(planes, warp, weft):
    """Eq. 11: 40 mm at 5 mm are 8 cells and 9 lines along x; 60 mm are 12 cells and 13 lines along y."""
    grid = grid_of(rectangle(60, 40), 5.0, 0, planes)
    np.testing.assert_allclose(grid.warp_lines.sum(axis=0), warp)
    np.testing.assert_allclose(grid.weft_lines.sum(axis=1), weft)
    assert grid.warp_lines.max() == grid.weft_lines.max() == 1.0


def test_half_cells_have_two_legs_and_no_line_along_their_long_side():
    grid = grid_of(DIAMOND, 5.0)
    edges = {}
    for j, i in np.argwhere(grid.cells != Cell.ABSENT):
        kind = grid.cells[j, i]
        corner = {Cell.LACKS_00: (0, 0), Cell.LACKS_10: (0, 1), Cell.LACKS_11: (1, 1), Cell.LACKS_01: (1, 0)}.get(kind)
        for dj in (0, 1):
            if corner is None or corner[0] != dj:
                edges[("warp", j + dj, i)] = 1
        for di in (0, 1):
            if corner is None or corner[1] != di:
                edges[("weft", j, i + di)] = 1
    assert grid.warp_lines.sum() == sum(k[0] == "warp" for k in edges)
    assert grid.weft_lines.sum() == sum(k[0] == "weft" for k in edges)
    assert all((grid.warp_lines if k[0] == "warp" else grid.weft_lines)[k[1:]] == 1.0 for k in edges)


@each_part
@pytest.mark.parametrize("degrees", [0, 45])
def test_areas_of_the_crossings_sum_to_the_area(planes, degrees):
    grid = grid_of(rectangle(60, 40), 3.6, degrees, planes)
    assert grid.node_area.sum() == pytest.approx(grid.area, rel=1e-12)
    assert (grid.node_area >= 0).all()
    # a crossing inside the blank has the area of a cell
    assert grid.node_area.max() == pytest.approx(grid.cell_area, rel=1e-12)


def test_polygons_of_the_cells_have_their_areas_and_turn_counterclockwise():
    grid = grid_of(disc(40), 4.0, 30)
    indices, offsets, places = grid.quads
    points = grid.flat.reshape(-1, 3)[:, :2]
    for k, (j, i) in enumerate(places):
        ring = points[indices[offsets[k] : offsets[k + 1]]]
        x, y = ring.T
        area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
        assert area == pytest.approx(grid.cell_share[j, i] * grid.cell_area, rel=1e-9)


# -- the edge --------------------------------------------------------------------------------------


def signed_area(points):
    x, y = points[:, 0], points[:, 1]
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


@pytest.mark.parametrize(
    ("outline", "degrees"), [(rectangle(60, 40), 0), (rectangle(60, 40), 45), (disc(50), 20), (L_SHAPE, 0)]
)
def test_edge_of_a_full_blank_is_one_closed_loop_around_its_area(outline, degrees):
    grid = grid_of(outline, 3.6, degrees)
    (loop,) = grid.edge_loops
    assert loop[0] == loop[-1]
    assert len(set(loop[:-1].tolist())) == len(loop) - 1
    points = grid.flat.reshape(-1, 3)[loop]
    assert signed_area(points[:-1]) == pytest.approx(grid.area, rel=1e-9)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert steps.max() <= math.sqrt(2) * max(grid.warp_pitch, grid.weft_pitch) * (1 + 1e-12)


@pytest.mark.parametrize("degrees", [0, 45])
@pytest.mark.parametrize(("planes", "length"), [(QUARTER, 50.0), (("x",), 100.0), (("y",), 100.0)])
def test_edge_of_a_part_goes_from_plane_to_plane_in_order(planes, length, degrees):
    """Half the sides of the quarter, 30 + 20 mm; of a half 60 + 40 mm. The planes themselves are no edge."""
    grid = grid_of(rectangle(60, 40), 3.6, degrees, planes)
    (loop,) = grid.edge_loops
    points = grid.flat.reshape(-1, 3)[loop]
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(length, rel=1e-9)
    assert grid.on_plane.reshape(-1, 2)[loop[[0, -1]]].any(axis=1).all()
    assert not grid.on_plane.reshape(-1, 2)[loop[1:-1]].any()


def test_fold_mirrors_points_into_the_part_and_says_where():
    grid = grid_of(rectangle(60, 40), 5.0, 0, QUARTER)
    points = np.array([[3.0, 4.0], [-3.0, 4.0], [-3.0, -4.0], [3.0, -4.0]])
    folded, mirrored = grid.fold(points)
    np.testing.assert_allclose(folded, np.tile([3.0, 4.0], (4, 1)), atol=1e-12)
    np.testing.assert_array_equal(mirrored, [[False, False], [True, False], [True, True], [False, True]])


def test_fold_at_45_degrees_exchanges_warp_and_weft():
    """Mirroring y at 45 degrees takes the point U along warp to the point U along weft."""
    grid = grid_of(rectangle(60, 60), 3.6, 45, QUARTER)
    folded, mirrored = grid.fold(np.array([1.0, -5.0]))
    # (1, -5) lies at x = 6/sqrt 2, y = -4/sqrt 2
    np.testing.assert_allclose(folded, [5.0, -1.0], atol=1e-12)
    np.testing.assert_array_equal(mirrored, [False, True])


def test_fold_of_a_full_blank_changes_nothing():
    grid = grid_of(rectangle(60, 40), 5.0)
    folded, mirrored = grid.fold(np.array([[-3.0, -4.0]]))
    np.testing.assert_array_equal(folded, [[-3.0, -4.0]])
    assert not mirrored.any()


# -- refusals --------------------------------------------------------------------------------------


def test_unsymmetric_outline_is_refused_with_the_plane():
    with pytest.raises(StudyError, match="not symmetric in the plane y = 0") as caught:
        grid_of(polygon([(-10, -5), (10, -5), (10, 6), (-10, 6)]), 1.0, 0, QUARTER)
    assert caught.value.key == "blank.symmetry"
    assert "full" in caught.value.hint


@pytest.mark.parametrize("degrees", [20, 44.9, -30])
def test_planes_at_other_angles_are_refused(degrees):
    with pytest.raises(StudyError, match="45 degrees to them") as caught:
        grid_of(rectangle(40, 40), 2.0, degrees, ("x",))
    assert caught.value.got == f"{degrees:g} degrees"


@pytest.mark.parametrize("length", [41.0, 100.0, 1e6])
@pytest.mark.parametrize("degrees", [0, 45, 20])
@pytest.mark.parametrize("fitted", [True, False])
def test_cell_longer_than_the_blank_gives_no_cell(length, degrees, fitted):
    with pytest.raises(StudyError, match="holds no cell") as caught:
        grid_of(rectangle(60, 40), length, degrees, fitted=fitted)
    assert caught.value.key == "blank.cell_length_mm"


@pytest.mark.parametrize("length", [1e-9, 0.001, 0.0301, 0.0334])
@pytest.mark.parametrize("degrees", [0, 45, 20])
def test_over_20_million_cells_are_refused_at_once_and_in_no_memory(length, degrees):
    """0.0334 mm gives 20.2 million cells of 150 x 150 mm. Laying them out would take gigabytes and minutes."""
    tracemalloc.start()
    start = time.perf_counter()
    try:
        with pytest.raises(StudyError, match="cells") as caught:
            grid_of(rectangle(150, 150), length, degrees)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
    assert time.perf_counter() - start < 1.0
    assert "20,000,000" in caught.value.expected
