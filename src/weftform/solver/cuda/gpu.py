"""Is there a GPU that the time loop can use? One clear answer, before anything is written."""

from __future__ import annotations

import contextlib
import io
from dataclasses import dataclass
from typing import Any

from weftform.errors import DeviceError

INSTALL = "pip install 'weftform[cuda]', on a machine with an NVIDIA GPU and its driver; or run with --device cpu"
LEAST_CAPABILITY = (7, 0)
"""Volta; below it numba-cuda and the toolkit of the extra no longer compile."""


@dataclass(frozen=True)
class Gpu:
    """What was found.

    Attributes
    ----------
    name
        As the driver says.
    capability
        Compute capability (major, minor).
    memory
        Free memory [bytes].
    simulated
        The CUDA simulator of Numba stands in for a GPU (``NUMBA_ENABLE_CUDASIM=1``).
    """

    name: str
    capability: tuple[int, int]
    memory: int
    simulated: bool = False

    def __str__(self) -> str:
        if self.simulated:
            return "CUDA simulator (for tests; thousands of times slower than the processor)"
        return f"{self.name}, compute capability {self.capability[0]}.{self.capability[1]}, {self.memory / 2**30:.0f} GiB free"


def find_gpu() -> Gpu:
    """The GPU that a run would use.

    Raises
    ------
    DeviceError
        None that can be used; the message says what is missing.
    """
    try:
        import numba_cuda  # type: ignore[import-not-found]  # noqa: F401
    except ImportError:
        if not _simulated():
            raise _unusable("numba-cuda is not installed") from None
    try:
        from numba import cuda
    except Exception as problem:
        raise _unusable(f"numba-cuda cannot be imported: {_first_line(problem)}") from None
    if _simulated():
        return Gpu("CUDA simulator", (0, 0), 2**62, simulated=True)
    # what numba-cuda prints while it looks for a driver is in our message
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return _probe(cuda)


def _probe(cuda: Any) -> Gpu:
    import numba

    try:
        if not cuda.is_available():
            raise _unusable("there is no NVIDIA GPU, or no driver for it")
        device = cuda.get_current_device()
        name = device.name.decode() if isinstance(device.name, bytes) else str(device.name)
        capability = (int(device.compute_capability[0]), int(device.compute_capability[1]))
        memory = int(cuda.current_context().get_memory_info()[0])
        # what only a launch shows: a toolkit that is missing, or newer than the driver
        numba.config.CUDA_LOW_OCCUPANCY_WARNINGS = 0  # type: ignore[attr-defined]
        cuda.jit(_nothing)[1, 1]()
        cuda.synchronize()
    except DeviceError:
        raise
    except Exception as problem:
        raise _unusable(f"the GPU runs no kernel: {_first_line(problem)}") from None
    if capability < LEAST_CAPABILITY:
        raise _unusable(f"{name} has compute capability {capability[0]}.{capability[1]}; 7.0 or later is needed")
    return Gpu(name, capability, memory)


def _nothing() -> None:
    """A kernel that does nothing."""


def _simulated() -> bool:
    import numba

    return bool(numba.config.ENABLE_CUDASIM)  # type: ignore[attr-defined]


def _unusable(why: str) -> DeviceError:
    return DeviceError(why, key="--device", expected="a GPU that numba-cuda can use", got="none", hint=INSTALL)


def _first_line(problem: Exception) -> str:
    text = str(problem).strip()
    return text.splitlines()[0] if text else type(problem).__name__
