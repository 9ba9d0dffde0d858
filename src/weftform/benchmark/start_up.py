"""How long it takes until the first step is made, and how long a whole run takes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from weftform.errors import WeftformError

FIRST_STEP = """
import os
from weftform.cases import case_of
from weftform.solver import Simulation
from weftform.study import Study
simulation = Simulation(case_of(Study.load("hemisphere-0-90")).problem(), {threads})
simulation.advance_to(simulation.step)
os._exit(0)
"""
"""What is measured ends here, not with the time that Python takes to put everything away."""

REPEATS = 6
"""How often a process is timed: other programs slow one that takes a second or two more than they slow a lap."""


def start_up(threads: int) -> dict[str, float]:
    """Wall time [s] from the start of the process to the end of the first step of the shipped hemisphere.

    Once with an empty cache of compiled kernels, which is filled, and :data:`REPEATS` times with it (the least counts).
    """
    with tempfile.TemporaryDirectory() as cache:
        cold = _seconds([sys.executable, "-c", FIRST_STEP.format(threads=threads)], cache)
        warm = min(_seconds([sys.executable, "-c", FIRST_STEP.format(threads=threads)], cache) for _ in range(REPEATS))
    return {"cold_s": round(cold, 3), "warm_s": round(warm, 3), "compile_s": round(cold - warm, 3)}


def whole_run(figures: bool) -> dict[str, float]:
    """Wall time [s] of ``weftform run hemisphere-0-90`` from start to end of the process, and of its time loop."""
    command = [sys.executable, "-c", "from weftform.cli import main; main()", "run", "hemisphere-0-90", "--out"]
    more = [] if figures else ["--no-figures"]
    with tempfile.TemporaryDirectory() as cache:
        best: dict[str, float] = {}
        for k in range(1 + REPEATS):
            with tempfile.TemporaryDirectory() as out:
                spent = _seconds([*command, str(Path(out) / "run"), *more], cache)
                loop = json.loads((Path(out) / "run" / "summary.json").read_text())["wall_s"]
            # the first fills the cache
            if k and (not best or spent < best["process_s"]):
                best = {"process_s": round(spent, 3), "loop_s": round(loop, 3), "rest_s": round(spent - loop, 3)}
    return best


def _seconds(command: list[str], cache: str) -> float:
    began = time.perf_counter()
    done = subprocess.run(
        command, env={**os.environ, "NUMBA_CACHE_DIR": cache}, capture_output=True, text=True, check=False
    )
    if done.returncode not in (0, 1):
        raise WeftformError(f"`{' '.join(command[:3])} ...` failed: {done.stderr.strip()[-300:]}")
    return time.perf_counter() - began
