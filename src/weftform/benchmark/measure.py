"""Timing of sheets: laps of all cases in turn, so that a slow spell of the machine hits all of them."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from weftform.benchmark.reference import Reference
from weftform.benchmark.sheet import same_sheet, sheet_study
from weftform.cases import case_of
from weftform.result.fields import Fields
from weftform.solver import Simulation
from weftform.solver.simulation import LEDGER_EVERY, SURVEY_EVERY
from weftform.solver.survey import ON_FACE, TOUCHING

LAP_SURVEYS = 2
LAP_STEPS = LAP_SURVEYS * SURVEY_EVERY
"""Steps of a lap; entries of the ledger and rows of the history are added as often as a run makes them.
The C program makes as many steps and surveys: short laps find quiet moments of a busy machine that long ones miss."""
TURN_SECONDS = 0.25
"""A case keeps its turn for as long as this."""

WEFTFORM = "weftform"
C_REFERENCE = "c-reference"
C_EVERYWHERE = "c-reference, contact everywhere"


@dataclass
class Timed:
    """One case and its laps.

    Attributes
    ----------
    program
        :data:`WEFTFORM`, :data:`C_REFERENCE` or :data:`C_EVERYWHERE`.
    side
        Cells along a side of the sheet.
    lap
        Makes one lap; returns steps, seconds of everything, seconds of the time loop alone.
    memory
        Bytes of state per cell.
    """

    program: str
    side: int
    threads: int
    contact: bool
    device: str
    lap: Callable[[], tuple[int, float, float]]
    memory: float
    work: dict[str, float]
    laps: list[tuple[float, float]] = field(default_factory=list)
    """Of each lap: ns per cell per step of everything, and of the time loop alone."""
    shares: list[float] = field(default_factory=list)
    """Of each lap: processor time over wall time times threads; below one where others use the processors."""

    @property
    def cells(self) -> int:
        return self.side**2

    def run(self) -> None:
        """Make a lap."""
        wall, processor = time.perf_counter(), time.process_time()
        steps, whole, loop = self.lap()
        self.shares.append((time.process_time() - processor) / ((time.perf_counter() - wall) * self.threads))
        scale = 1e9 / (steps * self.cells)
        self.laps.append((whole * scale, loop * scale))

    def as_dict(self) -> dict[str, Any]:
        """The case as ``weftform bench --json`` prints it."""
        whole = [lap[0] for lap in self.laps]
        best = min(whole)
        return {
            "program": self.program,
            "cells": self.cells,
            "threads": self.threads,
            "contact": self.contact,
            "precision": "float64",
            "device": self.device,
            "ns_per_cell_step": round(best, 3),
            "loop_ns_per_cell_step": round(min(lap[1] for lap in self.laps), 3),
            "median_ns_per_cell_step": round(statistics.median(whole), 3),
            "laps": len(self.laps),
            "processor_share": round(statistics.median(self.shares), 3),
            "state_bytes_per_cell": round(self.memory, 1),
            **{name: round(value, 1) for name, value in self.work.items()},
            "gflops": round(self.work["flops_per_cell_step"] / best, 2),
        }


def arithmetic(simulation: Simulation, touching: float, on_face: float) -> dict[str, float]:
    """Operations and memory traffic of one cell in one step, for the roofline.

    Counted by hand in the formulas of ``mechanics``, ``solver.fabric_rows``, ``solver.rows`` and ``solver.contact_rows``: an
    addition, multiplication, division, root or inverse root is one, a comparison none; what a loop computes again rather than
    fetch is counted once. Bytes are those of a sheet far larger than the caches: position and velocity and, where a tool
    touches, its friction traction are read and written back; traits are shared by rows and stay in a cache.

    Parameters
    ----------
    touching, on_face
        Mean number of tools evaluated on a crossing with and without a normal that turns (:func:`contact_shares`).
    """
    layout = simulation.layout
    terms = len(simulation.material.series)
    connectors = 2.0 * 34.0 + 2.0 * (layout.warp_degree + layout.weft_degree)
    cell = 123.0 + 4.0 * (terms - 1) + 2.0 * layout.shear_degree
    crossing = 40.0
    tools = 79.0 * touching + 31.0 * on_face
    return {
        "flops_per_cell_step": connectors + cell + crossing + tools,
        "bytes_per_cell_step": 8.0 * (2.0 * 6.0 + 2.0 * 3.0 * (touching + on_face)),
    }


def contact_shares(simulation: Simulation) -> tuple[float, float]:
    """Mean number of tools evaluated on a crossing: within reach of an edge, and of the flat face only."""
    shares = []
    lengths, kinds = simulation.machine.pieces[:, simulation.sheet.row_index, 1:, 1:].reshape(-1, 2).T
    counts = simulation.machine.pieces[:, simulation.sheet.row_index, 0, 0].reshape(-1)
    most = simulation.machine.pieces.shape[2] - 1
    valid = (np.arange(most)[None, :] < counts[:, None]).reshape(-1)
    for kind in (TOUCHING, ON_FACE):
        shares.append(float(lengths[valid & (kinds == kind)].sum()) / (simulation.rows * simulation.columns))
    return shares[0], shares[1]


def weftform_case(sheet: Simulation, side: int, threads: int, contact: bool, device: str) -> Timed:
    """A sheet advanced by the package, as users run it: surveys, ledger and history included."""
    simulation = same_sheet(sheet, threads, device)
    study = sheet_study(side)
    start = simulation.checkpoint()
    case = case_of(study)
    between_rows = case.end / (study.model.output.rows - 1)

    def lap() -> tuple[int, float, float]:
        simulation.restore(start)
        before = simulation.steps
        began = time.perf_counter()
        for _ in range(LAP_SURVEYS):
            # half a step less, so that rounding of the time neither adds a step nor splits the batch
            simulation.advance_to(simulation.time + (SURVEY_EVERY - 0.5) * simulation.step)
        marched = time.perf_counter()
        simulation.ledger()
        entered = time.perf_counter()
        Fields(study.grid, study.fabric, simulation.positions)
        looked = time.perf_counter()
        made = simulation.steps - before
        loop = marched - began + (entered - marched) * made / (SURVEY_EVERY * LEDGER_EVERY)
        row = (looked - marched) * made * simulation.step / between_rows
        return made, loop + row, loop

    memory = (
        start["fields"].nbytes + start["memory"].nbytes + start["grip"].nbytes + simulation.sheet.traits.nbytes
    ) / side**2
    work = arithmetic(sheet, *contact_shares(sheet))
    return Timed(WEFTFORM, side, threads, contact, device, lap, memory, work)


def reference_case(simulation: Simulation, side: int, contact: bool, everywhere: bool = False) -> Timed:
    """The same sheet advanced by the C program: steps and surveys."""
    reference = Reference(simulation, everywhere)

    def lap() -> tuple[int, float, float]:
        reference.restart()
        began = time.perf_counter()
        reference.advance_surveyed(LAP_STEPS)
        spent = time.perf_counter() - began
        return LAP_STEPS, spent, spent

    shares = (float(reference.tools), 0.0) if everywhere else contact_shares(simulation)
    work = arithmetic(simulation, *shares)
    memory = (reference.state.nbytes + reference.grip.nbytes) / side**2
    name = C_EVERYWHERE if everywhere else C_REFERENCE
    return Timed(name, side, 1, contact, "cpu", lap, memory, work)


def take_laps(
    cases: Iterable[Timed], seconds: float, fewest: int, watch: Callable[[float], None] | None = None
) -> None:
    """Run laps of all cases in turn until ``seconds`` are spent and each has ``fewest``."""
    cases = list(cases)
    began = time.perf_counter()
    rounds = 0
    while rounds < fewest or time.perf_counter() - began < seconds:
        for case in cases:
            # small sheets take as many laps as fit into the time of a large one
            until = time.perf_counter() + TURN_SECONDS
            case.run()
            while time.perf_counter() < until:
                case.run()
        rounds += 1
        if watch is not None:
            watch(min(1.0, (time.perf_counter() - began) / max(seconds, 1e-9)))
