"""Patches between tools: forces of contact and friction, penetration, and results that do not depend on the bands."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_problems import (
    FABRIC,
    STILL,
    THICKNESS,
    ball,
    bias_grid,
    first_forces,
    plate,
    pressed,
    put,
    smooth_velocities,
    whole_grid,
)

from weftform.solver import Motion, Problem, Settings, Simulation

FORCE = 40.0
LIGHT = 0.02
SETTLED = 0.03
WHOLE = whole_grid(10, 8)


def settled(friction, grid=WHOLE, force=FORCE, damping=0.0):
    """A pressed patch at rest: the force grows softly in 10 ms and the bounce of the plate is damped."""
    simulation = pressed(grid, friction, force, damping=damping)
    simulation.advance_to(SETTLED)
    return simulation


@pytest.fixture(scope="module")
def slippery():
    return settled(0.0)


# -- normal force ----------------------------------------------------------------------------------


def test_pushed_plate_carries_exactly_its_force(slippery):
    """Upwards from the pushed plate, downwards from the fixed one; the bounce is damped by half of critical, with a
    period of 2 pi x 20 steps: e^-40 after 20 ms."""
    assert slippery.tool_reaction(1) == pytest.approx(FORCE, rel=1e-6)
    assert slippery.tool_reaction(0) == pytest.approx(-FORCE, rel=1e-6)
    assert slippery.tool_reaction(2) == 0.0


def test_quarter_model_carries_a_quarter_of_the_force():
    grid = whole_grid(18, 16, planes=("x", "y"))
    simulation = pressed(grid, 0.0, FORCE)
    simulation.advance_to(SETTLED)
    assert simulation.tool_reaction(0) == pytest.approx(-FORCE / 4, rel=1e-6)


def test_penetration_is_that_of_the_penalty_and_is_reported(slippery):
    """force / (30 N/mm3 x area) on both faces; the plate has moved in by both."""
    expected = FORCE / (30.0 * WHOLE.area)
    assert slippery.penetration == pytest.approx(expected, rel=1e-6)
    assert slippery.tool_position(1) == pytest.approx(2 * expected, rel=1e-6)


def test_forces_on_the_crossings_cancel_between_the_faces(slippery):
    assert np.abs(slippery.contact_forces).max() < 1e-6 * FORCE


def test_without_friction_nothing_is_tangential(slippery):
    """A pressed patch that moves along the plates keeps its momentum to rounding."""
    saved = slippery.checkpoint()
    there = pressed(WHOLE, 0.0, FORCE)
    there.restore(saved)
    there.velocities = np.broadcast_to([30.0, 10.0, 0.0], (*WHOLE.shape, 3)).copy()
    there.advance_to(SETTLED + 0.002)
    p = (there.masses[..., None] * there.velocities).sum(axis=(0, 1))
    np.testing.assert_allclose(p[:2], there.masses.sum() * np.array([30.0, 10.0]), rtol=1e-11)
    assert there.ledger().friction == 0.0


# -- friction --------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.2, 0.4])
def test_sliding_patch_is_slowed_by_mu_n_on_both_faces(friction):
    """dp/dt = -2 mu N once the tangential springs are at their limit, after mu x penetration / ratio = 1e-6 mm of
    sliding. The patch weighs 0.35 mg per newton and mm/s2, so a small force slows it for thousands of steps."""
    simulation = settled(friction, force=LIGHT)
    simulation.velocities = np.broadcast_to([100.0, 0.0, 0.0], (*WHOLE.shape, 3)).copy()
    simulation.advance_to(SETTLED + 0.0002)
    p0, t0 = (simulation.masses * simulation.velocities[..., 0]).sum(), simulation.time
    before = simulation.ledger()
    x0 = simulation.positions[..., 0].mean()
    simulation.advance_to(SETTLED + 0.0010)
    p1, t1 = (simulation.masses * simulation.velocities[..., 0]).sum(), simulation.time
    after = simulation.ledger()
    assert simulation.velocities[..., 0].min() > 20.0
    assert (p0 - p1) / (t1 - t0) == pytest.approx(2 * friction * LIGHT, rel=1e-3)
    way = simulation.positions[..., 0].mean() - x0
    assert after.friction - before.friction == pytest.approx(2 * friction * LIGHT * way, rel=5e-3)


def test_sliding_force_points_against_the_sliding():
    simulation = settled(0.2, force=LIGHT)
    direction = np.array([0.6, -0.8, 0.0])
    simulation.velocities = np.broadcast_to(100.0 * direction, (*WHOLE.shape, 3)).copy()
    simulation.advance_to(SETTLED + 0.0004)
    total = simulation.contact_forces.sum(axis=(0, 1))
    np.testing.assert_allclose(total[:2], -2 * 0.2 * LIGHT * direction[:2], rtol=1e-3)


def test_below_the_limit_the_patch_sticks_and_no_heat_is_made():
    """A push too weak for the springs' limit: the patch swings about its place. 5 mm/s against k_t = 0.5 x 30 N/mm3
    on two faces and 6e-10 t/mm2 swings by v sqrt(m / 2 k_t) = 2e-5 mm, some crossings by a few times that as the
    fabric between them springs; the limit is at 0.2 x penetration / 0.5 = 9e-4 mm."""
    simulation = settled(0.2)
    start = simulation.positions
    heat = simulation.ledger().friction
    simulation.velocities = np.broadcast_to([5.0, 0.0, 0.0], (*WHOLE.shape, 3)).copy()
    furthest = 0.0
    for _ in range(40):
        simulation.advance_to(simulation.time + 2.5e-5)
        furthest = max(furthest, np.abs(simulation.positions - start)[..., 0].max())
    assert 1e-5 < furthest < 2e-4
    assert simulation.ledger().friction == heat


def test_friction_comes_to_rest_and_stays():
    """A sliding patch stops after v^2 m / (4 mu N) and does not creep. What swings on the springs is below their
    limit, 2e-6 mm."""
    simulation = settled(0.4, force=LIGHT)
    start = simulation.positions[..., 0].mean()
    simulation.velocities = np.broadcast_to([50.0, 0.0, 0.0], (*WHOLE.shape, 3)).copy()
    simulation.advance_to(SETTLED + 0.01)
    place = simulation.positions[..., 0].mean()
    expected = 50.0**2 * simulation.masses.sum() / (4 * 0.4 * LIGHT)
    assert place - start == pytest.approx(expected, rel=0.02)
    simulation.advance_to(SETTLED + 0.03)
    assert simulation.positions[..., 0].mean() == pytest.approx(place, abs=1e-5)


# -- curved tools ----------------------------------------------------------------------------------


@pytest.mark.parametrize("up", [1.0, -1.0], ids=["below", "above"])
def test_hemisphere_pushes_away_from_its_centre(up):
    """Each crossing pressed into the ball is pushed along the radius with stiffness x area x penetration."""
    grid = whole_grid(10, 8)
    tools = (ball(up, friction=0.0), plate("far", -1.0, away=500.0), plate("farther", 1.0, away=500.0))
    simulation = Simulation(Problem(grid, FABRIC, tools, (STILL, STILL), stroke=0, holding=1, settings=Settings()))
    centre = np.array([0.0, 0.0, -up * (25.0 + THICKNESS / 2)])
    radius = np.linalg.norm(grid.flat - centre, axis=-1, keepdims=True)
    depth = np.linspace(0.001, 0.02, grid.flat[..., 0].size).reshape(*grid.shape, 1)
    here = centre + (grid.flat - centre) / radius * (25.0 + THICKNESS / 2 - depth)
    put(simulation, here)
    simulation.last = simulation._survey()
    expected = (
        30.0
        * grid.node_area[..., None]
        * depth
        * (here - centre)
        / np.linalg.norm(here - centre, axis=-1, keepdims=True)
    )
    np.testing.assert_allclose(simulation.contact_forces, expected, atol=1e-9)
    assert simulation.penetration == pytest.approx(0.02, rel=1e-9)
    # the time loop does the same as the look at it
    with_ball = first_forces(simulation)
    tools = tuple(plate(n, u, away=500.0) for n, u in (("a", 1.0), ("b", -1.0), ("c", 1.0)))
    tools = (ball(up, away=500.0), *tools[1:])
    without = Simulation(Problem(grid, FABRIC, tools, (STILL, STILL), stroke=0, holding=1, settings=Settings()))
    put(without, here)
    without._choose_step()
    alone = first_forces(without)
    np.testing.assert_allclose(with_ball - alone, expected, atol=1e-9)
    assert simulation.tool_reaction(0) == pytest.approx(expected[..., 2].sum(), rel=1e-9)


# -- bands -----------------------------------------------------------------------------------------


def dome(grid, threads):
    """A ball pressed into a patch between two plates with friction, set in motion: contact, slip and waves."""
    tools = (
        plate("above", -1.0, friction=0.2),
        plate("below", 1.0, "force", friction=0.2, force=20.0),
        ball(1.0, away=0.05, friction=0.2),
    )
    problem = Problem(
        grid,
        FABRIC,
        tools,
        (Motion((0.0, 0.01), (0.0, 0.1)), Motion((0.0, 0.002), (0.0, 1.0))),
        stroke=0,
        holding=1,
        settings=Settings(damping=500.0),
    )
    simulation = Simulation(problem, threads)
    simulation.velocities = smooth_velocities(grid, 50.0)
    simulation.advance_to(0.01)
    return simulation


@pytest.mark.parametrize(
    "grid", [pytest.param(whole_grid(10, 13), marks=pytest.mark.slow), bias_grid(7)], ids=["whole", "half"]
)
def test_result_is_the_same_bit_for_bit_with_1_2_and_3_bands(grid):
    """Also with more bands than processors."""
    one = dome(grid, 1)
    assert one.bands == 1
    assert np.abs(one.positions - grid.flat).max() > 0.01
    assert one.ledger().friction > 0.0
    for threads in (2, 3):
        other = dome(grid, threads)
        assert other.bands == threads
        np.testing.assert_array_equal(other.positions, one.positions)
        np.testing.assert_array_equal(other.velocities, one.velocities)
        assert other.ledger() == one.ledger()
        assert [other.tool_reaction(k) for k in range(3)] == [one.tool_reaction(k) for k in range(3)]


def test_checkpoint_restores_with_another_number_of_bands():
    grid = bias_grid(7)
    through = dome(grid, 1)
    saved = through.checkpoint()
    other = dome(grid, 2)
    other.restore(saved)
    for simulation in (through, other):
        simulation.advance_to(0.012)
    np.testing.assert_array_equal(other.positions, through.positions)
    assert math.isfinite(other.positions.sum())
