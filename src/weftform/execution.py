"""Running a study: the simulation, its history and summary, and the result folder."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from weftform.blank.outline import diagonal_angle
from weftform.errors import StudyError, UnstableRun
from weftform.result import Result
from weftform.result.fields import Fields
from weftform.result.outline import draw_in, formed_outline
from weftform.result.writer import RESOLVED, ResultWriter, claim_folder, write_whole
from weftform.solver import Ledger, Simulation, survey
from weftform.study import Study
from weftform.study.problem import forming_problem

MOST_IMBALANCE = 0.01
"""Largest share of the work that the ledger may miss."""
MOST_KINETIC = 0.05
"""Largest share of kinetic in internal energy once the fabric is loaded."""
LOADED_FROM = 0.01
"""The fabric counts as loaded once its internal energy exceeds this share of its final value."""
MOST_PENETRATION = 0.05
"""Largest penetration into a tool as a share of the thickness."""
CELLS_PER_THREAD = 1500
"""Cells for which another thread pays."""
CHECKPOINT_SECONDS = 20.0
"""Wall time between checkpoints of a long run."""

HISTORY = [
    "time_s",
    "displacement_mm",
    "force_N",
    "holder_displacement_mm",
    "holder_reaction_N",
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
    "penetration_mm",
    "step_s",
    "steps",
]


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


def threads_for(cells: int, wanted: int | None) -> int:
    """Threads to use: those asked for, or as many as pay for the size of the blank.

    Raises
    ------
    StudyError
        Less than one, or more than Numba may start.
    """
    import numba

    most = int(numba.config.NUMBA_NUM_THREADS)
    if wanted is None:
        available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        return max(1, min(available, most, cells // CELLS_PER_THREAD))
    if not 1 <= wanted <= most:
        raise StudyError(
            "that number of threads cannot be had",
            key="--threads",
            expected=f"1 to {most}",
            got=str(wanted),
            hint="more threads than processors only wait for each other",
        )
    return wanted


def run(
    study: Study | str | Path,
    out: str | Path,
    *,
    threads: int | None = None,
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
    resume
        Go on from the checkpoint of an interrupted run in ``out``.
    watch
        Called several times a second with a :class:`Progress`.

    Returns
    -------
    The result, opened.

    Raises
    ------
    StudyError, CardError, ResultError
        Nothing was written.
    UnstableRun
        The run blew up; the result folder holds all that was computed before.
    KeyboardInterrupt
        Likewise, with a checkpoint to resume from.
    """
    if not isinstance(study, Study):
        study = Study.load(study)
    out = Path(out)
    threads = threads_for(study.grid.cell_count, threads)
    claim_folder(out, resume=resume)
    FormingRun(study, out, threads, watch, resume).go()
    return Result.open(out)


class FormingRun:
    """One run of a forming study."""

    def __init__(self, study: Study, out: Path, threads: int, watch: Watch | None, resume: bool) -> None:
        self.study = study
        self.out = out
        self.watch = watch
        self.grid = study.grid
        if watch is not None:
            watch(Progress(0.0, 0.0, 0, 0.0, math.nan, compiling=True))
        self.simulation = Simulation(forming_problem(study), threads)
        self.copies = self.grid.copies
        loading = study.model.loading
        self.end = loading.closing_s + loading.duration_s
        self.punch = next(k for k, tool in enumerate(study.tools) if tool.motion == "stroke")
        self.holder = next((k for k, tool in enumerate(study.tools) if tool.motion == "force"), None)
        self.rows: list[dict[str, float]] = []
        self._last_sound = self._fields()
        self.peak_penetration = 0.0
        self.peak_speed_step = 0
        self.wall = 0.0
        self._forces: list[tuple[float, float]] = []
        self._frame = 0
        self._row = 0
        self._resume = resume
        self._checkpointed = time.monotonic()

    # -- the march --------------------------------------------------------------------------------------------------

    def go(self) -> None:
        """March through the outputs, keep what is computed whatever happens."""
        study, simulation = self.study, self.simulation
        output = study.model.output
        loading = study.model.loading
        if self._resume:
            self._restore()
        else:
            write_whole(self.out / "study.toml", study.to_toml(_versions()))
        writer = ResultWriter(self.out, HISTORY, self._fields(), resume=self._resume)
        frames = loading.closing_s + np.linspace(0.0, loading.duration_s, output.frames)
        rows = np.linspace(0.0, self.end, output.rows)
        stops = np.unique(np.concatenate([frames, rows]))
        frames_at, rows_at = set(frames.tolist()), set(rows.tolist())
        self._warm_up()
        self._last_report = 0.0
        try:
            for stop in stops:
                if self._resume and stop <= self._resumed_to:
                    continue
                self._march(float(stop))
                if stop in rows_at:
                    writer.row(self._enter_row())
                if stop in frames_at:
                    writer.frame(simulation.time, self.stroke, self._fields(), simulation.contact_forces)
                if time.monotonic() - self._checkpointed > CHECKPOINT_SECONDS:
                    self._checkpoint(float(stop))
            self._finish(writer, "done")
            (self.out / "checkpoint.npz").unlink(missing_ok=True)
        except KeyboardInterrupt:
            self._finish(writer, f"interrupted at a stroke of {self.stroke:.2f} mm")
            raise
        except UnstableRun as problem:
            self._finish(writer, problem.message)
            raise
        finally:
            writer.close()

    def _march(self, stop: float) -> None:
        """Advance, with the clock of the time loop running: output is not counted."""
        self._started = time.perf_counter() - self.wall
        try:
            self.simulation.advance_to(stop, self._look)
        finally:
            self.wall = time.perf_counter() - self._started

    def _warm_up(self) -> None:
        """Compile, or load from the cache, before the clock starts."""
        self.simulation.compile()

    def _look(self, simulation: Simulation) -> None:
        self._forces.append((simulation.time, abs(simulation.tool_reaction(self.punch)) * self.copies))
        self.peak_penetration = max(self.peak_penetration, simulation.penetration)
        now = time.perf_counter()
        if self.watch is not None and now - self._last_report > 0.1:
            self._last_report = now
            spent = now - self._started
            share = min(simulation.time / self.end, 1.0)
            self.watch(
                Progress(
                    share,
                    self.stroke,
                    simulation.steps,
                    self._rate(spent),
                    # the step shrinks as the yarns straighten, so the last part costs more than its share
                    spent * (1.0 - share) / max(share, 1e-9),
                )
            )

    def _rate(self, seconds: float) -> float:
        return seconds / max(self.simulation.steps * self.grid.cell_count, 1) * 1e9

    @property
    def stroke(self) -> float:
        """Way of the punch [mm]."""
        return abs(self.simulation.tool_position(self.punch))

    def _fields(self) -> Fields:
        return Fields(self.grid, self.study.fabric, self.simulation.positions)

    def _enter_row(self) -> dict[str, float]:
        """A row of the history; forces are means over the time since the last row."""
        simulation = self.simulation
        ledger: Ledger = simulation.ledger()
        n = self.copies
        force = (
            float(np.mean([f for _, f in self._forces]))
            if self._forces
            else abs(simulation.tool_reaction(self.punch)) * n
        )
        self._forces.clear()
        holder = self.holder
        self._last_sound = self._fields()
        row = {
            "time_s": simulation.time,
            "displacement_mm": self.stroke,
            "force_N": force,
            "holder_displacement_mm": simulation.tool_position(holder) if holder is not None else 0.0,
            "holder_reaction_N": abs(simulation.tool_reaction(holder)) * n if holder is not None else 0.0,
            "shear_angle_max_deg": self._last_sound.largest_shear(),
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
            "penetration_mm": simulation.penetration,
            "step_s": simulation.step,
            "steps": float(simulation.steps),
        }
        self.rows.append(row)
        return row

    # -- the end ----------------------------------------------------------------------------------------------------

    def _finish(self, writer: ResultWriter, status: str) -> None:
        if status != "done" and self._sound:
            writer.row(self._enter_row())
            writer.frame(self.simulation.time, self.stroke, self._fields(), self.simulation.contact_forces)
            self._checkpoint(self.simulation.time)
        writer.outline(self._last_sound)
        writer.summary(self.summary(status))

    @property
    def _sound(self) -> bool:
        """Whether the state is one of a run that has not blown up."""
        return bool(self.simulation.last[survey.FINITE])

    def summary(self, status: str) -> dict[str, Any]:
        """What ``summary.json`` says."""
        study, grid, simulation = self.study, self.grid, self.simulation
        fields = self._last_sound
        energy = energy_summary(self.rows)
        warnings = self._warnings(energy)
        values: dict[str, Any] = {
            "study": study.name,
            "ok": status == "done" and not warnings,
            "status": status,
            "warnings": warnings,
            "cells": grid.cell_count,
            "steps": simulation.steps,
            "wall_s": self.wall,
            "ns_per_cell_step": self._rate(self.wall),
            "threads": simulation.bands,
            "energy": energy,
            "shear_angle_deg": fields.shear_statistics(),
            "punch_force_N": self.rows[-1]["force_N"] if self.rows else 0.0,
            "stroke_mm": self.stroke,
            "holder_displacement_mm": self.rows[-1]["holder_displacement_mm"] if self.rows else 0.0,
            "penetration_mm": self.peak_penetration,
            "penetration_share_of_thickness": self.peak_penetration / study.fabric.thickness,
            "blank": blank_summary(study),
        }
        flat, formed, _ = formed_outline(grid, fields.positions)
        values["draw_in_mm"] = draw_in(flat, formed, diagonal_angle(study.outline))
        return values

    def _warnings(self, energy: dict[str, float]) -> list[str]:
        found = []
        if energy["balance_error"] > MOST_IMBALANCE:
            found.append(
                f"the energy ledger misses {100 * energy['balance_error']:.2g} % of the work (limit 1 %): lower solver.safety"
            )
        if energy["kinetic_over_internal"] > MOST_KINETIC:
            found.append(
                f"kinetic energy reaches {100 * energy['kinetic_over_internal']:.2g} % of the internal energy (limit 5 %): "
                "lengthen loading.duration_s"
            )
        share = self.peak_penetration / self.study.fabric.thickness
        if share > MOST_PENETRATION:
            found.append(
                f"the fabric sinks {100 * share:.2g} % of its thickness into a tool (limit 5 %): raise "
                "contact.*.stiffness_N_per_mm3"
            )
        return found

    # -- checkpoints ------------------------------------------------------------------------------------------------

    def _checkpoint(self, stop: float) -> None:
        state = self.simulation.checkpoint()
        extra = {
            "history": np.array([[row[c] for c in HISTORY] for row in self.rows]),
            "progress": np.array([stop, self.peak_penetration, self.wall]),
        }
        temporary = self.out / "checkpoint.part.npz"
        np.savez(temporary, **state, **extra)
        os.replace(temporary, self.out / "checkpoint.npz")
        self._checkpointed = time.monotonic()

    def _restore(self) -> None:
        from weftform.errors import ResultError

        path = self.out / "checkpoint.npz"
        try:
            with np.load(path) as data:
                self.simulation.restore({k: data[k] for k in data.files})
                self.rows = [dict(zip(HISTORY, (float(v) for v in row), strict=True)) for row in data["history"]]
                self._resumed_to, self.peak_penetration, self.wall = (float(v) for v in data["progress"])
                self._last_sound = self._fields()
        except (OSError, ValueError, KeyError) as problem:
            raise ResultError(
                f"the checkpoint does not belong to this study ({problem})",
                file=path,
                hint="resume with the same study and changes, or run anew without --resume",
            ) from None

    _resumed_to = -1.0


def energy_summary(rows: list[dict[str, float]]) -> dict[str, float]:
    """Quality of the energy ledger over a history, and its last entry [mJ]."""
    if not rows:
        return {"balance_error": 0.0, "kinetic_over_internal": 0.0}
    work = max(abs(row["external_work_mJ"]) for row in rows)
    final = rows[-1]
    loaded = [row for row in rows if row["internal_energy_mJ"] > LOADED_FROM * final["internal_energy_mJ"] > 0.0]
    return {
        "balance_error": max(abs(row["imbalance_mJ"]) for row in rows) / work if work > 0.0 else 0.0,
        "kinetic_over_internal": max(
            (row["kinetic_energy_mJ"] / row["internal_energy_mJ"] for row in loaded), default=0.0
        ),
        **{name: final[name] for name in final if name.endswith("_mJ")},
    }


def blank_summary(study: Study) -> dict[str, float | int | str]:
    """Size, mesh and area of the blank, and how far the mesh departs from the declared outline."""
    grid = study.grid
    return {
        "warp_cell_length_mm": grid.warp_pitch,
        "weft_cell_length_mm": grid.weft_pitch,
        "warp_angle_deg": math.degrees(grid.warp_angle),
        "symmetry": study.model.blank.symmetry,
        "half_cells": int((grid.cells > 1).sum()),
        "area_mm2": grid.area * grid.copies,
        "area_error": grid.area / grid.requested_area - 1.0,
        "mass_kg": 1e3 * study.fabric.areal_density * grid.area * grid.copies,
    }


def _versions() -> str:
    import platform

    import h5py
    import numba
    import scipy

    from weftform import __version__

    return (
        f"{RESOLVED} {__version__} (Python {platform.python_version()}, numpy {np.__version__}, "
        f"numba {numba.__version__}, scipy {scipy.__version__}, h5py {h5py.__version__})\n"
        "every default is written out: `weftform run` on this file repeats the run"
    )


__all__ = ["FormingRun", "Progress", "run", "threads_for"]
