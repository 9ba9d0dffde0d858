"""From the scalar functions of :mod:`weftform.mechanics` to functions of the device.

numba-cuda would take functions compiled for the processor as they are, but with the flags of the processor: it reads
their ``fastmath={"contract"}`` as full fast-math, which breaks checks for finite numbers. So the Python function is
compiled again, together with the functions that it calls. Under the simulator it stays a Python function.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numba
from numba import cuda

from weftform.mechanics.compiled import python_function, rebuilt

# a small blank does not fill a GPU; the user has asked for it all the same
numba.config.CUDA_LOW_OCCUPANCY_WARNINGS = 0  # type: ignore[attr-defined]

SIMULATED = bool(numba.config.ENABLE_CUDASIM)  # type: ignore[attr-defined]


@cache
def device_function(function: Callable[..., Any]) -> Any:
    """Compile a function of numbers and tuples for the device, and every scalar function that it calls."""
    if SIMULATED:
        return python_function(function)
    jit: Any = cuda.jit
    return jit(device=True, forceinline=True)(rebuilt(function, device_function))


# -- vectors as tuples: values in registers ---------------------------------------------------------


@device_function
def vector_at(array, place, stride):
    """Three components that lie ``stride`` apart."""
    return array[place], array[place + stride], array[place + stride + stride]


@device_function
def put_vector(array, place, stride, vector):
    """Store three components that lie ``stride`` apart."""
    array[place] = vector[0]
    array[place + stride] = vector[1]
    array[place + stride + stride] = vector[2]


@device_function
def minus(a, b):
    """``a - b``."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@device_function
def dot(a, b):
    """``a . b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@device_function
def combine(s, a, t, b):
    """``s a + t b``."""
    return s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]
