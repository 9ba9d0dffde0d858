"""Timing of sheets: laps of all cases in turn, so that a slow spell of the machine hits all of them."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from weftform.benchmark.reference import Reference
from weftform.benchmark.sheet import same_sheet, sheet_study
from weftform.cases import case_of
from weftform.result.fields import Fields
from weftform.solver import Simulation
from weftform.solver import layout as at
from weftform.solver.layout import Layout

LAP_STEPS = 256
"""Steps of a lap: four surveys and one entry of the ledger; a row of the history is added as often as the study asks.
The C program makes as many, with four surveys: short laps find quiet moments of a busy machine that long ones miss."""
TURN_SECONDS = 0.25
"""A case keeps its turn for as long as this."""

WEFTFORM = "weftform"
C_REFERENCE = "c-reference"
C_EVERYWHERE = "c-reference, contact on all rows"


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


def arithmetic(layout: Layout, touched: float) -> dict[str, float]:
    """Operations and memory traffic of one cell in one step, for the roofline.

    Counted by hand in the formulas of ``mechanics``: an addition, multiplication, division or root is one, a
    comparison none. ``touched`` is the mean number of tools evaluated on a crossing. Bytes are those of a sheet far
    larger than the caches: what a sweep reads, and what it writes back.
    """
    connectors = 2.0 * 32.0 + 2.0 * (layout.warp_degree + layout.weft_degree)
    cell = 176.0 + 2.0 * layout.shear_degree
    crossing = 38.0
    tool = 62.0
    written = 7 + touched * at.TOOL_FIELDS
    read = at.LEDGER + touched * at.TOOL_FIELDS
    return {
        "flops_per_cell_step": connectors + cell + crossing + tool * touched,
        "bytes_per_cell_step": 8.0 * (written + read),
    }


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
        while simulation.steps - before < LAP_STEPS:
            simulation.advance_to(simulation.time + (LAP_STEPS - simulation.steps + before) * simulation.step)
        looped = time.perf_counter()
        simulation.ledger()
        Fields(study.grid, study.fabric, simulation.positions).largest_shear()
        row = time.perf_counter() - looped
        made = simulation.steps - before
        return made, looped - began + row * made * simulation.step / between_rows, looped - began

    fields = start["fields"]
    touched = float((simulation._touching > 0).mean(axis=1).sum())
    work = arithmetic(simulation.layout, touched)
    return Timed(WEFTFORM, side, threads, contact, device, lap, fields.nbytes / side**2, work)


def reference_case(simulation: Simulation, side: int, contact: bool, everywhere: bool = False) -> Timed:
    """The same sheet advanced by the C program: steps and surveys."""
    reference = Reference(simulation, everywhere)

    def lap() -> tuple[int, float, float]:
        reference.restart()
        began = time.perf_counter()
        reference.advance_surveyed(LAP_STEPS)
        spent = time.perf_counter() - began
        return LAP_STEPS, spent, spent

    touched = 3.0 if everywhere else float((simulation._touching > 0).mean(axis=1).sum())
    # its state is positions, velocities and the friction force of each tool, all of them read and written
    work = arithmetic(simulation.layout, touched) | {"bytes_per_cell_step": 8.0 * (12.0 + 6.0 * touched)}
    name = C_EVERYWHERE if everywhere else C_REFERENCE
    return Timed(name, side, 1, contact, "cpu", lap, reference.state.nbytes / side**2, work)


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
