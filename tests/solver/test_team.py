"""Threads that take orders, wait for each other, go to sleep and are called off."""

import os
import signal
import threading
import time

import numba
import numpy as np
import pytest
from small_problems import pressed, whole_grid

from weftform.cases import case_of
from weftform.solver import Simulation, team
from weftform.solver.team import ARRIVED, CALLED_OFF, ORDERS, Team, meet, next_order
from weftform.study import Study


@numba.njit(nogil=True)
def take_turns(gate, members, member, order, turns, tally, worst):
    """Every turn each member writes its own entry, and after all have met reads those of all."""
    done = 0
    while True:
        order = next_order(gate, member, order)
        if order == 0:
            return done
        if not meet(gate, members):
            return -1
        for _ in range(turns):
            tally[member] += 1
            meet(gate, members)
            for k in range(members):
                worst[member] = max(worst[member], abs(tally[k] - tally[member]))
            meet(gate, members)
        done = turns


class Game:
    def __init__(self, members, turns=200):
        self.team = Team(members)
        self.tally, self.worst = np.zeros(members, np.int64), np.zeros(members, np.int64)
        self.turns = turns
        self.calls = []

    def play(self, band, order):
        self.calls.append((band, order))
        return take_turns(self.team.gate, self.team.members, band, order, self.turns, self.tally, self.worst)

    def round(self):
        return self.team.work(self.play)


@pytest.mark.parametrize("members", [1, 2, 3, 5])
def test_nobody_goes_on_before_all_are_there(members):
    """Also with more members than processors."""
    game = Game(members)
    for k in range(1, 6):
        assert game.round() == game.turns
        assert game.tally[0] == k * game.turns
    assert (game.tally == 5 * game.turns).all()
    assert (game.worst == 0).all()


def test_members_stay_for_the_next_order():
    """What a thread does beside its bands: it is called once for many orders."""
    game = Game(2, turns=10)
    for _ in range(50):
        game.round()
    assert sum(band == 0 for band, _ in game.calls) == 50
    assert sum(band == 1 for band, _ in game.calls) < 50


def test_members_that_went_to_sleep_are_called_again():
    game = Game(2, turns=3)
    for _ in range(5):
        game.round()
        gone = time.monotonic() + 10.0
        while not game.team.gate[ORDERS + team.APART] & 1:
            assert time.monotonic() < gone
            time.sleep(0.001)
    assert (game.tally == 15).all()
    assert [order for band, order in game.calls if band == 1] == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("members", [2, 3])
def test_an_interrupt_before_the_work_leaves_it_undone(members):
    """The others already wait at the first meeting: they leave, and the next order finds all of them again."""
    game = Game(members)
    game.round()

    def interrupted(band, order):
        if band == 0:
            while game.team.gate[ARRIVED] < members - 1:
                time.sleep(0.001)
            raise KeyboardInterrupt
        return game.play(band, order)

    time.sleep(0.1)
    with pytest.raises(KeyboardInterrupt):
        game.team.work(interrupted)
    assert game.team.gate[CALLED_OFF]
    assert (game.tally == game.turns).all()
    game.round()
    assert (game.tally == 2 * game.turns).all() and (game.worst == 0).all()


def test_an_error_in_the_work_reaches_the_caller():
    def broken(band, order):
        raise ValueError(f"band {band}")

    group = Team(2)
    with pytest.raises(ValueError, match="band 0"):
        group.work(broken)


def test_an_error_in_another_thread_reaches_the_caller_too():
    """The first, who waits for it at the beginning, leaves."""
    game = Game(2)

    def broken(band, order):
        if band == 1:
            raise ValueError("band 1")
        return game.play(band, order)

    with pytest.raises(ValueError, match="band 1"):
        game.team.work(broken)
    assert (game.tally == 0).all()
    game.round()
    assert (game.tally == game.turns).all()


def test_compiling_makes_no_step_and_wakes_nobody():
    simulation = pressed(whole_grid(12, 16), threads=3)
    simulation.compile()
    assert simulation.steps == 0 and simulation.time == 0.0
    assert not simulation._team._tasks
    simulation.advance_to(20.5 * simulation.step)
    assert simulation.steps == 21


def test_two_threads_at_once_are_refused():
    game = Game(2)

    def meanwhile(band, order):
        if band == 0:
            with pytest.raises(RuntimeError, match="from two threads"):
                game.team.work(game.play)
        return game.play(band, order)

    assert game.team.work(meanwhile) == game.turns


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_child_has_a_team_of_its_own():
    game = Game(2)
    game.round()
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        game.round()
        os._exit(0 if (game.tally == 2 * game.turns).all() else 1)
    assert os.waitpid(child, 0)[1] == 0


@pytest.mark.parametrize("name", ["bias-extension", "tensile-warp"])
def test_grips_give_the_same_bits_with_any_number_of_threads(name):
    """Where crossings are driven threads meet once more in each step."""
    problem = case_of(Study.load(name)).problem()
    one = Simulation(problem, 1)
    stop = 400.5 * one.step
    one.advance_to(stop)
    for threads in (2, 3, 5):
        other = Simulation(problem, threads)
        assert other.bands > 1
        other.advance_to(stop)
        np.testing.assert_array_equal(other.positions, one.positions)
        np.testing.assert_array_equal(other.driven_forces, one.driven_forces)
        assert other.ledger() == one.ledger()


def test_threads_end_with_their_simulation():
    others = set(threading.enumerate())
    simulation = pressed(whole_grid(12, 16), threads=3)
    simulation.advance_to(1e-5)
    mine = set(threading.enumerate()) - others
    assert len(mine) == 2 and all(thread.name.startswith("weftform-band") for thread in mine)
    del simulation
    for thread in mine:
        thread.join(10.0)
        assert not thread.is_alive()
