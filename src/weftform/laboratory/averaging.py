"""Mean curve of several specimens on a common grid, with its scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats
from weftform.laboratory.specimen import Specimen


@dataclass(frozen=True, eq=False)
class MeanCurve:
    """Average of specimens.

    Attributes
    ----------
    x
        Common grid over the range that every specimen covers, shape [m].
    mean, deviation
        Mean and standard deviation between specimens at each ``x``, shape [m]; the deviation is NaN for one
        specimen.
    lowest, highest
        Envelope of the specimens, shape [m].
    specimens
        How many.
    """

    x: Floats
    mean: Floats
    deviation: Floats
    lowest: Floats
    highest: Floats
    specimens: int


def average(specimens: Sequence[Specimen], *, points: int = 201) -> MeanCurve:
    """Average on a common grid by monotone cubic interpolation of each curve, whatever its sampling.

    Raises
    ------
    MeasurementError
        The specimens have no range in common.
    """
    from scipy.interpolate import PchipInterpolator

    start, end = max(float(s.x[0]) for s in specimens), min(float(s.x[-1]) for s in specimens)
    if not end > start:
        raise MeasurementError(
            "the specimens have no displacement in common",
            expected="curves that overlap",
            got="; ".join(f"{s.name}: {s.x[0]:.4g} to {s.x[-1]:.4g}" for s in specimens)[:400],
        )
    grid = np.linspace(start, end, points)
    curves = np.array([PchipInterpolator(s.x, s.y)(grid) for s in specimens])
    n = len(specimens)
    return MeanCurve(
        x=grid,
        mean=curves.mean(axis=0),
        deviation=curves.std(axis=0, ddof=1) if n > 1 else np.full(points, np.nan),
        lowest=curves.min(axis=0),
        highest=curves.max(axis=0),
        specimens=n,
    )
