"""How many processors there are for us, and whether others took them."""

from __future__ import annotations

import math
import os
from pathlib import Path

CROWDED = 0.8
"""Share of the processor time asked for below which a run says that others took the rest."""


def usable_processors(root: Path = Path("/sys/fs/cgroup")) -> int:
    """Processors this process may use: those it is bound to, and no more than its container's quota.

    Parameters
    ----------
    root
        Where the control group of the process is mounted (Linux, version 2).
    """
    bound = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    try:
        quota, period = (root / "cpu.max").read_text(encoding="ascii").split()
        return max(1, min(bound, math.ceil(int(quota) / int(period))))
    except (OSError, ValueError):
        return bound


def crowding(threads: int, usable: int, processor_s: float, wall_s: float) -> list[str]:
    """What to say about a run whose threads had to wait for processors.

    Parameters
    ----------
    threads, usable
        Threads of the run and processors it may use.
    processor_s, wall_s
        Processor time of the process and time of the clock [s], both over the time loop.
    """
    if threads > usable:
        return [f"{threads} threads share {usable} processor{'s' * (usable > 1)}: fewer would be faster (--threads)"]
    got = processor_s / max(threads * wall_s, 1e-9)
    if wall_s > 1.0 and got < CROWDED:
        return [
            f"other programs took {100 * (1 - got):.0f} % of the processor time: the run was slower than this machine is"
        ]
    return []
