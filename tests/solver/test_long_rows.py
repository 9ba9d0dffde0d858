"""Rows longer than what the loops take at a time give what short rows give."""

import numpy as np
import pytest
from small_problems import FABRIC, STILL, ball, plate, smooth_velocities, whole_grid

from weftform.solver import Problem, Settings, Simulation
from weftform.solver import layout as at

pytestmark = pytest.mark.slow


def struck(grid, threads=1):
    """A patch thrown about between a plate and a ball, with friction."""
    tools = (plate("above", -1.0, friction=0.2), ball(1.0, friction=0.2), plate("below", 1.0, away=500.0))
    return Simulation(Problem(grid, FABRIC, tools, (STILL,), stroke=0, settings=Settings(least_step=1e-6)), threads)


def turned(field):
    """Warp and weft, x and y exchanged."""
    return np.swapaxes(field, 0, 1)[..., [1, 0, 2]]


def test_a_patch_and_the_same_patch_turned_move_alike():
    """The long patch is cut into pieces of rows, the turned one is not; rounding is all that may differ."""
    columns = 2 * at.PIECE + 22
    lying, standing = struck(whole_grid(columns, 5)), struck(whole_grid(5, columns))
    assert lying.columns > 2 * at.PIECE
    velocities = smooth_velocities(lying.problem.grid, 2000.0)
    velocities[..., 2] = np.where(
        np.hypot(*np.moveaxis(lying.problem.grid.flat[..., :2], -1, 0)) < 30.0, -3000.0, 500.0
    )
    lying.velocities = velocities
    standing.velocities = turned(velocities)
    pressed = 0.0
    for stop in 20 * lying.step * np.arange(1, 7):
        for simulation in (lying, standing):
            simulation.advance_to(stop)
            slid = simulation.ledger().friction
        pressed = max(pressed, lying.penetration)
    assert pressed > 1e-3
    assert slid > 0.0
    moved = lying.positions - lying.problem.grid.flat
    assert np.abs(moved).max() > 0.1
    np.testing.assert_allclose(turned(standing.positions), lying.positions, atol=1e-9 * np.abs(moved).max())
    one, other = lying.ledger(), standing.ledger()
    for name in ("kinetic", "connectors", "membrane", "contact", "friction", "damping"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-8), name


def test_threads_cut_long_rows_alike():
    grid = whole_grid(2 * at.PIECE + 22, 9)
    ends = []
    for threads in (1, 2):
        simulation = struck(grid, threads)
        simulation.velocities = smooth_velocities(grid, 2000.0)
        simulation.advance_to(150 * simulation.step)
        ends.append((simulation.positions, simulation.ledger()))
    np.testing.assert_array_equal(ends[0][0], ends[1][0])
    assert ends[0][1] == ends[1][1]
