"""The time loop on the GPU, under Numba's CUDA simulator, computes what that of the processor computes."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from cuda_cases import CASES, compute

from weftform.errors import DeviceError
from weftform.execution import run
from weftform.result import Result
from weftform.study import Study

STEPS = 200
TOLERANCE = 1e-9
"""Rounding of one step is 1e-16; sums are taken in another order, and a yarn that goes slack or a crossing that starts to
slide a rounding error earlier or later amplifies it for a few steps."""


needs_simulator = pytest.mark.skipif(
    find_spec("numba.cuda") is None, reason="needs numba-cuda, or a Numba that still holds its simulator"
)


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


@needs_simulator
@pytest.mark.parametrize("case", [c if c == "tools" else pytest.param(c, marks=pytest.mark.slow) for c in CASES])
def test_device_agrees_with_processor_after_200_steps(case, tmp_path):
    here = agreeing(case, STEPS, 1, tmp_path)
    assert np.abs(here["velocities"]).max() > 1.0
    if case == "tools":
        assert (np.abs(here["tools"][:, 2]) > 0.0).all()  # every tool pushes
        assert here["inertia"][0] > 1.0  # masses are scaled
        kinetic, *_, friction, damping, _ = here["energies"]
        assert min(kinetic, friction, damping) > 0.0


@needs_simulator
def test_threads_of_a_block_share_its_work(tmp_path):
    """Five threads on the 18 elements of a tile and on the nine crossings of a row: uneven shares, sums as a tree."""
    agreeing("tools", 20, 5, tmp_path)


@needs_simulator
@pytest.mark.slow
def test_run_writes_the_same_result(tmp_path):
    """A whole run, output included, to the digits of history.csv."""
    changes = {
        "blank.cell_length_mm": 26.8,
        "loading.duration_s": 0.0004,
        "loading.closing_s": 0.0001,
        "loading.stroke_mm": 0.2,
        "output.frames": 2,
        "output.rows": 3,
    }
    arguments = [item for key, value in changes.items() for item in ("--set", f"{key}={value}")]
    command = "from weftform.cli import main; main()"
    subprocess.run(
        [sys.executable, "-c", command, "run", "hemisphere-0-90", *arguments, "--device", "cuda", "--no-figures"],
        cwd=tmp_path,
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1"},
        capture_output=True,
        check=False,  # so short a run is dynamic, and says so
    )
    there = Result.open(tmp_path / "results" / "hemisphere-0-90")
    here = run(Study.load("hemisphere-0-90", changes), tmp_path / "here")
    assert (there.summary["device"], here.summary["device"]) == ("cuda", "cpu")
    assert there.summary["device_name"] == "CUDA simulator"
    assert there.summary["steps"] == here.summary["steps"] > 50
    # forces against the largest force and so on: the punch has hardly begun to push, and its force is a rounding error of
    # its position times the stiffness of the contact
    largest = {}
    for name, expected in here.history.items():
        unit = name.rsplit("_", 1)[-1]
        largest[unit] = max(largest.get(unit, 0.0), np.abs(expected).max())
    for name, expected in here.history.items():
        scale = largest[name.rsplit("_", 1)[-1]]
        np.testing.assert_allclose(there.history[name], expected, rtol=1e-6, atol=TOLERANCE * scale, err_msg=name)


# -- no GPU ------------------------------------------------------------------------------------------------------------


def test_machine_without_gpu_gets_one_message_and_nothing_is_written(tmp_path):
    """Also where there is one: the driver is told to show none."""
    done = subprocess.run(
        [sys.executable, "-c", "from weftform.cli import main; main()", "run", "hemisphere-0-90", "--device", "cuda"],
        cwd=tmp_path,
        env={k: v for k, v in os.environ.items() if k != "NUMBA_ENABLE_CUDASIM"} | {"CUDA_VISIBLE_DEVICES": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("error: key --device:")
    assert "hint:" in done.stderr and "--device cpu" in done.stderr
    assert "Traceback" not in done.stderr and done.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_threads_and_a_gpu_exclude_each_other(tmp_path):
    with pytest.raises(DeviceError, match="threads"):
        run("hemisphere-0-90", tmp_path / "out", device="cuda", threads=2)
    with pytest.raises(DeviceError, match="no such device"):
        run("hemisphere-0-90", tmp_path / "out", device="abacus")
    assert list(tmp_path.iterdir()) == []
