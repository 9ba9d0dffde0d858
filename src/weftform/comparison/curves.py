"""The measured force curve beside that of the simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from weftform.errors import MeasurementError, ResultError
from weftform.laboratory.averaging import MeanCurve, average
from weftform.laboratory.presets import Quantity
from weftform.laboratory.specimen import Reading, Specimen, read_specimens
from weftform.result.loading import loading_curve

if TYPE_CHECKING:
    from weftform.result import Result

Floats = NDArray[np.float64]

POINTS = 501
"""Of the common range at which forces are subtracted."""


@dataclass(frozen=True, eq=False)
class CurveComparison:
    """Forces over the displacements that both curves cover.

    Attributes
    ----------
    specimens
        As read.
    mean
        Of the specimens.
    way
        Common displacements [mm], shape [points].
    measured, simulated
        Forces there [N], shape [points].
    history
        The whole simulated curve: displacement [mm] and force [N].
    warnings
        What was done to read and compare.
    """

    specimens: tuple[Specimen, ...]
    mean: MeanCurve
    way: Floats
    measured: Floats
    simulated: Floats
    history: tuple[Floats, Floats]
    warnings: tuple[str, ...]

    @property
    def difference(self) -> Floats:
        """Simulated less measured force [N], shape [points]."""
        return self.simulated - self.measured

    @property
    def peak(self) -> float:
        """Largest size of the measured force over the common range [N]."""
        return float(np.abs(self.measured).max())

    @property
    def rms(self) -> float:
        """Root mean square difference over the common range [N]."""
        return float(np.sqrt(np.trapezoid(self.difference**2, self.way) / np.ptp(self.way)))

    @property
    def largest(self) -> float:
        """Largest difference [N]."""
        return float(np.abs(self.difference).max())

    def as_dict(self) -> dict[str, Any]:
        """For ``comparison.json``."""
        worst = int(np.abs(self.difference).argmax())
        return {
            "files": [{"file": str(s.file), "sha256": s.sha256, "specimen": s.name} for s in self.specimens],
            "overlap_mm": [float(self.way[0]), float(self.way[-1])],
            "peak_N": self.peak,
            "simulated_peak_N": float(np.abs(self.simulated).max()),
            "rms_N": self.rms,
            "rms_percent": 100.0 * self.rms / self.peak,
            "max_N": self.largest,
            "max_percent": 100.0 * self.largest / self.peak,
            "max_at_mm": float(self.way[worst]),
        }


def compare_curves(
    result: Result,
    files: Sequence[Path | str],
    reading: Reading = Reading(),  # noqa: B008 (frozen)
) -> CurveComparison:
    """Subtract the measured force from the simulated one where both curves go.

    Several specimens, in one file or several, are averaged first.

    Raises
    ------
    MeasurementError
        A file cannot be read, or the curves have no displacement in common.
    ResultError
        The result has no history of forces.
    """
    specimens = read_specimens(files, Quantity.DISPLACEMENT, Quantity.FORCE, reading)
    mean = average(specimens)
    way, force, notes = _loading(result)
    start, end = max(float(mean.x[0]), float(way[0])), min(float(mean.x[-1]), float(way[-1]))
    if not end > start:
        raise MeasurementError(
            "the curves have no displacement in common",
            file=specimens[0].file,
            expected=f"displacements between {way[0]:.4g} and {way[-1]:.4g} mm, which were simulated",
            got=f"{mean.x[0]:.4g} to {mean.x[-1]:.4g} mm",
            hint="is the unit right? --zero shifts the test so that it starts at zero",
        )
    grid = np.linspace(start, end, POINTS)
    measured = np.interp(grid, mean.x, mean.mean)
    if not np.abs(measured).max() > 0.0:
        raise MeasurementError(
            "the measured force vanishes over the common range",
            file=specimens[0].file,
            got=f"no force between {start:.4g} and {end:.4g} mm",
        )
    longest = max(float(mean.x[-1]), float(way[-1]))
    if end - start < 0.5 * longest:
        notes.append(
            f"the curves have only {start:.4g} to {end:.4g} mm in common (measured to {mean.x[-1]:.4g}, simulated "
            f"to {way[-1]:.4g} mm)"
        )
    said = (*(w for s in specimens for w in s.warnings), *notes)
    return CurveComparison(specimens, mean, grid, measured, np.interp(grid, way, force), (way, force), said)


def _loading(result: Result) -> tuple[Floats, Floats, list[str]]:
    """Simulated displacement and force up to the first largest displacement, one row for each displacement."""
    history = result.history
    missing = [name for name in ("displacement_mm", "force_N") if name not in history]
    if missing:
        raise ResultError(
            "the history has no force curve",
            file=result.folder / "history.csv",
            expected="columns displacement_mm and force_N",
            got=", ".join(history)[:200],
        )
    whole = history["displacement_mm"]
    way, force = loading_curve(whole, history["force_N"])
    if len(way) < 2:
        raise ResultError(
            "the history has no way along which forces can be compared", file=result.folder / "history.csv"
        )
    notes = []
    back = whole[int(np.nanargmax(whole)) :]
    if np.nanmax(back) - np.nanmin(back) > 0.01 * (np.nanmax(whole) - np.nanmin(whole)):
        notes.append(f"the simulated curve is taken to its first largest displacement, {way[-1]:.4g} mm")
    return way, force, notes
