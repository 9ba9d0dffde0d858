"""One cell, a strip and a patch: the forces of the time loop against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_problems import (
    FABRIC,
    SMOOTH,
    affine,
    all_nodes,
    bias_grid,
    driven,
    edge_nodes,
    first_forces,
    free,
    held_at,
    put,
    rotation,
    whole_grid,
)

from weftform.blank import build_grid, rectangle
from weftform.fabric import Fabric
from weftform.fabric.total_form import total_form
from weftform.solver import Motion

LENGTH = 2.69
GRIDS = {"whole": whole_grid(), "half": bias_grid()}
each_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
NO_MEMBRANE = Fabric.load(
    "hexforce-48600-c1300", override={"membrane": {"warp_modulus_MPa": 0.0, "weft_modulus_MPa": 0.0}}
)
WITHOUT_YARNS = Fabric.load(
    "hexforce-48600-c1300", override={"tension": {"warp": {"coefficients": [1e-12, 0.0, 0.0, 0.0]}}}
)


def one_cell(length=LENGTH):
    return whole_grid(1, 1, length)


def trellis(gamma):
    """Deformation gradient of a trellis that closes by ``gamma`` about the diagonal, without stretch."""
    c, s = math.cos(gamma / 2), math.sin(gamma / 2)
    return np.array([[c, s], [s, c]])


def nodal_forces(grid, gradient, fabric=FABRIC):
    """Forces that hold whole cells under a homogeneous gradient of the yarn axes, by the total form and Eq. 11.

    Membrane: the first Piola-Kirchhoff stress of the Cauchy stress, per flat area, with constant thickness; each cell
    gives its corners P N with the mean gradients of the shape functions. Connectors: axial forces of the laws.
    """
    card = fabric.card.membrane
    state = total_form(gradient, card.warp_modulus_MPa, card.weft_modulus_MPa, fabric.shear)
    piola = fabric.thickness * np.linalg.det(gradient) * state.stress @ np.linalg.inv(gradient).T
    a, b = grid.warp_pitch, grid.weft_pitch
    forces = np.zeros((*grid.shape, 3))
    for (di, dj), (du, dv) in {(0, 0): (-1, -1), (1, 0): (1, -1), (1, 1): (1, 1), (0, 1): (-1, 1)}.items():
        share = piola @ np.array([0.5 * du * b, 0.5 * dv * a])
        forces[dj : dj + grid.cells.shape[0], di : di + grid.cells.shape[1], :2] += share
    for axis, law, spacing, lines in ((0, fabric.warp, b, grid.warp_lines), (1, fabric.weft, a, grid.weft_lines)):
        vector = gradient[:, axis]
        stretch = np.linalg.norm(vector)
        pull = float(law.line_law(spacing).value(max(stretch - 1.0, 0.0))) * vector / stretch
        each = lines[..., None] * pull
        if axis == 0:
            forces[:, 1:, :2] += each
            forces[:, :-1, :2] -= each
        else:
            forces[1:, :, :2] += each
            forces[:-1, :, :2] -= each
    return forces


@pytest.mark.parametrize(("degrees", "expected"), [(20, 0.027722), (40, 0.288261)])
def test_square_cell_pulled_on_its_diagonal(degrees, expected):
    """Closed form G. The work of all corner forces per shear angle equals that of the pull on the diagonal,
    d = 2 l0 cos(45 deg - gamma / 2). The expected numbers have six digits."""
    gamma = math.radians(degrees)
    grid = one_cell()
    _, forces = held_at(grid, affine(grid, trellis(gamma)))
    c, s = math.cos(gamma / 2), math.sin(gamma / 2)
    rate = 0.5 * np.array([[-s, c], [c, -s]])
    work = float(np.sum(forces[:, :2] * (grid.flat.reshape(-1, 3)[:, :2] @ rate.T)))
    longer = LENGTH * math.sin(math.pi / 4 - gamma / 2)
    assert work / longer == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    "gradient",
    [
        [[1.01, 0.0], [0.0, 1.02]],
        [[1.0, 0.6], [0.0, 1.0]],
        [[0.97, 0.3], [-0.2, 1.015]],
        [[0.7, -0.7], [0.7, 0.7]],
        [[0.95, 0.1], [0.05, 0.93]],
    ],
)
def test_forces_of_a_cell_are_those_of_the_total_form_and_eq_11(gradient):
    """The shear law is packed to 1e-8 of its scale, the logarithm to 1e-10; 1e-7 of the force leaves an order to
    both."""
    gradient = np.asarray(gradient)
    grid = one_cell()
    _, forces = held_at(grid, affine(grid, gradient))
    expected = nodal_forces(grid, gradient).reshape(-1, 3)
    np.testing.assert_allclose(forces, expected, atol=1e-7 * np.abs(expected).max() + 1e-9)


def test_forces_of_a_rectangular_cell_use_the_spacing_of_each_direction():
    grid = build_grid(rectangle(3.0, 8.0), cell_length=2.9, warp_angle=0.0)
    assert (grid.warp_pitch, grid.weft_pitch) == pytest.approx((3.0, 8.0 / 3.0))
    gradient = np.array([[1.01, 0.2], [0.1, 1.004]])
    _, forces = held_at(grid, affine(grid, gradient))
    expected = nodal_forces(grid, gradient).reshape(-1, 3)
    np.testing.assert_allclose(forces, expected, atol=1e-7 * np.abs(expected).max())


def test_power_of_the_corner_forces_is_that_of_the_stress():
    """sigma : D per current volume. The packed shear law is off by up to 1e-8 of its largest tau / tan(gamma / 2), 18
    MPa at 90 degrees, which is 3e-6 of the stress here."""
    start = np.array([[1.005, 0.35], [0.1, 1.01]])
    rate = np.array([[0.4, -0.7], [0.3, 0.2]])
    card = FABRIC.card.membrane
    grid = one_cell()
    _, forces = held_at(grid, affine(grid, start), WITHOUT_YARNS)
    power = float(np.sum(forces[:, :2] * (grid.flat.reshape(-1, 3)[:, :2] @ rate.T)))
    velocity_gradient = rate @ np.linalg.inv(start)
    stress = total_form(start, card.warp_modulus_MPa, card.weft_modulus_MPa, FABRIC.shear).stress
    volume = FABRIC.thickness * grid.area * np.linalg.det(start)
    assert power == pytest.approx(volume * float(np.sum(stress * velocity_gradient)), rel=3e-6)


@pytest.mark.parametrize("length", [50.0, 25.0, 25.0 / 1.2])
@pytest.mark.parametrize(("elongation", "force"), [(1.0, 374.5), (2.0, 2661.2), (3.0, 6995.4), (3.9, 10989.0)])
def test_strip_150_by_50_carries_the_specimen_force_for_any_cell_length(length, elongation, force):
    """Repaired Eq. 4. The membrane is left out: it would add e E ln(1 + u/X) per width, 3 N of 10 989.

    The closed form includes a0 = -3.446 N, which the card drops, and has one decimal. At 25 / 1.2 mm the cells become
    rectangular, 21.4 by 25 mm: Eq. 11 holds for them too.
    """
    grid = build_grid(rectangle(150.0, 50.0), cell_length=length, warp_angle=0.0)
    assert grid.area == pytest.approx(7500.0)
    stretch = np.array([[1.0 + elongation / 150.0, 0.0], [0.0, 1.0]])
    _, forces = held_at(grid, affine(grid, stretch), NO_MEMBRANE)
    end = forces.reshape(*grid.shape, 3)[:, -1]
    assert end[:, 0].sum() == pytest.approx(float(FABRIC.warp.force(elongation)), rel=1e-9)
    assert end[:, 0].sum() - 3.446 == pytest.approx(force, abs=0.051)
    assert np.abs(end[:, 1:]).max() < 1e-9


def test_force_goes_on_straight_beyond_the_validity():
    """The quartic turns over at 4.54 mm; the line from 3.9 mm does not."""
    grid = build_grid(rectangle(150.0, 50.0), cell_length=25.0, warp_angle=0.0)
    ends = []
    for u in (3.9, 4.9, 5.9):
        _, forces = held_at(grid, affine(grid, [[1 + u / 150, 0], [0, 1]]), NO_MEMBRANE)
        ends.append(forces.reshape(*grid.shape, 3)[:, -1, 0].sum())
    slope = float(FABRIC.warp.specimen_force.slope(3.9))
    assert np.diff(ends) == pytest.approx([slope, slope], rel=1e-9)


def test_yarns_are_slack_in_compression():
    """Shortened by 2 % the strip pushes with the membrane only, e E ln l per width, and connectors not at all."""
    grid = whole_grid(5, 4)
    for fabric, expected in ((FABRIC, 0.62 * 3.9 * math.log(0.98) * 4 * 2.7), (NO_MEMBRANE, 0.0)):
        _, forces = held_at(grid, affine(grid, [[0.98, 0], [0, 1]]), fabric)
        assert forces.reshape(*grid.shape, 3)[:, -1, 0].sum() == pytest.approx(expected, rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("slack", [False, True])
@pytest.mark.parametrize("other", [(2, 3), (3, 2)], ids=["warp", "weft"])
def test_crossings_in_the_same_place_pull_nothing_on_each_other(other, slack):
    """A connector without length has no direction; its force is none, not a quotient of zeros."""
    patch = free(whole_grid(), FABRIC if slack else SMOOTH)
    positions = patch.positions
    positions[2, 2] = positions[other]
    put(patch, positions)
    patch._advance(3, 1.0)
    assert np.isfinite(patch.positions).all()
    assert np.isfinite(patch.velocities).all()


def test_slack_ratio_gives_yarns_a_share_of_their_initial_stiffness():
    card = {"tension": {"warp": {"slack_ratio": 0.01}}, "membrane": {"warp_modulus_MPa": 0.0, "weft_modulus_MPa": 0.0}}
    fabric = Fabric.load("hexforce-48600-c1300", override=card)
    grid = build_grid(rectangle(150.0, 50.0), cell_length=25.0, warp_angle=0.0)
    _, forces = held_at(grid, affine(grid, [[1 - 1.5 / 150, 0], [0, 1]]), fabric)
    assert forces.reshape(*grid.shape, 3)[:, -1, 0].sum() == pytest.approx(-0.01 * 19.75 * 1.5, rel=1e-9)


@pytest.mark.parametrize("direction", [0, 2], ids=["in the plane", "out of the plane"])
def test_hourglass_mode_of_a_slack_cell_has_stiffness(direction):
    """With all yarns slack nothing but the control resists: corner forces k V (upper edge - lower edge), k = h E /
    area.

    In the plane the mode leaves the mean yarn vectors as they are; out of the plane too.
    """
    size = 1e-3
    grid = one_cell()
    mode = np.zeros((2, 2, 3))
    mode[..., direction] = size * np.array([[1.0, -1.0], [-1.0, 1.0]])
    short = affine(grid, [[0.97, 0], [0, 0.97]])
    forces = {}
    for hourglass in (0.0, 0.02):
        _, still = held_at(grid, short, hourglass=hourglass)
        _, bent = held_at(grid, short + mode, hourglass=hourglass)
        forces[hourglass] = (bent - still).reshape(2, 2, 3)
    np.testing.assert_allclose(forces[0.0], 0.0, atol=1e-10)
    stiffness = 0.02 * 3.9 / grid.cell_area * 0.62 * grid.cell_area
    np.testing.assert_allclose(forces[0.02], 4.0 * stiffness * mode, atol=1e-10)


# -- patches ---------------------------------------------------------------------------------------


GRADIENTS = {
    "biaxial": np.array([[1.01, 0.0], [0.0, 1.004]]),
    "shear and stretch": np.array([[1.006, 0.25], [0.15, 1.008]]),
    "compression and shear": np.array([[0.98, -0.2], [0.0, 0.99]]),
}


@each_grid
@pytest.mark.parametrize("gradient", GRADIENTS.values(), ids=GRADIENTS)
def test_affine_positions_are_in_equilibrium_inside_the_patch(grid, gradient):
    """Constant stress: forces cancel at every crossing off the edge, to rounding against those on it."""
    _, forces = held_at(grid, affine(grid, gradient))
    nodes = all_nodes(grid)
    inside = ~np.isin(nodes, edge_nodes(grid))
    assert inside.sum() >= 4
    assert np.abs(forces[inside]).max() < 1e-10 * np.abs(forces).max()
    assert np.abs(forces).max() > 0.01


@each_grid
def test_affine_edge_makes_the_inside_affine(grid):
    """The edge is stretched and sheared and held; damping brings the inside to rest where the affine map has it.

    The slowest mode decays with half the damping rate (it is under-damped): exp(-0.5 x 4000 x 0.02) = 4e-18 of a few
    tenths of a millimetre, so what is left is rounding.
    """
    gradient = trellis(math.radians(25.0)) @ np.diag([1.003, 1.005])
    nodes = edge_nodes(grid)
    wanted = affine(grid, gradient)
    motion = Motion((0.0, 0.1), (0.0, 1.0))
    simulation = driven(grid, nodes, wanted.reshape(1, -1, 3)[:, nodes], [motion], damping=4000.0)
    simulation.advance_to(0.12)
    moved = simulation.positions - grid.flat
    assert np.abs(wanted[grid.active]).max() > 1.0
    np.testing.assert_allclose(moved[grid.active], wanted[grid.active], atol=1e-9)


@each_grid
def test_rigid_turn_and_shift_produce_no_force(grid):
    """Stiffness 60 N/mm times the rounding of 10 mm is 1e-13 N; the sum over a crossing stays below 1e-11."""
    simulation = free(grid)
    turn = rotation([1.0, -2.0, 0.5], 130.0)
    put(simulation, grid.flat @ turn.T + np.array([30.0, -20.0, 7.0]))
    assert np.abs(first_forces(simulation)[grid.active]).max() < 1e-11


@each_grid
def test_turned_state_has_turned_forces(grid):
    """Objectivity: forces of a deformed patch, turned out of its plane, are the turned forces."""
    rng = np.random.default_rng(3)
    shape = grid.flat + 0.05 * rng.normal(size=grid.flat.shape)
    turn = rotation([1.0, 1.0, 0.3], 75.0)
    here, there = free(grid), free(grid)
    put(here, shape)
    put(there, shape @ turn.T)
    forces, turned = first_forces(here)[grid.active], first_forces(there)[grid.active]
    assert np.abs(forces).max() > 0.1
    np.testing.assert_allclose(turned, forces @ turn.T, atol=1e-11 * np.abs(forces).max())


@each_grid
def test_forces_of_a_free_patch_have_no_resultant_and_no_moment(grid):
    rng = np.random.default_rng(4)
    shape = grid.flat + 0.05 * rng.normal(size=grid.flat.shape)
    simulation = free(grid)
    put(simulation, shape)
    forces = first_forces(simulation)[grid.active]
    # positions have moved by one step since the forces were taken
    size = np.abs(forces).sum()
    assert np.abs(forces.sum(axis=0)).max() < 1e-13 * size
    assert np.abs(np.cross(shape[grid.active], forces).sum(axis=0)).max() < 1e-13 * size * 10.0
