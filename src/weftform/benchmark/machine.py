"""The machine: what it is, and the two peaks that bound any program on it."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numba
import numpy as np

from weftform.benchmark.reference import ReferenceMissing, multiply_add
from weftform.mechanics.compiled import FASTMATH, scalar

CHAIN = 16
"""Multiply-adds per number loaded, so that the first-level cache does not matter."""
IN_CACHE = 512
STREAM = 6_000_000
"""Numbers per array of the stream: three arrays of 48 MB."""
REPEATS = 12


@scalar
def _four(x: float, f: float) -> float:
    return (((x * f + 0.01) * f + 0.01) * f + 0.01) * f + 0.01


@numba.njit(fastmath=FASTMATH, error_model="numpy", nogil=True, cache=True)
def _multiply_add(values: Any, factor: float, repeats: int) -> None:
    for _ in range(repeats):
        for i in range(values.shape[0]):
            values[i] = _four(_four(_four(_four(values[i], factor), factor), factor), factor)


@numba.njit(fastmath=FASTMATH, nogil=True, cache=True)
def _triad(a: Any, b: Any, c: Any, factor: float) -> None:
    for i in range(a.shape[0]):
        a[i] = b[i] + factor * c[i]


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def peak_gflops(threads: int) -> float:
    """Multiply-adds that the processor makes from registers, counted as two operations [Gflop/s].

    The better of Numba and, where there is gcc, C: a compiler may not use the widest vectors.
    """
    repeats = 800
    values = [np.full(IN_CACHE, 0.5) for _ in range(threads)]
    best = _fastest(threads, lambda k: _multiply_add(values[k], 0.5, repeats))
    try:
        in_c = multiply_add()
    except ReferenceMissing:
        pass
    else:
        best = min(best, _fastest(threads, lambda k: in_c(values[k], repeats)))
    return 2e-9 * threads * CHAIN * IN_CACHE * repeats / best


def stream_gb_per_s(threads: int) -> float:
    """Memory bandwidth of ``a = b + f c`` on arrays of :data:`STREAM` numbers, three transfers counted [GB/s]."""
    arrays = [[np.ones(STREAM // threads) for _ in range(3)] for _ in range(threads)]
    best = _fastest(threads, lambda k: _triad(arrays[k][0], arrays[k][1], arrays[k][2], 0.5))
    return 1e-9 * 24 * (STREAM // threads) * threads / best


def _fastest(threads: int, work: Callable[[int], None]) -> float:
    best = float("inf")
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, range(threads)))
        for _ in range(REPEATS):
            start = time.perf_counter()
            list(pool.map(work, range(threads)))
            best = min(best, time.perf_counter() - start)
    return best


def describe(threads: list[int]) -> dict[str, Any]:
    """Name, versions, load and measured peaks."""
    import llvmlite.binding as llvm

    from weftform import __version__

    return {
        "processor": _processor(),
        "llvm_target": llvm.get_host_cpu_name(),
        "processors": processors(),
        "load_average": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "numba": numba.__version__,
        "weftform": __version__,
        "peak_gflops": {str(n): round(peak_gflops(n), 1) for n in threads},
        "stream_gb_per_s": {str(n): round(stream_gb_per_s(n), 1) for n in threads},
    }


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
