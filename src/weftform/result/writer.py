"""Writing a result folder while a run goes on: what is computed is on disk."""

from __future__ import annotations

import contextlib
import json
import os
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weftform.errors import ResultError
from weftform.exchange.vtkhdf import Series
from weftform.result.fields import Fields
from weftform.result.outline import formed_outline

Floats = NDArray[np.float64]

OURS = ("study.toml", "summary.json", "history.csv", "fields.vtkhdf", "outline.csv", "checkpoint.npz")

MOST_PENDING = 2
"""Frames that may wait to be written while the run goes on."""

RESOLVED = "resolved by weftform"
"""How the study of a result folder begins; nobody's own study does."""


def claim_folder(folder: Path, *, resume: bool = False) -> None:
    """Create the folder, or clear the former result out of it; anything else in it is left alone.

    Raises
    ------
    ResultError
        It cannot be written, holds files that are not ours, or ``resume`` finds nothing to go on from.
    """
    try:
        if resume:
            if not (folder / "checkpoint.npz").exists():
                raise ResultError(
                    "nothing to resume: there is no checkpoint",
                    file=folder,
                    hint="a run leaves one only where it was interrupted; run without --resume",
                )
            return
        if folder.is_dir() and any(folder.iterdir()) and not _is_result(folder):
            raise ResultError(
                "the folder holds other files",
                file=folder,
                expected="a new or empty folder, or a former result of weftform",
            )
        folder.mkdir(parents=True, exist_ok=True)
        for name in OURS:
            (folder / name).unlink(missing_ok=True)
        (folder / "comparison" / "comparison.json").unlink(missing_ok=True)
        for drawn in ("figures", "comparison"):
            for figure in (folder / drawn).glob("*.png"):
                figure.unlink()
        probe = folder / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as problem:
        raise ResultError(
            f"the folder cannot be written ({problem.strerror})",
            file=folder,
            hint="choose another with --out",
        ) from None


def _is_result(folder: Path) -> bool:
    """Whether a folder holds a former result; a study that somebody wrote does not make it one."""
    try:
        with (folder / "study.toml").open(encoding="utf-8") as file:
            return file.readline().startswith("# " + RESOLVED)
    except (OSError, UnicodeDecodeError):
        return False


def write_whole(path: Path, text: str) -> None:
    """Write a text file so that it is there whole or not at all."""
    temporary = path.with_name(path.name + ".part")
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)


class ResultWriter:
    """The files of a run in progress.

    Parameters
    ----------
    folder
        The claimed result folder.
    columns
        Names of the columns of ``history.csv``.
    initial
        Fields of the flat blank.
    resume
        Go on with the files of an interrupted run.
    """

    def __init__(self, folder: Path, columns: list[str], initial: Fields, *, resume: bool = False) -> None:
        self.folder = folder
        self.columns = columns
        grid = initial.grid
        self._active = grid.active
        number = np.full(grid.active.size, -1, np.int64)
        number[grid.active.ravel()] = np.arange(int(grid.active.sum()))
        indices, offsets, _ = grid.quads
        self._flat = grid.flat[grid.active]
        self._series = Series(
            folder / "fields.vtkhdf",
            number[indices],
            offsets,
            len(self._flat),
            ("displacement_mm",),
            resume=resume,
        )
        if not resume:
            (folder / "history.csv").write_text(",".join(columns) + "\n", encoding="utf-8")
        self._history = (folder / "history.csv").open("a", encoding="utf-8")
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="weftform-writer")
        self._pending: deque[Future[None]] = deque()

    def frame(self, time: float, displacement: float, fields: Fields, contact_force: Floats) -> None:
        """Add an instant to ``fields.vtkhdf``, beside the run that goes on; a former failure is raised here.

        ``fields`` and ``contact_force`` are kept until they are written, so they must not change.
        """
        self._settle(MOST_PENDING - 1)
        self._pending.append(self._worker.submit(self._write_frame, time, displacement, fields, contact_force))

    def settle(self) -> None:
        """Wait until every frame is on disk.

        Raises
        ------
        OSError
            One of them could not be written.
        """
        self._settle(0)

    def _settle(self, most: int) -> None:
        while self._pending and (len(self._pending) > most or self._pending[0].done()):
            self._pending.popleft().result()

    def _write_frame(self, time: float, displacement: float, fields: Fields, contact_force: Floats) -> None:
        try:
            self._append(time, displacement, fields, contact_force)
        except RuntimeError as problem:  # of h5py, whose HDF5 says no more than that it cannot write
            raise OSError(str(problem)) from None

    def _append(self, time: float, displacement: float, fields: Fields, contact_force: Floats) -> None:
        points = fields.positions[self._active]
        node_shear = np.degrees(fields.node_shear[self._active])
        self._series.append(
            time,
            points,
            {
                "ContactForce_N": contact_force[self._active],
                "Displacement_mm": points - self._flat,
                "ShearAngle_deg": np.nan_to_num(node_shear),
            },
            fields.cell_data(),
            displacement_mm=displacement,
        )

    def row(self, values: dict[str, float]) -> None:
        """Add a row to ``history.csv``."""
        self._history.write(",".join(f"{values[name]:.9g}" for name in self.columns) + "\n")
        self._history.flush()

    def outline(self, fields: Fields) -> None:
        """Write ``outline.csv``: the edge of the whole blank, flat and formed."""
        flat, formed, modelled = formed_outline(fields.grid, fields.positions)
        lines = ["flat_x_mm,flat_y_mm,formed_x_mm,formed_y_mm,formed_z_mm,modelled"]
        lines += [
            ",".join(f"{v:.6f}" for v in (*a, *b)) + f",{int(m)}"
            for a, b, m in zip(flat, formed, modelled, strict=True)
        ]
        write_whole(self.folder / "outline.csv", "\n".join(lines) + "\n")

    def summary(self, values: dict[str, Any]) -> None:
        """Write ``summary.json``."""
        write_whole(self.folder / "summary.json", json.dumps(values, indent=2) + "\n")

    def close(self) -> None:
        """Write what is pending and close all files."""
        self._worker.shutdown(wait=True)
        # a file that failed before fails again when it is closed; that was said already
        for part in (self._series, self._history):
            with contextlib.suppress(OSError, RuntimeError):
                part.close()
