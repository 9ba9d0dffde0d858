"""As a program: compile the kernels of a case for an H200 without having one, and print their names.

numba-cuda asks the device at hand for its compute capability; here it is told.
"""

from __future__ import annotations

import sys
from unittest import mock

import numba.cuda.dispatcher
import numpy as np
from cuda_cases import CASES
from numba import cuda, types

from weftform.solver import Simulation, energies, survey
from weftform.solver.cuda import driver, launch, looking, sweep

HOPPER = (9, 0)
LINE, TABLE = types.float64[::1], types.float64[:, ::1]
BYTES, WORDS, PLACES = types.int8[:, ::1], types.int32[:, ::1], types.int64[::1]
MODES, COUNT = types.float64[:, :, ::1], types.int64


def constants_of(case):
    """Layout and constants that a simulation would give its driver."""
    given = []
    found = np.zeros(survey.ENTRIES)
    found[survey.FINITE] = 1.0
    stand_in = mock.Mock(**{"survey.return_value": found, "enter_ledger.return_value": np.zeros(energies.ENTRIES)})
    with mock.patch.object(driver, "CudaDriver", lambda *a: given.extend(a) or stand_in):
        Simulation(CASES[case](), device="cuda")
    _, layout, material, sheet, machine, _ = given
    return layout, launch.Constants.of(material, layout, sheet.rows, sheet.columns, len(machine.mode_motion))


def check(name, kernel, *arguments):
    text, _ = cuda.compile(kernel.py_func, arguments, device=False, cc=HOPPER, abi="numba")
    assert ".visible .entry" in text and ".target sm_90" in text
    # local memory: an array or spilled numbers where registers were meant; sine and cosine have a slow path that needs some
    assert name == "ledger" or ".local" not in text
    print(name)


if __name__ == "__main__":
    layout, constants = constants_of(sys.argv[1])
    tile = launch.tile_for(layout.tools + layout.driven)
    device = mock.Mock(compute_capability=HOPPER)
    with mock.patch.object(numba.cuda.dispatcher, "get_current_device", lambda: device):
        try:
            cuda.compile(lambda: None, (), device=False, cc=HOPPER, abi="numba")
        except Exception as problem:
            sys.exit(print(f"no compiler: {problem}"))
        check(
            "sweep", sweep.compile_sweep(layout, constants, tile), LINE, LINE, LINE, LINE, PLACES, LINE, TABLE, TABLE,
            TABLE, BYTES, TABLE, COUNT, TABLE, types.int32[::1], WORDS, BYTES, MODES, TABLE, LINE,
        )  # fmt: skip
        check("survey", looking.compile_survey(layout, constants, 128), LINE, LINE, PLACES, TABLE, TABLE, TABLE)
        check(
            "ledger", looking.compile_ledger(layout, constants, 128), LINE, LINE, LINE, PLACES, LINE, TABLE, TABLE, LINE,
            LINE, TABLE,
        )  # fmt: skip
        check("start", sweep.start_driven, LINE, TABLE, COUNT, COUNT, PLACES, BYTES, MODES, TABLE)
