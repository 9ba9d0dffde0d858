"""The time loop on the GPU, under Numba's CUDA simulator, computes what that of the processor computes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cuda_cases import CASES, compute

STEPS = 200
TOLERANCE = 1e-9
"""Rounding of one step is 1e-16; sums are taken in another order, and a yarn that goes slack or a crossing that starts to
slide a rounding error earlier or later amplifies it for a few steps."""


def on_simulator(case, steps, threads, folder):
    file = folder / "computed.npz"
    done = subprocess.run(
        [sys.executable, Path(__file__).parent / "cuda_cases.py", case, str(steps), str(threads), file],
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    with np.load(file) as data:
        return dict(data)


def agreeing(case, steps, threads, folder):
    """Compute a case on both devices and compare, each quantity relative to its largest; returns the processor's."""
    there = on_simulator(case, steps, threads, folder)
    here = compute(case, steps, "cpu")
    assert here["steps"] == steps
    for name, expected in here.items():
        scale = np.abs(expected).max(initial=0.0, axis=0 if name == "tools" else None)
        assert np.all(np.abs(there[name] - expected) <= TOLERANCE * scale), name
    return here


@pytest.mark.parametrize("case", [c if c == "tools" else pytest.param(c, marks=pytest.mark.slow) for c in CASES])
def test_device_agrees_with_processor_after_200_steps(case, tmp_path):
    here = agreeing(case, STEPS, 1, tmp_path)
    assert np.abs(here["velocities"]).max() > 1.0
    if case == "tools":
        assert (np.abs(here["tools"][:, 2]) > 0.0).all()  # every tool pushes
        assert here["inertia"][0] > 1.0  # masses are scaled
        kinetic, *_, friction, damping, _ = here["energies"]
        assert min(kinetic, friction, damping) > 0.0


def test_threads_of_a_block_share_its_work(tmp_path):
    """Five threads on the 18 elements of a tile and on the nine crossings of a row: uneven shares, sums as a tree."""
    agreeing("tools", 20, 5, tmp_path)
