"""Where a run computes: processors there are for us, whether others took them, or a GPU."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Literal, get_args

from weftform.errors import DeviceError, StudyError

CROWDED = 0.8
"""Share of the processor time asked for below which a run says that others took the rest."""

CELLS_PER_THREAD = 350
"""Cells for which another thread pays: it makes a step of them in twice the time that two threads wait for each other."""
CROWD = 4
"""Threads per processor beyond which a wish for threads must be a mistake."""

Device = Literal["cpu", "cuda"]
"""Where the time loop runs: this machine's processors, or a GPU."""


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


def check_device(device: str, threads: int | None = None) -> None:
    """Make sure that a device can be used, before anything is written.

    Raises
    ------
    DeviceError
        There is no such device, none on this machine, or threads are asked of a GPU.
    """
    if device not in get_args(Device):
        raise DeviceError("no such device", key="--device", expected="cpu or cuda", got=device)
    if device == "cuda":
        if threads is not None:
            raise DeviceError(
                "threads are of the processor", key="--threads", expected="none with --device cuda", got=str(threads)
            )
        from weftform.solver.cuda.gpu import find_gpu

        find_gpu()


def threads_for(cells: int, wanted: int | None) -> int:
    """Threads to use: those asked for, or as many as pay for the size of the blank.

    Raises
    ------
    StudyError
        Less than one, or many more than there are processors.
    """
    usable = usable_processors()
    if wanted is None:
        return max(1, min(usable, cells // CELLS_PER_THREAD))
    most = CROWD * max(2, usable)
    if not 1 <= wanted <= most:
        raise StudyError(
            "that number of threads cannot be had",
            key="--threads",
            expected=f"1 to {most}",
            got=str(wanted),
            hint="more threads than processors only wait for each other",
        )
    return wanted
