"""Threads that make the steps of a simulation together, and the barrier at which they wait for each other.

A step of a few thousand cells takes some ten microseconds, and to wake another thread takes longer. So each thread stays
in the time loop with a band of rows of its own, waits for the others by looking at a shared number (Mellor-Crummey and
Scott, ACM Trans. Comput. Syst. 9, 1991, 21-65: centralised barrier), and between batches of steps looks out for the next
for a while before it goes to sleep.
"""

from __future__ import annotations

import os
import platform
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

APART = 16
"""Entries of a gate between those that different threads write, so that they share no cache line."""
ARRIVED, ROUND, CALLED_OFF, ORDERS = 0, APART, 2 * APART, 3 * APART
"""Places in a gate: how many have arrived, how often all had, whether the team is called off; then for each member twice
the number of its orders, plus one while it is away."""
LOOKS = 400
"""How often a thread looks before it lets others use its processor: some ten microseconds."""
PATIENCE = 10_000
"""How often a thread looks out for an order before it goes to sleep: some milliseconds."""

GIVE_WAY = "SwitchToThread" if os.name == "nt" else "sched_yield"
X86 = platform.machine().lower() in ("x86_64", "amd64")


def _word(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """Address of ``gate[place]``."""
    data = context.make_array(signature.args[0])(context, builder, args[0]).data
    return builder.gep(data, [args[1]])


def _call(builder: Any, name: str, result: Any) -> None:
    module = builder.module
    builder.call(module.globals.get(name) or ir.Function(module, ir.FunctionType(result, []), name=name), [])


@intrinsic
def _look(typingctx: Any, gate: Any, place: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load_atomic(_word(context, builder, signature, args), "acquire", 8)

    return types.int64(gate, types.intp), codegen


@intrinsic
def _put(typingctx: Any, gate: Any, place: Any, value: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store_atomic(args[2], _word(context, builder, signature, args), "release", 8)
        return context.get_dummy_value()

    return types.void(gate, types.intp, types.int64), codegen


@intrinsic
def _add(typingctx: Any, gate: Any, place: Any, value: Any) -> Any:
    """Add to an entry; returns what was there."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.atomic_rmw("add", _word(context, builder, signature, args), args[2], "seq_cst")

    return types.int64(gate, types.intp, types.int64), codegen


@intrinsic
def _replace(typingctx: Any, gate: Any, place: Any, old: Any, new: Any) -> Any:
    """Replace an entry where it is ``old``; returns whether it was."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        word = _word(context, builder, signature, args)
        return builder.extract_value(builder.cmpxchg(word, args[2], args[3], "seq_cst", "acquire"), 1)

    return types.boolean(gate, types.intp, types.int64, types.int64), codegen


@intrinsic
def _relax(typingctx: Any) -> Any:
    """Tell the processor that this is waiting."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        if X86:
            _call(builder, "llvm.x86.sse2.pause", ir.VoidType())
        return context.get_dummy_value()

    return types.void(), codegen


@intrinsic
def _give_way(typingctx: Any) -> Any:
    """Let another thread have the processor."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        _call(builder, GIVE_WAY, ir.IntType(32))
        return context.get_dummy_value()

    return types.void(), codegen


@numba.njit(error_model="numpy", nogil=True)
def _pause(looks):
    if looks < LOOKS:
        _relax()
    else:
        _give_way()


@numba.njit(error_model="numpy", nogil=True)
def meet(gate, members):
    """Wait until all members of the team are here; False where the team was called off."""
    if members == 1:
        return True
    now = _look(gate, ROUND)
    if _add(gate, ARRIVED, 1) == members - 1:
        _put(gate, ARRIVED, 0)
        _put(gate, ROUND, now + 1)
        return True
    looks = 0
    while _look(gate, ROUND) == now:
        if _look(gate, CALLED_OFF) != 0:
            return False
        _pause(looks)
        looks += 1
    return True


@numba.njit(error_model="numpy", nogil=True)
def next_order(gate, member, done):
    """Number of the order after ``done``, once it is given; 0 where none comes for a while, and the member leaves.

    The first member gives the orders and has only the one that it is called for.
    """
    if member == 0:
        return 1 - done
    place = ORDERS + APART * member
    looks = 0
    while True:
        given = _look(gate, place) >> 1
        if given > done:
            return given
        tired = looks >= PATIENCE or _look(gate, CALLED_OFF) != 0
        # leaves only if no order came in between: whoever gives one sees whether its taker is there
        if tired and _replace(gate, place, 2 * done, 2 * done + 1):
            return 0
        _pause(looks)
        looks += 1


@numba.njit(error_model="numpy", cache=True)
def _give_order(gate, member):
    """Give a member an order; returns its orders before, doubled, plus one where it is away."""
    place = ORDERS + APART * member
    before = _add(gate, place, 2)
    if before & 1:
        _add(gate, place, -1)
    return before


class Team:
    """The thread that calls and ``members - 1`` more, which all make the same work on different bands.

    Parameters
    ----------
    members
        At least 1.

    Attributes
    ----------
    gate
        What :func:`meet` and :func:`next_order` need, shape [(3 + members) * APART].
    """

    def __init__(self, members: int) -> None:
        self.members = members
        self.gate: NDArray[np.int64] = np.zeros(ORDERS + APART * members, np.int64)
        self._pool: ThreadPoolExecutor | None = None
        self._tasks: list[Future[Any]] = []
        self._busy = threading.Lock()
        self._start()

    def _start(self) -> None:
        self._process = os.getpid()
        self._tasks = []
        self._reset()
        if self.members > 1:
            self._pool = ThreadPoolExecutor(self.members - 1, thread_name_prefix="weftform-band")
            # each thread starts now, where a failure to start one leaves nobody waiting
            together = threading.Barrier(self.members)
            for _ in range(self.members - 1):
                self._pool.submit(together.wait)
            together.wait()

    def _reset(self) -> None:
        self.gate[:] = 0
        self.gate[ORDERS::APART] = 1

    def work(self, work: Callable[[int, int], int]) -> int:
        """Call ``work`` with each band and the number of orders that it has had; returns what band 0 returns.

        ``work`` takes orders (:func:`next_order`) until there is none. For each it begins with a :func:`meet` and changes
        nothing before; where that says False it takes no other.

        Raises
        ------
        RuntimeError
            Another thread is having this team work.
        BaseException
            What ``work`` raised in any of the threads.
        """
        with self._alone():
            return self._work(work)

    def try_out(self, work: Callable[[int, int], int]) -> None:
        """Call ``work`` in this thread only, called off before it begins: so it is compiled and does nothing."""
        with self._alone():
            self.call_off()
            work(0, 0)

    @contextmanager
    def _alone(self) -> Iterator[None]:
        if not self._busy.acquire(blocking=False):
            raise RuntimeError("one simulation is advanced from two threads at the same time")
        try:
            yield
        finally:
            self._busy.release()

    def _work(self, work: Callable[[int, int], int]) -> int:
        if self._pool is None:
            return work(0, 0)
        if self._process != os.getpid():
            # a forked child has none of the threads
            self._start()
        if self.gate[CALLED_OFF]:
            wait(self._tasks)
            self._reset()
        try:
            for band in range(1, self.members):
                before = _give_order(self.gate, band)
                if before & 1:
                    self._tasks = [task for task in self._tasks if not task.done()]
                    self._tasks.append(self._pool.submit(self._guarded, work, band, before >> 1))
            done = work(0, 0)
        except BaseException:
            # An interrupt comes before this thread is in the work, or after. Before, the others wait for it in vain.
            self.call_off()
            raise
        if self.gate[CALLED_OFF]:
            for task in self._tasks:
                task.result()
            raise RuntimeError("a thread left the time loop")
        return done

    def call_off(self) -> None:
        """Let those who wait for the others at the beginning of an order leave, and nobody begin until the next."""
        self.gate[CALLED_OFF] = 1

    def _guarded(self, work: Callable[[int, int], int], band: int, order: int) -> None:
        try:
            work(band, order)
        except BaseException:
            self.call_off()
            raise
