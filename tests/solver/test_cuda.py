"""The GPU's time loop under Numba's CUDA simulator computes what that of the processor computes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cuda_cases import CASES, compute

from weftform.errors import DeviceError
from weftform.solver import Simulation
from weftform.solver.layout import stride_for

STEPS = 200
TOLERANCE = 1e-9
"""Rounding of one step is 1e-16; sums are taken in another order, and a yarn that goes slack or a crossing that starts to
slide a rounding error earlier or later amplifies it for a few steps."""


def on_simulator(case, folder):
    file = folder / "computed.npz"
    here = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, here / "cuda_cases.py", case, str(STEPS), file],
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    with np.load(file) as data:
        return dict(data)


@pytest.mark.parametrize("case", [c if c == "tools" else pytest.param(c, marks=pytest.mark.slow) for c in CASES])
def test_device_agrees_with_processor_after_200_steps(case, tmp_path):
    """Relative to the largest of each quantity; energies to the largest energy."""
    there = on_simulator(case, tmp_path)
    here = compute(case, STEPS, "cpu")
    assert here["steps"] >= STEPS
    for name, expected in here.items():
        scale = np.abs(expected).max(initial=0.0, axis=0 if name == "tools" else None)
        np.testing.assert_array_less(
            np.abs(there[name] - expected), TOLERANCE * scale + 1e-300, err_msg=f"{name} of {case}"
        )
    assert np.abs(here["velocities"]).max() > 1.0
    if "tools" in case:
        kinetic, *_, friction, damping, _ = here["energies"]
        assert min(kinetic, friction, damping) > 0.0
        assert (np.abs(here["tools"][:, 2]) > 0.0).all()  # every tool pushes
