"""Ctrl-C between batches of steps, never inside one.

A batch ends with the survey that chooses the next step; a run that was interrupted before it would go on with other steps
than one that was not. On the GPU a batch is many launches from Python besides.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back until a batch of steps is whole, so that clock, tools and state are of the same instant."""
    # Signals are for the main thread, and only a handler of Python's can be called later.
    if threading.current_thread() is not threading.main_thread() or not callable(signal.getsignal(signal.SIGINT)):
        yield
        return
    held_back: list[Any] = []
    usual = signal.signal(signal.SIGINT, lambda *received: held_back.append(received))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
        if held_back and callable(usual):
            usual(*held_back[0])
