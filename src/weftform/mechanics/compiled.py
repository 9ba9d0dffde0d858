"""How every scalar function of this package is compiled.

``contract`` allows fused multiply-add and nothing else: full fast-math would break the NaN checks of the loop
drivers. ``error_model="numpy"`` removes the zero-division branches that stop LLVM from vectorising.
``forceinline`` lets LLVM see the constants of the caller.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

FASTMATH = {"contract"}

Scalar = TypeVar("Scalar", bound=Callable[..., Any])


def scalar(function: Scalar) -> Scalar:
    """Compile a function of numbers so that it is inlined into the loop that calls it."""
    return cast(Scalar, numba.njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)(function))
