"""Running a study: the simulation, its history and summary, and the result folder."""

from __future__ import annotations

import contextlib
import math
import os
import time
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from weftform.cases import Case, case_of
from weftform.errors import ResultError, UnstableRun
from weftform.processors import Device, check_device, crowding, threads_for, usable_processors
from weftform.result import Result
from weftform.result.fields import Fields
from weftform.result.writer import RESOLVED, ResultWriter, claim_folder, write_whole
from weftform.resuming import check_same, fingerprint
from weftform.solver import Ledger, Simulation, survey
from weftform.study import Study
from weftform.verdict import beyond_the_laws, blank_summary, doubts, energy_summary

CHECKPOINT_SECONDS = 20.0
"""Wall time between checkpoints of a long run."""

COLUMNS = (
    "time_s",
    "displacement_mm",
    "force_N",
    "shear_angle_max_deg",
    "kinetic_energy_mJ",
    "internal_energy_mJ",
    "connector_energy_mJ",
    "membrane_energy_mJ",
    "hourglass_energy_mJ",
    "contact_energy_mJ",
    "friction_energy_mJ",
    "damping_energy_mJ",
    "external_work_mJ",
    "imbalance_mJ",
    "step_s",
    "steps",
)
"""Columns of ``history.csv`` of every study; each case adds its own. Energies are of the whole blank."""


@dataclass(frozen=True)
class Progress:
    """Where a run stands, for a progress display."""

    share: float
    """Of the simulated time, 0 to 1."""
    displacement: float
    """Stroke so far [mm]."""
    steps: int
    ns_per_cell_step: float
    seconds_left: float
    compiling: bool = False


Watch = Callable[[Progress], None]


def run(
    study: Study | str | Path,
    out: str | Path,
    *,
    threads: int | None = None,
    device: Device = "cpu",
    resume: bool = False,
    watch: Watch | None = None,
) -> Result:
    """Run a study and write its result folder.

    Parameters
    ----------
    study
        A study, its file, or a shipped name.
    out
        Result folder; created, or cleared of a former result.
    threads
        Bands of rows computed in parallel; chosen by the size of the blank without. The result does not depend on it.
    device
        ``cpu``, or ``cuda`` for a GPU (needs ``weftform[cuda]``); threads count on the processor only.
    resume
        Go on from the checkpoint of an interrupted run in ``out``.
    watch
        Called several times a second with a :class:`Progress`.

    Returns
    -------
    The result, opened.

    Raises
    ------
    StudyError, CardError, ResultError, DeviceError
        Nothing was written.
    UnstableRun
        The run blew up; the result folder holds all that was computed before.
    KeyboardInterrupt
        Likewise, with a checkpoint to resume from.
    """
    if not isinstance(study, Study):
        study = Study.load(study)
    out = Path(out)
    check_device(device, threads)
    threads = threads_for(study.grid.cell_count, threads)
    claim_folder(out, resume=resume)
    if resume:
        check_same(study, out / "study.toml")
    Run(case_of(study), out, threads, watch, resume, device).go()
    return Result.open(out)


class Run:
    """One run of a case."""

    def __init__(
        self, case: Case, out: Path, threads: int, watch: Watch | None, resume: bool, device: Device = "cpu"
    ) -> None:
        self.case = case
        self.study = case.study
        self.out = out
        self.watch = watch
        self.grid = case.grid
        self.columns = [*COLUMNS, *case.columns]
        if watch is not None:
            watch(Progress(0.0, 0.0, 0, 0.0, math.nan, compiling=True))
        self.simulation = Simulation(case.problem(), threads, device)
        self.rows: list[dict[str, float]] = []
        self._last_sound = self._fields()
        self.peak_penetration = 0.0
        self.wall = 0.0
        self._loop_s = self._processor_s = 0.0
        self._forces: list[float] = []
        self._resume = resume
        self._resumed_to = -1.0
        self._checkpointed = time.monotonic()

    # -- the march --------------------------------------------------------------------------------------------------

    def go(self) -> None:
        """March through the outputs, keep what is computed whatever happens."""
        study = self.study
        output = study.model.output
        case = self.case
        self._warm_up()
        if self._resume:
            self._restore()
        else:
            write_whole(self.out / "study.toml", study.to_toml(_versions()))
        try:
            writer = ResultWriter(self.out, self.columns, self._fields(), resume=self._resume)
        except OSError as problem:
            raise ResultError(
                f"the result cannot be opened ({problem.strerror or problem})",
                file=self.out,
                hint="run anew without --resume" if self._resume else "choose another with --out",
            ) from None
        frames = np.linspace(case.begin, case.end, output.frames)
        rows = np.linspace(0.0, case.end, output.rows)
        stops = np.unique(np.concatenate([frames, rows]))
        frames_at, rows_at = set(frames.tolist()), set(rows.tolist())
        self._last_report = 0.0
        try:
            for stop in stops:
                if self._resume and stop <= self._resumed_to:
                    continue
                self._march(float(stop))
                if stop in rows_at:
                    writer.row(self._enter_row())
                if stop in frames_at:
                    self._frame(writer)
                if time.monotonic() - self._checkpointed > CHECKPOINT_SECONDS:
                    writer.settle()
                    self._checkpoint(float(stop))
            writer.settle()  # before the summary: it must not say done while a frame can still fail
            self._finish(writer, "done")
            (self.out / "checkpoint.npz").unlink(missing_ok=True)
        except KeyboardInterrupt:
            self._finish(writer, f"interrupted at {self.displacement:.2f} mm")
            raise
        except UnstableRun as problem:
            self._finish(writer, problem.message)
            raise
        except OSError as problem:
            # also what h5py makes of a full disk; what little still fits is worth more than none
            with contextlib.suppress(OSError):
                self._checkpoint(self.simulation.time)
            raise ResultError(
                f"the result could not be written ({problem.strerror or problem})",
                file=self.out,
                hint="make room and go on with --resume if there is a checkpoint.npz, or run anew with another --out",
            ) from None
        finally:
            writer.close()

    def _march(self, stop: float) -> None:
        """Advance, with the clock of the time loop running: output is not counted."""
        self._started = time.perf_counter() - self.wall
        begun, cpu = time.perf_counter(), time.process_time()
        try:
            self.simulation.advance_to(stop, self._look)
        finally:
            self.wall = time.perf_counter() - self._started
            self._loop_s += time.perf_counter() - begun
            self._processor_s += time.process_time() - cpu

    def _waiting(self) -> list[str]:
        """What to say where threads waited for processors; where a GPU computes, waiting is what they do."""
        if self.simulation.device != "cpu":
            return []
        return crowding(self.simulation.bands, usable_processors(), self._processor_s, self._loop_s)

    def _warm_up(self) -> None:
        """Compile, or load from the cache, before the clock starts and before anything is written."""
        self.simulation.compile()

    def _look(self, simulation: Simulation) -> None:
        if self.case.noisy_force:
            self._forces.append(self.case.force(simulation))
        self.peak_penetration = max(self.peak_penetration, simulation.penetration)
        now = time.perf_counter()
        if self.watch is not None and now - self._last_report > 0.1:
            self._last_report = now
            spent = now - self._started
            share = min(simulation.time / self.case.end, 1.0)
            self.watch(
                Progress(
                    share,
                    self.displacement,
                    simulation.steps,
                    self._rate(spent),
                    # the step shrinks as the yarns straighten, so the last part costs more than its share
                    spent * (1.0 - share) / max(share, 1e-9),
                )
            )

    def _rate(self, seconds: float) -> float:
        return seconds / max(self.simulation.steps * self.grid.cell_count, 1) * 1e9

    @property
    def displacement(self) -> float:
        """Stroke or displacement so far [mm]."""
        return self.case.displacement(self.simulation)

    def _fields(self) -> Fields:
        return Fields(self.grid, self.study.fabric, self.simulation.positions)

    def _frame(self, writer: ResultWriter) -> None:
        writer.frame(self.simulation.time, self.displacement, self._fields(), self.simulation.contact_forces)

    def _enter_row(self) -> dict[str, float]:
        """A row of the history."""
        simulation = self.simulation
        ledger: Ledger = simulation.ledger()
        fields = self._fields()
        n = self.grid.copies
        force = float(np.mean(self._forces)) if self._forces else self.case.force(simulation)
        self._forces.clear()
        self._last_sound = fields
        row = {
            "time_s": simulation.time,
            "displacement_mm": self.displacement,
            "force_N": force,
            "shear_angle_max_deg": math.degrees(simulation.largest_shear),
            "kinetic_energy_mJ": n * ledger.kinetic,
            "internal_energy_mJ": n * ledger.internal,
            "connector_energy_mJ": n * ledger.connectors,
            "membrane_energy_mJ": n * ledger.membrane,
            "hourglass_energy_mJ": n * ledger.hourglass,
            "contact_energy_mJ": n * ledger.contact,
            "friction_energy_mJ": n * ledger.friction,
            "damping_energy_mJ": n * ledger.damping,
            "external_work_mJ": n * ledger.work,
            "imbalance_mJ": n * ledger.imbalance,
            "step_s": simulation.step,
            "steps": float(simulation.steps),
            **self.case.row(simulation, fields, force),
        }
        self.rows.append(row)
        return row

    # -- the end ----------------------------------------------------------------------------------------------------

    def _finish(self, writer: ResultWriter, status: str) -> None:
        if status != "done" and self._sound:
            # the checkpoint before the frame, which may have to wait for slow writing
            writer.row(self._enter_row())
            self._checkpoint(self.simulation.time)
            self._frame(writer)
        writer.outline(self._last_sound)
        writer.summary(self.summary(status))

    @property
    def _sound(self) -> bool:
        """Whether the state is one of a run that has not blown up."""
        return bool(self.simulation.last[survey.FINITE])

    def summary(self, status: str) -> dict[str, Any]:
        """What ``summary.json`` says; after a blow-up of the last sound state."""
        study, grid, simulation = self.study, self.grid, self.simulation
        fields = self._last_sound
        energy = energy_summary(self.rows)
        warnings = doubts(
            energy,
            self.peak_penetration / study.fabric.thickness,
            inertia=simulation.largest_inertia,
            whole=status == "done",
        )
        values: dict[str, Any] = {
            "study": study.name,
            "ok": status == "done" and not warnings,
            "status": status,
            "warnings": warnings,
            "notes": [
                *self.case.warnings(),
                *beyond_the_laws(fields),
                *self._waiting(),
            ],
            "cells": grid.cell_count,
            "steps": simulation.steps,
            "wall_s": self.wall,
            "ns_per_cell_step": self._rate(self.wall),
            "threads": simulation.bands,
            "device": simulation.device,
            "device_name": simulation.device_name,
            "energy": energy,
            "shear_angle_deg": fields.shear_statistics(),
            "penetration_mm": self.peak_penetration,
            "penetration_share_of_thickness": self.peak_penetration / study.fabric.thickness,
            "mass_scaling": study.model.solver.mass_scaling * simulation.largest_inertia,
            "blank": blank_summary(study),
        }
        if self.rows:
            values.update(self.case.summary(self.rows, fields))
        return values

    # -- checkpoints ------------------------------------------------------------------------------------------------

    def _checkpoint(self, stop: float) -> None:
        state = self.simulation.checkpoint()
        extra = {
            "fabric": fingerprint(self.study),
            "history": np.array([[row[c] for c in self.columns] for row in self.rows]),
            "progress": np.array([stop, self.peak_penetration, self.wall]),
        }
        temporary = self.out / "checkpoint.part.npz"
        np.savez(temporary, allow_pickle=False, **state, **extra)
        os.replace(temporary, self.out / "checkpoint.npz")
        self._checkpointed = time.monotonic()

    def _restore(self) -> None:
        path = self.out / "checkpoint.npz"
        try:
            with np.load(path) as file:
                data = {name: file[name] for name in file.files}
        except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error):
            raise ResultError(
                "the checkpoint is damaged",
                file=path,
                hint="run anew without --resume; what was computed stays readable",
            ) from None
        try:
            if not np.array_equal(data["fabric"], fingerprint(self.study)):
                raise ValueError("the fabric card has changed")
            self.simulation.restore(data)
            self.rows = [dict(zip(self.columns, (float(v) for v in row), strict=True)) for row in data["history"]]
            self._resumed_to, self.peak_penetration, self.wall = (float(v) for v in data["progress"])
            self._last_sound = self._fields()
        except (ValueError, KeyError) as problem:
            raise ResultError(
                f"the checkpoint does not belong to this study ({problem})",
                file=path,
                hint="resume with the same study and changes, or run anew without --resume",
            ) from None


def _versions() -> str:
    import platform
    from importlib.metadata import version  # knows it without importing

    import h5py
    import numba

    from weftform import __version__

    return (
        f"{RESOLVED} {__version__} (Python {platform.python_version()}, numpy {np.__version__}, "
        f"numba {numba.__version__}, scipy {version('scipy')}, h5py {h5py.__version__})\n"
        "every default is written out: `weftform run` on this file repeats the run"
    )
