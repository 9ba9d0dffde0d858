"""Tools that start hard, light holders and stiff dashpots: what a look at the state at rest does not show."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_problems import FABRIC, THICKNESS, all_nodes, ball, driven, pressed, whole_grid

from weftform.mechanics.contact import rounded_edge
from weftform.mechanics.motion import motion_value
from weftform.solver import Motion, Problem, Settings, Simulation, loop
from weftform.solver.simulation import SURVEY_EVERY

START, STROKE, DURATION = 0.002, 6.0, 0.004


def pushed(ramp, end_ramp=None):
    """A free patch that a ball below runs into; it stands still until ``START``."""
    stroke = Motion((START, START + DURATION), (0.0, STROKE))
    tools = (ball(1.0),)
    problem = Problem(
        whole_grid(12, 10), FABRIC, tools, (stroke, Motion((0.0, 1.0), (1.0, 1.0))), stroke=0, holding=1,
        settings=Settings(ramp=ramp, end_ramp=end_ramp, mass_scaling=100.0),
    )  # fmt: skip
    return Simulation(problem)


@settings(max_examples=50, deadline=None)
@given(
    time=st.floats(0.0, 0.03),
    span=st.floats(1e-6, 0.004),
    ramp=st.sampled_from([0.01, 0.2, 0.5]),
    end_ramp=st.sampled_from([0.1, 0.5]),
)
def test_no_tool_goes_further_than_the_search_expects(time, span, ramp, end_ramp):
    machine = pushed(ramp, end_ramp).machine
    times, values = np.array([START, START + DURATION]), np.array([0.0, STROKE])
    ways = [motion_value(times, values, 2, (ramp, end_ramp), time + share * span) for share in np.linspace(0.0, 1.0, 9)]
    assert np.ptp(ways) <= machine.longest_way(time, span) + 1e-12


def test_contact_is_found_before_a_tool_starts_hard():
    """Just before the start nothing moves; what the ball will have run into at the next survey counts as within reach."""
    simulation = pushed(0.01)
    simulation.advance_to(0.999 * START)
    sheet, machine = simulation.sheet, simulation.machine
    simulation._survey()
    reach = SURVEY_EVERY * simulation.step
    later = machine.motion(int(machine.tools[0, loop.T_MOTION]), simulation.time + reach)
    assert later > 0.25 * THICKNESS
    x, y, z = np.moveaxis(simulation.positions, -1, 0)
    hit = np.zeros(z.shape, bool)
    for place in np.ndindex(z.shape):
        distance, _, _ = rounded_edge(np.hypot(x[place], y[place]), z[place] - later, *machine.tools[0, :5])
        hit[place] = distance < 0.5 * THICKNESS
    found = np.zeros((len(z), simulation.layout.stride), bool)
    for row, local in enumerate(sheet.row_index):
        count, *pieces = machine.pieces[0, local]
        for begin, length, _ in pieces[: count[0]]:
            found[row, begin : begin + length] = True
    assert hit.sum() > 5
    assert found[:, : z.shape[1]][hit].all()


@pytest.mark.parametrize("viscosity", [0.0, 0.06, 0.3])
def test_a_long_pull_stays_stable_with_any_dashpot(viscosity):
    grid = whole_grid(6, 5)
    nodes = all_nodes(grid)
    edge = nodes[~np.isin(nodes, np.arange(grid.active.size).reshape(grid.shape)[1:-1, 1:-1])]
    pull = 0.35 * grid.flat.reshape(-1, 3)[edge]
    simulation = driven(grid, edge, pull[None], [Motion((0.0, 0.02), (0.0, 1.0))], viscosity=viscosity, safety=0.85)
    simulation.advance_to(0.02)
    ledger = simulation.ledger()
    assert abs(ledger.imbalance) < 1e-3 * abs(ledger.work)


def test_a_light_holder_sets_the_step():
    """Its own stable step is ``2 sqrt(m / k)`` on the contact stiffness (30 N/mm3) of the whole blank."""
    grid = whole_grid(12, 10)
    simulation = pressed(grid)
    before = simulation.step
    mass = 30.0 * grid.area * (0.1 * before) ** 2
    simulation.machine.tools[1, loop.T_MASS] = mass
    simulation._choose_step()
    assert simulation.step == pytest.approx(0.85 * 0.2 * before, rel=1e-9)
