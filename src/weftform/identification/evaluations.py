"""Evaluating points of the parameter space: in parallel, each simulation once, and none of them lost."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from pathlib import Path
from typing import Any

from weftform.errors import CardError, IdentificationError, ResultError, StudyError
from weftform.identification.laws import Family, changed, changes_of
from weftform.identification.worker import Outcome, Task, prepare, simulate
from weftform.study.study import Study

LOG = "evaluations.jsonl"
Point = tuple[float, ...]


class Evaluations:
    """The simulations of an identification.

    Parameters
    ----------
    studies
        One per test; each point is evaluated in all of them.
    families
        What the values of a point change.
    folder
        Holds the log of evaluations; simulations work in ``folder/scratch``.
    jobs
        Simulations side by side; with one everything happens in this process.
    watch
        Called after every simulation with the number done and the number found in the log.

    Notes
    -----
    A simulation is known by what decides its outcome: the resolved study with its card and the version of weftform.
    Whatever the log holds under such a key is what a run would give again.
    """

    def __init__(
        self,
        studies: Sequence[Study],
        families: Sequence[Family],
        folder: Path,
        jobs: int,
        watch: Callable[[int, int], None],
    ) -> None:
        self.studies = tuple(studies)
        self.families = tuple(families)
        self.folder = folder
        self.jobs = jobs
        self.watch = watch
        self.done = 0
        self.reused = 0
        self._known = read_log(folder / LOG)
        self._counted: set[str] = set()
        self._pool: ProcessPoolExecutor | None = None
        self._stop: Any = None
        self._log: Any = None

    def __enter__(self) -> Evaluations:
        self._clear_scratch()
        try:
            (self.folder / "scratch").mkdir()
            self._log = (self.folder / LOG).open("a", encoding="utf-8")
        except OSError as problem:
            raise ResultError(f"the folder cannot be written ({problem.strerror})", file=self.folder) from None
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if self._pool is not None:
            if kind is not None:
                self._stop.set()
            self._pool.shutdown(wait=True, cancel_futures=True)
        self._log.close()
        self._clear_scratch()

    def _clear_scratch(self) -> None:
        shutil.rmtree(self.folder / "scratch", ignore_errors=True)

    def at(self, points: Sequence[Point]) -> list[list[Outcome]]:
        """Outcomes of points in the order asked, one per study each.

        Raises
        ------
        ResultError
            The log cannot be written, or a process died.
        KeyboardInterrupt
            What was done by then is in the log.
        """
        tasks = [[self._task(point, study) for study in self.studies] for point in points]
        wanted: dict[str, Task] = {}
        for task in (task for row in tasks for task in row):
            if isinstance(task, Outcome):
                continue
            if task.key not in self._known:
                wanted.setdefault(task.key, task)
            elif task.key not in self._counted:
                self._counted.add(task.key)
                self.reused += 1
        self._compute(list(wanted.values()))
        return [[task if isinstance(task, Outcome) else self._known[task.key] for task in row] for row in tasks]

    def _task(self, point: Point, study: Study) -> Task | Outcome:
        """The simulation of a point, or what is wrong with the point where the card says so at once."""
        try:
            made = changed(study, changes_of(self.families, point))
            card = made.fabric.card.model_dump_json(exclude={"provenance"})
        except (CardError, StudyError) as problem:
            return Outcome("", failure=problem.message)
        # without what it has worked out, which a process would only be sent for nothing
        return Task(key_of(made, card), Study(made.model, made.file))

    def _compute(self, tasks: list[Task]) -> None:
        if not tasks:
            return
        if self.jobs == 1:
            for task in tasks:
                self._keep(simulate(task, self.folder / "scratch"))
            return
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            self._stop = context.Event()
            self._pool = ProcessPoolExecutor(self.jobs, mp_context=context, initializer=prepare, initargs=(self._stop,))
        futures: list[Future[Outcome]] = [self._pool.submit(simulate, task, self.folder / "scratch") for task in tasks]
        try:
            for future in as_completed(futures):
                self._keep(future.result())
        except BrokenProcessPool:
            raise ResultError(
                "a process that ran a simulation died (out of memory?)",
                file=self.folder,
                hint="what was computed is kept: go on with --resume, and fewer --jobs",
            ) from None

    def _keep(self, outcome: Outcome) -> None:
        """Add an outcome to the log, on the disk before it is used."""
        self._known[outcome.key] = outcome
        self._counted.add(outcome.key)
        try:
            self._log.write(json.dumps(asdict(outcome)) + "\n")
            self._log.flush()
            os.fsync(self._log.fileno())
        except OSError as problem:
            raise ResultError(
                f"the log of evaluations cannot be written ({problem.strerror})",
                file=self.folder / LOG,
                hint="what was written before is kept: make room and go on with --resume",
            ) from None
        self.done += 1
        self.watch(self.done, self.reused)


def key_of(study: Study, card: str) -> str:
    """What tells one simulation from another, shape of a hash."""
    from weftform import __version__

    model = study.model.model_dump(mode="json", exclude={"name", "description", "fabric"})
    text = json.dumps([__version__, model, study.model.fabric.tension_variant, card], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def read_log(path: Path) -> dict[str, Outcome]:
    """Outcomes by their keys. A last line that was cut by a crash is taken off the file.

    Raises
    ------
    IdentificationError
        A line that is none of ours.
    """
    known: dict[str, Outcome] = {}
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return known
    except OSError as problem:
        raise ResultError(f"cannot be read ({problem.strerror})", file=path) from None
    whole = content.rfind(b"\n") + 1
    if whole < len(content):
        os.truncate(path, whole)
    for number, line in enumerate(content[:whole].splitlines(), 1):
        try:
            values = json.loads(line)
            for name in ("displacement_mm", "force_N", "warnings"):
                values[name] = tuple(values[name])
            outcome = Outcome(**values)
        except (ValueError, TypeError, KeyError, AttributeError):
            raise IdentificationError(
                "this is not a line of a log of evaluations",
                file=path,
                line=number,
                hint="take the line out, or start in another folder",
            ) from None
        known[outcome.key] = outcome
    return known
