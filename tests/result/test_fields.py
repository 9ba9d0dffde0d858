"""Fields of known deformations: angles, strains, forces and stresses by cell and by crossing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from weftform.blank import build_grid, rectangle
from weftform.fabric import Fabric
from weftform.fabric.total_form import total_form
from weftform.result.fields import Fields

FABRIC = Fabric.load("hexforce-48600-c1300")
GRIDS = {
    "0": build_grid(rectangle(60, 40), cell_length=5.0, warp_angle=0.0),
    "90": build_grid(rectangle(60, 40), cell_length=5.0, warp_angle=math.pi / 2),
    "45": build_grid(rectangle(60, 40), cell_length=3.6, warp_angle=math.pi / 4),
    "20": build_grid(rectangle(60, 40), cell_length=4.0, warp_angle=math.radians(20)),
}
each_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
GRADIENT = np.array([[1.01, 0.3], [0.1, 1.015]])
"""In the axes of the yarns."""


def deformed(grid, gradient=GRADIENT):
    """Positions of an affine deformation given in yarn axes, turned back into the axes of the press."""
    c, s = grid.axes
    axes = np.array([[c, -s], [s, c]])
    plane = grid.material @ gradient.T @ axes.T
    return np.concatenate([plane, np.zeros((*grid.shape, 1))], axis=-1)


def expected_shear(gradient=GRADIENT):
    warp, weft = gradient.T
    return math.pi / 2 - math.acos(warp @ weft / np.linalg.norm(warp) / np.linalg.norm(weft))


@each_grid
def test_affine_deformation_has_its_shear_angle_everywhere(grid):
    fields = Fields(grid, FABRIC, deformed(grid))
    here = grid.cells > 0
    np.testing.assert_allclose(fields.shear_angle[here], expected_shear(), rtol=1e-12)
    assert np.isnan(fields.shear_angle[~here]).all()
    corners = fields.corner_shear
    np.testing.assert_allclose(corners[np.isfinite(corners)], expected_shear(), rtol=1e-11)
    np.testing.assert_allclose(fields.node_shear[grid.active], expected_shear(), rtol=1e-11)
    assert np.isfinite(fields.node_shear).sum() == grid.active.sum()
    assert fields.largest_shear() == pytest.approx(math.degrees(expected_shear()), rel=1e-11)


@each_grid
def test_affine_deformation_has_its_strains_and_tensions(grid):
    """Nominal strains of the columns of the gradient; tension per width from Eq. 11 with the pitch of the lines."""
    fields = Fields(grid, FABRIC, deformed(grid))
    here = grid.cells > 0
    for values, column in ((fields.warp_strain, 0), (fields.weft_strain, 1)):
        np.testing.assert_allclose(values[here], np.linalg.norm(GRADIENT[:, column]) - 1.0, rtol=1e-9)
    for values, column, law, spacing in (
        (fields.warp_force, 0, FABRIC.warp, grid.weft_pitch),
        (fields.weft_force, 1, FABRIC.weft, grid.warp_pitch),
    ):
        strain = np.linalg.norm(GRADIENT[:, column]) - 1.0
        lines = 50.0 / spacing + 1.0
        np.testing.assert_allclose(values[here], float(law.force(150.0 * strain)) / lines / spacing, rtol=1e-9)


@each_grid
def test_membrane_stress_is_that_of_the_total_form_in_the_axes_of_the_press(grid):
    fields = Fields(grid, FABRIC, deformed(grid))
    c, s = grid.axes
    axes = np.array([[c, -s], [s, c]])
    card = FABRIC.card.membrane
    stress = axes @ total_form(GRADIENT, card.warp_modulus_MPa, card.weft_modulus_MPa, FABRIC.shear).stress @ axes.T
    expected = [stress[0, 0], stress[1, 1], stress[0, 1]]
    found = fields.membrane_stress[grid.cells > 0]
    np.testing.assert_allclose(found, np.tile(expected, (len(found), 1)), rtol=1e-9, atol=1e-12)


@each_grid
def test_stress_of_a_tilted_cell_has_the_same_invariants(grid):
    """The plane of the cell is turned by 50 degrees about x: trace and determinant of the stress stay."""
    tilt = math.radians(50)
    turn = np.array([[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)], [0, math.sin(tilt), math.cos(tilt)]])
    flat = Fields(grid, FABRIC, deformed(grid)).membrane_stress[grid.cells > 0]
    bent = Fields(grid, FABRIC, deformed(grid) @ turn.T).membrane_stress[grid.cells > 0]
    for pick in (lambda s: s[:, 0] + s[:, 1], lambda s: s[:, 0] * s[:, 1] - s[:, 2] ** 2):
        np.testing.assert_allclose(pick(bent), pick(flat), rtol=1e-9)
    # a turn about x leaves the stress along x
    np.testing.assert_allclose(bent, flat, rtol=1e-9, atol=1e-12)


@each_grid
def test_directions_are_unit_vectors_along_the_yarns(grid):
    warp, weft = Fields(grid, FABRIC, deformed(grid)).directions
    c, s = grid.axes
    axes = np.array([[c, -s], [s, c]])
    for found, column in ((warp, 0), (weft, 1)):
        wanted = axes @ GRADIENT[:, column] / np.linalg.norm(GRADIENT[:, column])
        np.testing.assert_allclose(found[grid.cells > 0][:, :2], np.tile(wanted, (grid.cell_count, 1)), atol=1e-12)


def test_shortened_yarns_carry_nothing():
    grid = GRIDS["0"]
    fields = Fields(grid, FABRIC, deformed(grid, np.diag([0.98, 1.0])))
    assert (fields.warp_force == 0.0).all()
    np.testing.assert_allclose(fields.warp_strain, -0.02, rtol=1e-9)


def test_opening_angle_is_negative():
    grid = GRIDS["0"]
    fields = Fields(grid, FABRIC, deformed(grid, np.array([[1.0, -0.2], [0.0, 1.0]])))
    np.testing.assert_allclose(fields.shear_angle, -math.atan(0.2), rtol=1e-12)
    assert fields.largest_shear() == pytest.approx(math.degrees(math.atan(0.2)))


def test_statistics_weigh_cells_by_area():
    """Half cells count half. Left half sheared by 0.3, right by 0.1: the mean is over areas, p99 and the largest are
    on the left."""
    grid = GRIDS["45"]
    fields = Fields(grid, FABRIC, deformed(grid))
    angles = fields.shear_angle
    statistics = fields.shear_statistics()
    one = math.degrees(expected_shear())
    assert statistics == pytest.approx({"max": one, "max_cell": one, "p99": one, "mean": one}, rel=1e-9)
    angles[...] = np.where(np.isfinite(angles), np.where(grid.cells > 1, 0.4, 0.2), np.nan)
    share = grid.cell_share
    expected = (share[grid.cells > 1].sum() * 0.4 + share[grid.cells == 1].sum() * 0.2) / share.sum()
    assert fields.shear_statistics()["mean"] == pytest.approx(math.degrees(expected), rel=1e-12)
    assert fields.shear_statistics()["max_cell"] == pytest.approx(math.degrees(0.4))


def test_corner_angles_are_those_between_the_connectors_that_meet():
    """One crossing of a flat patch moved: only the four angles at it and those of its neighbours' connectors change."""
    grid = GRIDS["0"]
    positions = np.array(grid.flat)
    positions[3, 4, 0] += 1.0
    corners = Fields(grid, FABRIC, positions).corner_shear
    a = math.atan(1.0 / 5.0)
    # at the crossing the warp stays along x, the weft from below leans by a and that from above by -a
    assert corners[2, 2, 3] == pytest.approx(a)
    assert corners[3, 2, 4] == pytest.approx(a)
    assert corners[0, 3, 4] == pytest.approx(-a)
    assert corners[1, 3, 3] == pytest.approx(-a)
    assert np.abs(corners).max() == pytest.approx(a)
    assert (np.abs(corners) > 1e-12).sum() == 8


def test_cell_data_has_the_names_and_sizes_of_the_result_files():
    grid = GRIDS["45"]
    found = Fields(grid, FABRIC, deformed(grid)).cell_data()
    for name in ("ShearAngle_deg", "WarpStrain", "WeftStrain", "WarpForce_N_per_mm", "WeftForce_N_per_mm"):
        assert found[name].shape == (grid.cell_count,)
    for name in ("WarpDirection", "WeftDirection", "MembraneStress_MPa"):
        assert found[name].shape == (grid.cell_count, 3)
    assert all(np.isfinite(values).all() for values in found.values())
    np.testing.assert_allclose(found["WarpStress_MPa"], found["WarpForce_N_per_mm"] / 0.62)
