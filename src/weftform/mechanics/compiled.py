"""How every scalar function of this package is compiled.

``contract`` allows fused multiply-add and nothing else: full fast-math would break the NaN checks of the loop
drivers. ``error_model="numpy"`` removes the zero-division branches that stop LLVM from vectorising.
``forceinline`` lets LLVM see the constants of the caller.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

FASTMATH = {"contract"}


def scalar(function: Callable[..., Any]) -> Any:
    """Compile a function of numbers so that it is inlined into the loop that calls it."""
    return numba.njit(fastmath=FASTMATH, error_model="numpy", forceinline=True)(function)
