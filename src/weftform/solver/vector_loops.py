"""How a loop over a row is compiled, so that LLVM turns it into vector code without guards.

On processors with 512-bit registers LLVM prefers 256 bits, because the first of them lowered their clock for wider
instructions. The loops here wait for chains of dependent operations more than for the clock, so twice the numbers per
instruction are worth it (docs/performance.md).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba import types
from numba.core.compiler import Compiler
from numba.extending import intrinsic

from weftform.mechanics.compiled import FASTMATH

WIDTH = '"prefer-vector-width"="512"'


@intrinsic
def use_full_width(typingctx: Any) -> Any:
    """Mark the function being compiled; no operation at run time and without effect on narrower processors."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        # llvmlite knows only the attributes of the LLVM language reference by name; others pass through its printer
        set.add(builder.function.attributes, WIDTH)
        return context.get_dummy_value()

    return types.void(), codegen


class SeparateArrays(Compiler):
    """Numba's compiler, told that no two array arguments overlap, and that the function allocates nothing.

    The vectoriser otherwise guards each loop with a check of every pair of arrays, and takes the scalar loop where a
    row is too short to be worth the checks. And each call counts up and down the references to its arrays, by operations on
    memory that threads share: 6 % of a step on one thread, more on two.
    """

    def __init__(
        self, typingctx: Any, targetctx: Any, library: Any, args: Any, return_type: Any, flags: Any, locals: Any
    ) -> None:
        flags.noalias = True
        flags.nrt = False
        super().__init__(typingctx, targetctx, library, args, return_type, flags, locals)  # type: ignore[no-untyped-call]


def loop_part(function: Callable[..., Any]) -> Any:
    """Compile a part of a loop over steps or rows, which allocates nothing, so that it counts no references."""
    njit: Any = numba.njit
    return njit(fastmath=FASTMATH, error_model="numpy", forceinline=True, _nrt=False)(function)


def row_loop(function: Callable[..., Any]) -> Any:
    """Compile a loop over one row so that it is inlined where its constants are known.

    No two of its array arguments may overlap. It calls ``use_full_width()`` and ``numba.literally(stride)`` itself:
    both act on the function in which they stand, and distances between fields have to be constants already there.
    """
    return numba.njit(fastmath=FASTMATH, error_model="numpy", forceinline=True, pipeline_class=SeparateArrays)(function)


@numba.njit(fastmath=FASTMATH | {"reassoc"}, error_model="numpy", forceinline=True)
def add_lanes(total: float, value: float) -> float:
    """``total + value``, a step of a sum over a row that may be made side by side in lanes.

    The order depends on the length of the row and the width of the vector unit, on nothing else.
    """
    return total + value
