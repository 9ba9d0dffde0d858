"""The benchmark as a whole: which cases, in which order, and what is said about the machine."""

from __future__ import annotations

import json
import os
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from weftform.benchmark.machine import describe, processors
from weftform.benchmark.measure import Timed, reference_case, take_laps, weftform_case
from weftform.benchmark.reference import ReferenceMissing
from weftform.benchmark.sheet import MAKERS, SOURCE_CELLS, formed_sheet, formed_source
from weftform.errors import WeftformError
from weftform.processors import threads_for
from weftform.solver.cuda.gpu import find_gpu

SIDES = (56, 200, 700)
QUICK_SIDES = (56,)
SECONDS = 100.0
QUICK_SECONDS = 10.0
FEWEST_LAPS = 2
WIDE_SPREAD = 1.15
"""Median over minimum of the laps beyond which the machine is called noisy."""

BUSY = 0.9
"""Share of the processor below which others are using it."""

Watch = Callable[[str, float], None]


@dataclass(frozen=True)
class Bench:
    """What was measured."""

    machine: dict[str, Any]
    cases: list[dict[str, Any]]

    def to_json(self) -> str:
        """``{"machine": ..., "cases": [...]}``"""
        return json.dumps({"machine": self.machine, "cases": self.cases}, indent=2)


def bench(
    *,
    sides: Sequence[int] = SIDES,
    threads: Sequence[int] = (),
    devices: Sequence[str] = ("cpu",),
    seconds: float = SECONDS,
    fewest: int = FEWEST_LAPS,
    source_cells: int = SOURCE_CELLS,
    with_start_up: bool = True,
    watch: Watch | None = None,
) -> Bench:
    """Time the solver and the C reference.

    Parameters
    ----------
    sides
        Cells along a side of each sheet.
    threads
        Numbers of threads; 1 and all processors without.
    devices
        Keys of :data:`weftform.benchmark.sheet.MAKERS`.
    seconds
        Time to spend on the laps.
    fewest
        Laps of each case in any case.
    source_cells
        Cells along the side of the blank that is formed to start from.
    with_start_up
        Also time the start of the process and whole runs, in processes of their own.

    Raises
    ------
    WeftformError
        A device that is not there, or a number of threads that cannot be had; nothing has been timed.
    """
    say: Watch = watch or (lambda what, share: None)
    unknown = [device for device in devices if device not in MAKERS]
    if unknown:
        raise WeftformError(
            "this device cannot be timed", key="--device", expected=" or ".join(MAKERS), got=", ".join(unknown)
        )
    if "cuda" in devices:
        find_gpu()
    numbers = sorted({threads_for(0, n) for n in threads or (1, processors())})
    notes: list[str] = []
    say("peaks of the machine", 0.0)
    machine = describe(numbers)
    say("forming the blank", 0.0)
    source = formed_source(source_cells)
    cases: list[Timed] = []
    for side in sides:
        for contact in (True, False):
            say(f"preparing {side} x {side}, {'with' if contact else 'without'} contact", 0.0)
            start = formed_sheet(side, contact, source)
            for device in devices:
                for n in numbers if device == "cpu" else (1,):
                    cases.append(weftform_case(start, side, n, contact, device))
            try:
                cases.append(reference_case(start, side, contact))
                if contact:
                    cases.append(reference_case(start, side, contact, everywhere=True))
            except ReferenceMissing as problem:
                if problem.message not in notes:
                    notes.append(f"no C reference: {problem.message}")
    take_laps(cases, seconds, fewest, lambda share: say("timing", share))
    found = [case.as_dict() for case in cases]
    _add_ratios(found)
    if with_start_up:
        from weftform.benchmark.start_up import start_up, whole_run

        say("start of the process, with and without compiled kernels", 1.0)
        machine["start_up"] = start_up(min(2, processors()))
        say("whole runs", 1.0)
        machine["whole_run_no_figures"] = whole_run(False)
        machine["whole_run_figures"] = whole_run(True)
    notes += _noise(found, numbers)
    machine["load_average_at_end"] = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    machine["notes"] = notes
    return Bench(machine, found)


def _add_ratios(cases: list[dict[str, Any]]) -> None:
    """Ratio of each case to the C reference on one thread of the same sheet, where there is one."""
    yardstick = {
        (case["cells"], case["contact"]): case["ns_per_cell_step"] for case in cases if case["program"] == "c-reference"
    }
    for case in cases:
        if (case["cells"], case["contact"]) in yardstick:
            c = yardstick[case["cells"], case["contact"]]
            case["ratio_to_c"] = round(case["ns_per_cell_step"] / c, 3)
            case["loop_ratio_to_c"] = round(case["loop_ns_per_cell_step"] / c, 3)


def _noise(cases: list[dict[str, Any]], numbers: list[int]) -> list[str]:
    notes = []
    spread = statistics.median(case["median_ns_per_cell_step"] / case["ns_per_cell_step"] for case in cases)
    if spread > WIDE_SPREAD:
        notes.append(
            f"a noisy machine: half of the laps took {100 * (spread - 1):.0f} % longer than the fastest; the least is given"
        )
    alone = [case["processor_share"] for case in cases if case["threads"] == 1 and case["device"] == "cpu"]
    share = statistics.median(alone) if alone else 1.0
    if share < BUSY:
        notes.append(
            f"other programs took {100 * (1 - share):.0f} % of the processor of the laps on one thread: "
            "times on more threads mean little"
        )
    if max(numbers) > processors():
        notes.append(f"{max(numbers)} threads on {processors()} processors wait for each other")
    return notes
