"""Onset of yarn slip: where the measured shear angle leaves the kinematic one (Sec. 2.4.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weftform.fabric.laws import Floats

LEAST_CONFIDENCE = 0.99
LEAST_DEPARTURE_DEG = 1.0
"""Departure at the end of the test below which it is not called slip, whatever its significance: marker tracking and
the idealised kinematics agree no better than that."""
FEWEST_POINTS = 10


@dataclass(frozen=True)
class SlipOnset:
    """Where slip begins.

    Attributes
    ----------
    displacement
        Onset [mm]; None where no slip is found.
    interval
        95 % likelihood interval of the onset [mm].
    angle_deg
        Kinematic shear angle at the onset [deg].
    confidence
        1 - the probability that noise alone departs as clearly anywhere in the test.
    departure_deg
        Kinematic minus measured angle at the end of the test, by the fitted line [deg].
    noise_deg
        Standard deviation of the measured angle about the fit [deg].
    """

    displacement: float | None
    interval: tuple[float, float] | None
    angle_deg: float | None
    confidence: float
    departure_deg: float
    noise_deg: float

    @property
    def found(self) -> bool:
        return self.displacement is not None


def slip_onset(
    displacement: Floats,
    measured_deg: Floats,
    kinematic_deg: Floats,
    *,
    least_confidence: float = LEAST_CONFIDENCE,
    least_departure_deg: float = LEAST_DEPARTURE_DEG,
) -> SlipOnset:
    """Find where the measured angle falls behind the kinematic one.

    The lag ``kinematic - measured`` is a constant (the angle of the first image has an error too) up to the onset ``d0``, and
    ``s (d - d0) + q (d - d0)^2`` more beyond it. For each ``d0`` the rest is linear; the best ``d0`` has the least sum of
    squares. Against "constant throughout" it is judged by an F test whose probability is multiplied by the number of onsets
    tried (Bonferroni); the interval holds every ``d0`` whose likelihood ratio is within the 95 % point of chi square.

    Parameters
    ----------
    displacement, measured_deg, kinematic_deg
        Shape [n]; NaN in the measured angle is left out.
    least_confidence, least_departure_deg
        Below either no slip is reported.
    """
    from scipy.stats import chi2, f

    ok = np.isfinite(measured_deg) & np.isfinite(displacement) & np.isfinite(kinematic_deg)
    order = np.argsort(displacement[ok], kind="stable")
    d, lag = displacement[ok][order], (kinematic_deg - measured_deg)[ok][order]
    kinematic = kinematic_deg[ok][order]
    n = len(d)
    if n < FEWEST_POINTS:
        return SlipOnset(None, None, None, 0.0, 0.0, np.nan)
    span = float(d[-1] - d[0])
    tried = np.linspace(d[0], d[-3], 401)
    null = float(((lag - lag.mean()) ** 2).sum())
    rest = np.empty(len(tried))
    fits = np.empty((len(tried), 3))
    for k, onset in enumerate(tried):
        past = np.maximum(d - onset, 0.0) / span
        a = np.column_stack([np.ones(n), past, past**2])
        c = np.linalg.lstsq(a, lag, rcond=None)[0]
        if c[1] < 0.0:  # a lag that first shrinks is no slip
            c = np.zeros(3)
            c[[0, 2]] = np.linalg.lstsq(a[:, [0, 2]], lag, rcond=None)[0]
        fits[k], rest[k] = c, ((lag - a @ c) ** 2).sum()
    best = int(np.argmin(rest))
    smallest = max(float(rest[best]), 1e-12 * n)
    noise = float(np.sqrt(smallest / max(n - 4, 1)))
    onset = float(tried[best])
    past = (d[-1] - onset) / span
    departure = float(fits[best, 1] * past + fits[best, 2] * past**2)
    ratio = max(null - smallest, 0.0) / 3.0 / (smallest / max(n - 4, 1))
    chance = min(1.0, float(f.sf(ratio, 3, max(n - 4, 1))) * min(n, len(tried)))
    confidence = 1.0 - chance
    if confidence < least_confidence or departure < max(least_departure_deg, 2.0 * noise):
        return SlipOnset(None, None, None, confidence, departure, noise)
    near = tried[n * np.log(np.maximum(rest, 1e-12 * n) / smallest) <= chi2.ppf(0.95, 1)]
    return SlipOnset(
        displacement=onset,
        interval=(float(near.min()), float(near.max())),
        angle_deg=float(np.interp(onset, d, kinematic)),
        confidence=confidence,
        departure_deg=departure,
        noise_deg=noise,
    )
