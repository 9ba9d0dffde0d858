"""Ask LLVM for the full width of the vector unit in the function that holds a loop.

On processors with 512-bit registers LLVM prefers 256 bits, because the first of them lowered their clock for wider
instructions. The loops here wait for chains of dependent operations more than for the clock, so twice the numbers per
instruction are worth it (docs/performance.md).
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import intrinsic

WIDTH = '"prefer-vector-width"="512"'


@intrinsic
def use_full_width(typingctx: Any) -> Any:
    """Mark the function being compiled; no operation at run time and without effect on narrower processors."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        # llvmlite knows only the attributes of the LLVM language reference by name; others pass through its printer
        set.add(builder.function.attributes, WIDTH)
        return context.get_dummy_value()

    return types.void(), codegen
