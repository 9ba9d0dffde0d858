"""Curves to meet: read, cut to the range that the model describes, weighted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from weftform.errors import IdentificationError, MeasurementError
from weftform.fabric.laws import Floats
from weftform.identification.loading import travel
from weftform.laboratory.fitting import RELATIVE_FLOOR
from weftform.laboratory.markers import MarkerTracking
from weftform.laboratory.measured_angle import measured_angles, slip_in_bias
from weftform.laboratory.presets import Quantity
from weftform.laboratory.specimen import Reading, Specimen, read_specimens
from weftform.result.loading import loading_curve
from weftform.study.schema import BiasModel
from weftform.study.study import Study

Weighting = Literal["relative", "uniform"]
FEWEST_POINTS = 3
"""A curve with fewer points in its range is refused."""


@dataclass(frozen=True)
class Target:
    """A measured curve and what it is compared with.

    Attributes
    ----------
    curve
        File of force against displacement, one specimen or several.
    study
        Study that simulates the test: an object, a shipped name or a file; the one being identified without.
    weight
        Of the curve in the misfit; a file with several specimens shares it among them.
    range_mm
        Displacements that count; the whole curve without.
    """

    curve: Path | str
    study: Study | str | Path | None = None
    weight: float = 1.0
    range_mm: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.weight) and self.weight > 0.0):
            raise IdentificationError("a weight must be positive", key="--weight", got=f"{self.weight:g}")
        if self.range_mm is not None and not 0.0 <= self.range_mm[0] < self.range_mm[1] < np.inf:
            raise IdentificationError(
                "the range is empty, reversed or negative",
                key="--range",
                expected="LO..HI in mm, 0 <= LO < HI",
                got=f"{self.range_mm[0]:g}..{self.range_mm[1]:g}",
            )


@dataclass(frozen=True, eq=False)
class Curve:
    """One specimen, ready to be compared.

    Attributes
    ----------
    specimen
        As measured, the whole of it.
    study
        Index of the study that simulates it.
    displacement, force
        Points that count [mm], [N], shape [n].
    size
        Size of an error at each point [N], shape [n].
    weight
        Of the curve.
    slip_mm
        Onset of slip where it was looked for and found [mm].
    """

    specimen: Specimen
    study: int
    displacement: Floats
    force: Floats
    size: Floats
    weight: float
    slip_mm: float | None = None

    def residuals(self, displacement: Floats, force: Floats) -> Floats:
        """Weighted errors of a simulated curve, shape [n]; their squares sum to weight times mean square error."""
        return np.asarray(
            np.sqrt(self.weight / len(self.force))
            * (interpolated(displacement, force, self.displacement) - self.force)
            / self.size
        )


def interpolated(displacement: Floats, force: Floats, at: Floats) -> Floats:
    """Force of a simulated curve [N] at displacements [mm], by monotone cubics between its rows."""
    from scipy.interpolate import PchipInterpolator

    return np.asarray(PchipInterpolator(*loading_curve(displacement, force), extrapolate=False)(at))


def read_target(
    target: Target,
    study: Study,
    index: int,
    *,
    reading: Reading,
    weighting: Weighting,
    until_slip: bool,
    tracking: Sequence[MarkerTracking],
) -> tuple[list[Curve], list[str]]:
    """Curves of a target, and what was done to them.

    Parameters
    ----------
    study, index
        The study that simulates the target, and its number.
    until_slip
        End a bias-extension curve where the measured shear angle leaves the kinematic one.
    tracking
        Marker measurements that say so, beside a column of measured angles in the file.

    Raises
    ------
    MeasurementError, IdentificationError
        The file cannot be used, has no point in the range or within the travel of the study, or no measured angle.
    """
    specimens = read_specimens([target.curve], Quantity.DISPLACEMENT, Quantity.FORCE, reading, angle=until_slip)
    notes = [note for s in specimens for note in s.warnings]
    end = travel(study)
    curves = []
    for s in specimens:
        low, high = target.range_mm or (0.0, np.inf)
        slip = None
        if until_slip and isinstance(study.model, BiasModel):
            slip, note = _slip(s, study.model, tracking)
            notes.append(note)
            high = min(high, np.inf if slip is None else slip)
        # at no displacement there is no force to compare
        wanted = (s.x >= low) & (s.x <= high) & (s.x > 0.0)
        within = wanted & (s.x <= end)
        count = int(within.sum())
        if count < FEWEST_POINTS:
            asked = f"{max(low, float(s.x[0])):.4g} to {min(high, float(s.x[-1])):.4g}"
            raise IdentificationError(
                f"{s.name}: {count} points lie in the range that is compared",
                file=s.file,
                expected=f"{FEWEST_POINTS} at least within the travel of {study.name}, 0 to {end:.4g} mm",
                got=f"measured displacements {s.x[0]:.4g} to {s.x[-1]:.4g} mm, of which {asked} mm are asked for",
                hint="are the units right (--unit displacement=mm), and the range?",
            )
        beyond = int(wanted.sum()) - count
        if beyond:
            notes.append(f"{s.name}: {beyond} points beyond {end:.4g} mm, where {study.name} ends, are left out")
        curves.append(
            Curve(
                specimen=s,
                study=index,
                displacement=s.x[within],
                force=s.y[within],
                size=_size_of_errors(s.y[within], weighting, s),
                weight=target.weight / len(specimens),
                slip_mm=slip,
            )
        )
    return curves, notes


def _size_of_errors(force: Floats, weighting: Weighting, specimen: Specimen) -> Floats:
    """Largest force of the curve, or the force at each point but at least a small share of the largest.

    The force is smoothed first: weighting by a noisy value favours every point that errs downwards.
    """
    from scipy.ndimage import uniform_filter1d

    largest = float(np.abs(force).max())
    if not largest > 0.0:
        raise MeasurementError(f"{specimen.name}: no force in the range that is compared", file=specimen.file)
    if weighting == "uniform":
        return np.full(len(force), largest)
    smooth = uniform_filter1d(force, max(1, len(force) // 40) | 1, mode="nearest")
    return np.asarray(np.maximum(np.abs(smooth), RELATIVE_FLOOR * largest))


def _slip(s: Specimen, model: BiasModel, tracking: Sequence[MarkerTracking]) -> tuple[float | None, str]:
    """Onset of slip [mm] of a specimen, from the markers or its own column of angles, and a sentence about it."""
    height, width = model.specimen.length_mm, model.specimen.width_mm
    measured = measured_angles([s], tracking)
    if measured is None:
        raise IdentificationError(
            f"{s.name}: no measured shear angle, so slip cannot be seen",
            file=s.file,
            key="--until-slip",
            expected="a column shear_angle_deg, or --markers and --layout",
            hint="give the end yourself: --range 0..16",
        )
    found = slip_in_bias(*measured, height, width)
    if found.displacement is None:
        return None, f"{s.name}: no slip found, the whole curve counts"
    return found.displacement, f"{s.name}: yarns slip from {found.displacement:.4g} mm on; the curve counts up to there"
