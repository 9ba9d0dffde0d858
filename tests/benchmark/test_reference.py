"""The C reference computes what the package computes."""

import shutil

import numpy as np
import pytest

from weftform.benchmark import bench as whole
from weftform.benchmark.reference import Reference, source_file
from weftform.benchmark.sheet import MAKERS, formed_sheet, formed_source, same_sheet
from weftform.errors import DeviceError, WeftformError
from weftform.solver import loop

gcc = pytest.mark.skipif(
    shutil.which("gcc") is None, reason="no gcc on this machine: the C reference cannot be compiled"
)
SIDE = 12


@pytest.fixture(scope="module")
def source():
    return formed_source(SIDE, 0.5)


def side_by_side(contact, source, everywhere=False):
    simulation = formed_sheet(SIDE, contact, source=source)
    reference = Reference(simulation, everywhere)
    start = simulation.positions
    for _ in range(10):
        reference.follow(simulation)
        before = simulation.steps
        simulation.advance_to(simulation.time + 29.5 * simulation.step)
        reference.advance(simulation.steps - before)
        reference.survey()
    return simulation, reference, np.abs(simulation.positions - start).max()


@gcc
@pytest.mark.parametrize(("contact", "everywhere"), [(True, False), (True, True), (False, False)])
def test_reference_and_package_move_alike(contact, everywhere, source):
    simulation, reference, way = side_by_side(contact, source, everywhere)
    assert way > 1e-3
    # the same formulas in another order: rounding, amplified by 300 steps of stiff yarns, friction and buckling
    assert np.abs(simulation.positions - reference.positions).max() < 1e-9 * max(way, 1.0)


@gcc
def test_reference_books_the_same_heats_and_reactions(source):
    simulation, reference, _ = side_by_side(True, source)
    now, start = simulation.ledger(), formed_sheet(SIDE, True, source=source)
    damped = simulation.machine.heats[:, 0].sum() - start.machine.heats[:, 0].sum()
    assert reference.damped == pytest.approx(damped, rel=1e-7)
    assert reference.friction == pytest.approx(now.friction - start.ledger().friction, rel=1e-7)
    assert reference.friction > 0.0
    assert reference.reactions == pytest.approx(simulation.machine.poses[:, loop.P_REACTION], rel=1e-6, abs=1e-9)


def test_a_machine_without_gcc_is_told(monkeypatch, source):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(WeftformError, match="no gcc on this machine"):
        Reference(source)


def test_source_is_there():
    assert source_file().read_text().startswith("/* The yardstick")


def test_unknown_device_is_refused_before_anything_is_timed():
    with pytest.raises(WeftformError, match="cannot be timed"):
        whole.bench(sides=(SIDE,), devices=("abacus",))


def test_a_missing_gpu_is_said_before_anything_is_timed(monkeypatch):
    def none():
        raise DeviceError("there is no GPU")

    monkeypatch.setattr(whole, "find_gpu", none)
    monkeypatch.setattr(whole, "describe", lambda numbers: pytest.fail("timing has begun"))
    with pytest.raises(DeviceError, match="no GPU"):
        whole.bench(sides=(SIDE,), devices=("cuda",))


def test_a_device_is_added_by_one_entry(monkeypatch, source):
    made = []

    def maker(problem, threads):
        made.append(threads)
        return MAKERS["cpu"](problem, threads)

    monkeypatch.setitem(MAKERS, "twin", maker)
    sheet = formed_sheet(SIDE, True, source)
    twin = same_sheet(sheet, 1, "twin")
    assert made == [1]
    stop = sheet.time + 10 * sheet.step
    for simulation in (sheet, twin):
        simulation.advance_to(stop)
    assert np.array_equal(twin.positions, sheet.positions)
