"""One simulation, in a process of its own or in this one."""

from __future__ import annotations

import os
import signal
import tempfile
import threading
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from weftform.errors import CardError, StudyError, UnstableRun
from weftform.study.study import Study

_stop: Any = None
"""Event that tells the processes of a pool to give up, set by :func:`prepare`."""


@dataclass(frozen=True)
class Task:
    """A study to run, and the key under which its outcome is kept."""

    key: str
    study: Study


@dataclass(frozen=True)
class Outcome:
    """What a simulation gave.

    Attributes
    ----------
    key
        Of the task.
    displacement_mm, force_N
        The history; empty where the run failed.
    failure
        Why the study could not be run to its end; empty where it could.
    warnings
        Quality checks that the run failed.
    seconds
        Wall time.
    """

    key: str
    displacement_mm: tuple[float, ...] = ()
    force_N: tuple[float, ...] = ()
    failure: str = ""
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0


def prepare(stop: Any) -> None:
    """Set a process of the pool up: the keyboard is the parent's, and without a parent there is nothing to do."""
    global _stop
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    import multiprocessing

    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def simulate(task: Task, scratch: Path) -> Outcome:
    """Run a study on one thread, as ``weftform run`` would, and keep its curve.

    Raises
    ------
    KeyboardInterrupt
        Here, or in the process that started this one.
    """
    import time

    from weftform.execution import Progress, run

    def watch(_: Progress) -> None:
        if _stop is not None and _stop.is_set():
            raise KeyboardInterrupt

    begun = time.perf_counter()
    model = task.study.model
    few = model.model_copy(update={"output": model.output.model_copy(update={"frames": 2})})
    study = replace(task.study, model=few)
    with tempfile.TemporaryDirectory(prefix="run-", dir=scratch) as folder:
        try:
            study.check()
            result = run(study, Path(folder) / "result", threads=1, watch=watch)
        except (UnstableRun, CardError, StudyError) as problem:
            return Outcome(task.key, failure=problem.message, seconds=time.perf_counter() - begun)
        history, summary = result.history, result.summary
    return Outcome(
        task.key,
        tuple(float(v) for v in history["displacement_mm"]),
        tuple(float(v) for v in history["force_N"]),
        warnings=tuple(summary["warnings"]),
        seconds=time.perf_counter() - begun,
    )
