"""From the scalar functions of :mod:`weftform.mechanics` to functions of the device.

numba-cuda would take functions compiled for the processor as they are, but with the flags of the processor: it reads
their ``fastmath={"contract"}`` as full fast-math, which breaks checks for finite numbers. So the Python function is
compiled again, together with the functions that it calls. Under the simulator it stays a Python function.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any

import numba
from numba import cuda
from numba.core.dispatcher import Dispatcher

# a small blank does not fill a GPU; the user has asked for it all the same
numba.config.CUDA_LOW_OCCUPANCY_WARNINGS = 0  # type: ignore[attr-defined]

SIMULATED = bool(numba.config.ENABLE_CUDASIM)  # type: ignore[attr-defined]


@cache
def python_function(function: Callable[..., Any]) -> Callable[..., Any]:
    """A compiled function, and every compiled function that it calls, as they were written."""
    return _rebuilt(function, python_function)


@cache
def device_function(function: Callable[..., Any]) -> Any:
    """Compile a function of numbers and tuples for the device, and every scalar function that it calls."""
    if SIMULATED:
        return python_function(function)
    jit: Any = cuda.jit
    return jit(device=True, forceinline=True)(_rebuilt(function, device_function))


def _rebuilt(function: Any, convert: Callable[..., Any]) -> Callable[..., Any]:
    """A Python function whose compiled callees are converted."""
    source = getattr(function, "py_func", function)
    called = {name: source.__globals__[name] for name in source.__code__.co_names if name in source.__globals__}
    replaced = {name: convert(value) for name, value in called.items() if isinstance(value, Dispatcher)}
    scope = {**source.__globals__, **replaced}
    return FunctionType(source.__code__, scope, source.__name__, source.__defaults__, source.__closure__)


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
