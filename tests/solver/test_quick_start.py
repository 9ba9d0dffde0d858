"""Numba loads quickly with weftform, and can do afterwards what it can without."""

import subprocess
import sys

import pytest

WITH_DOT = """
import sys
import weftform.solver
assert "scipy.linalg" not in sys.modules
import numba
import numpy as np

@numba.njit
def product(a, b):
    return np.dot(a, b), np.correlate(a[0], b[0])

a = np.arange(9.0).reshape(3, 3)
dot, correlated = product(a, a)
np.testing.assert_allclose(dot, a @ a)
np.testing.assert_allclose(correlated, np.correlate(a[0], a[0]))
"""


def in_a_new_process(text):
    return subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False)


def test_linear_algebra_is_loaded_when_it_is_needed():
    done = in_a_new_process(WITH_DOT)
    assert done.returncode == 0, done.stderr


def test_linear_algebra_that_is_there_stays():
    text = "import scipy.linalg, weftform.solver, sys; assert sys.modules['scipy.linalg'] is scipy.linalg"
    assert in_a_new_process(text).returncode == 0


RUN = """
import sys
from numba.core import event
from weftform.execution import run
from weftform.study import Study
changes = ["loading.duration_s=0.01", "output.rows=5", "output.frames=2", *sys.argv[3:]]
with event.install_recorder("numba:compile") as recorder:
    run(Study.load(sys.argv[1], changes), sys.argv[2], threads=1)
compiled = [entry.data["dispatcher"].py_func.__qualname__ for _, entry in recorder.buffer]
assert not compiled, compiled
"""


@pytest.mark.parametrize(
    ("study", "small"),
    [("hemisphere-0-90", "blank.cell_length_mm=10"), ("bias-extension", "specimen.cell_length_mm=10")],
)
def test_what_was_compiled_once_is_not_compiled_again(tmp_path, study, small):
    """Nor is anything compiled for Python to call it: that takes longer than the calls."""
    command = [sys.executable, "-c", RUN, study, str(tmp_path / "out"), small]
    for _ in range(2):  # the first may fill the cache
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
