"""Numba loads quickly with weftform, and can do afterwards what it can without."""

import subprocess
import sys

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
