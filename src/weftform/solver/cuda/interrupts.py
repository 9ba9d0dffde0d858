"""Ctrl-C between batches of steps, never inside one.

The processor's time loop is one compiled call, which Ctrl-C cannot break. On the GPU a batch is many launches from Python.
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
    if threading.current_thread() is not threading.main_thread():
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
