"""How every scalar function of this package is compiled.

``contract`` allows fused multiply-add and nothing else: full fast-math would break the NaN checks of the loop
drivers. ``error_model="numpy"`` removes the zero-division branches that stop LLVM from vectorising.
``forceinline`` lets LLVM see the constants of the caller.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any, TypeVar, cast

import numba
from numba.core.dispatcher import Dispatcher

FASTMATH = {"contract"}

Scalar = TypeVar("Scalar", bound=Callable[..., Any])


def scalar(function: Scalar) -> Scalar:
    """Compile a function of numbers so that it is inlined into the loop that calls it."""
    return cast(Scalar, numba.njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)(function))


@cache
def python_function(function: Callable[..., Any]) -> Callable[..., Any]:
    """A compiled function, and every compiled function that it calls, as they were written.

    For a few calls from Python: the scalar functions are not cached on disk, and compiling one takes longer.
    """
    return rebuilt(function, python_function)


def rebuilt(function: Any, convert: Callable[..., Any]) -> Callable[..., Any]:
    """A Python function whose compiled callees are converted."""
    source = getattr(function, "py_func", function)
    called = {name: source.__globals__[name] for name in source.__code__.co_names if name in source.__globals__}
    replaced = {name: convert(value) for name, value in called.items() if isinstance(value, Dispatcher)}
    scope = {**source.__globals__, **replaced}
    return FunctionType(source.__code__, scope, source.__name__, source.__defaults__, source.__closure__)
