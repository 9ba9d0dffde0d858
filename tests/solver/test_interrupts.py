"""Ctrl-C waits for the end of a batch of steps."""

import os
import signal
import threading
import time

import numpy as np
import pytest
from small_problems import pressed, whole_grid

from weftform.solver.interrupts import uninterrupted


@pytest.fixture(autouse=True)
def interruptible():
    """A shell ignores the signal for what it starts in the background, and this process may have inherited that."""
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, former)


def test_ctrl_c_waits_for_the_end_of_a_batch():
    done = []
    with pytest.raises(KeyboardInterrupt), uninterrupted():
        signal.raise_signal(signal.SIGINT)
        done.append("batch")
    assert done == ["batch"]
    with pytest.raises(KeyboardInterrupt):  # the usual answer is back
        signal.raise_signal(signal.SIGINT)


def test_ctrl_c_is_not_lost_where_the_batch_fails():
    with pytest.raises(KeyboardInterrupt), uninterrupted():
        signal.raise_signal(signal.SIGINT)
        raise ValueError("blown up")


def test_a_handler_of_the_system_is_left_in_place():
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    with uninterrupted():
        assert signal.getsignal(signal.SIGINT) == signal.SIG_DFL


@pytest.mark.parametrize("threads", [1, 2])
def test_interrupted_again_and_again_a_run_ends_with_the_same_bits(threads):
    end, grid = 0.02, whole_grid(16, 16)
    through = pressed(grid, friction=0.2, threads=threads)
    through.advance_to(end)
    broken = pressed(grid, friction=0.2, threads=threads)
    broken.compile()
    over = threading.Event()
    listening = False

    def interrupt(number, frame):
        """Ctrl-C as a run meets it, but never where this test itself would be cut off."""
        nonlocal listening
        if listening:
            listening = False
            raise KeyboardInterrupt

    def disturb():
        while not over.wait(0.001):
            os.kill(os.getpid(), signal.SIGINT)

    signal.signal(signal.SIGINT, interrupt)
    interruptions = 0
    disturber = threading.Thread(target=disturb)
    disturber.start()
    until = time.monotonic() + 60.0
    try:
        while broken.time < end * (1.0 - 1e-12) and time.monotonic() < until:
            try:
                listening = True
                broken.advance_to(end)
                listening = False
            except KeyboardInterrupt:
                interruptions += 1
    finally:
        over.set()
        disturber.join()
    assert interruptions > 0
    assert broken.steps == through.steps
    np.testing.assert_array_equal(broken.positions, through.positions)
