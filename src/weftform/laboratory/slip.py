"""Onset of yarn slip: where the measured shear angle leaves the kinematic one (Sec. 2.4.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weftform.fabric.laws import Floats

LEAST_CONFIDENCE = 0.99
LEAST_DEPARTURE_DEG = 1.0
"""Departure at the end of the test below which it is not called slip, whatever its significance: marker
tracking and the idealised kinematics agree no better than that."""
FEWEST_POINTS = 10
SHAPES = (("share",), ("even",), ("share", "even"), ("gradual",))


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
    offset_deg
        Kinematic minus measured angle before the onset [deg]: mostly the error of the first image, which
        all others share.
    """

    displacement: float | None
    interval: tuple[float, float] | None
    angle_deg: float | None
    confidence: float
    departure_deg: float
    noise_deg: float
    offset_deg: float

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

    The lag ``kinematic - measured`` is a constant (the angle of the first image has an error too) up to the
    onset ``d0``; beyond it grows by a share of the further kinematic angle, by an even amount per mm, by
    both, or gradually with ``(d - d0)^2``, whichever Bayes' information criterion prefers. A measured angle
    that stops, goes on at a lower share or at a lower even rate is followed exactly. For each ``d0`` the
    rest is linear; the best ``d0`` has the least sum of squares. Against "constant throughout" it is judged
    by an F test whose probability is multiplied by the number of onsets and shapes tried (Bonferroni); the
    interval holds every ``d0`` that scores, with any shape, within the 95 % point of chi square of the
    best. A gradual departure has a wide interval: its onset is not well defined.

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
        return SlipOnset(None, None, None, 0.0, 0.0, np.nan, 0.0)
    tried = np.linspace(d[0], d[-3], min(2 * n + 1, 401))  # twice as fine as the images
    null = float(((lag - lag.mean()) ** 2).sum())
    fits = [_best_onset(d, lag, kinematic, tried, shape) for shape in SHAPES]
    # Bayes' information criterion: constant, onset and shape are free.
    scores = np.array([n * np.log(np.maximum(fit.squares, 1e-12 * n)) + (2 + fit.terms) * np.log(n) for fit in fits])
    fit = fits[int(np.argmin(scores.min(axis=1)))]
    freedom = max(n - 2 - fit.terms, 1)
    smallest = max(fit.smallest, 1e-12 * n)
    noise = float(np.sqrt(smallest / freedom))
    onset, departure = fit.onset, fit.departure
    ratio = max(null - smallest, 0.0) / (1 + fit.terms) / (smallest / freedom)
    chance = min(1.0, float(f.sf(ratio, 1 + fit.terms, freedom)) * min(n, len(tried)) * len(fits))
    confidence = 1.0 - chance
    if confidence < least_confidence or departure < max(least_departure_deg, 2.0 * noise):
        return SlipOnset(None, None, None, confidence, departure, noise, float(lag.mean()))
    near = tried[(scores <= scores.min() + chi2.ppf(0.95, 1)).any(axis=0)]
    step = float(tried[1] - tried[0])
    return SlipOnset(
        displacement=onset,
        interval=(float(near.min()) - step, float(near.max()) + step),
        angle_deg=float(np.interp(onset, d, kinematic)),
        confidence=confidence,
        departure_deg=departure,
        noise_deg=noise,
        offset_deg=fit.offset,
    )


@dataclass(frozen=True, eq=False)
class _OnsetFit:
    """The best onset of one shape of lag: sums of squares per onset tried, and the lag gained at the end
    [deg]."""

    onset: float
    squares: Floats
    smallest: float
    departure: float
    offset: float
    terms: int


def _best_onset(d: Floats, lag: Floats, kinematic: Floats, tried: Floats, shape: tuple[str, ...]) -> _OnsetFit:
    squares, departures, offsets = (np.empty(len(tried)) for _ in range(3))
    rate = np.gradient(kinematic, d, edge_order=1) if np.all(np.diff(d) > 0) else np.ones(len(d))
    for k, onset in enumerate(tried):
        past = d > onset
        columns = [np.ones(len(d))]
        if "share" in shape:
            columns.append(np.where(past, kinematic - np.interp(onset, d, kinematic), 0.0))
        if "gradual" in shape:
            columns.append(np.where(past, (d - onset) ** 2, 0.0))
        if "even" in shape:
            columns.append(np.where(past, d - onset, 0.0))
        a = np.column_stack(columns)
        c = np.linalg.lstsq(a, lag, rcond=None)[0]
        first = float(c[1])
        if shape == ("share", "even"):
            first = float(c[1] * np.interp(onset, d, rate) + c[2])
        if first < 0.0:  # a lag that first shrinks is no slip
            squares[k], departures[k], offsets[k] = ((lag - lag.mean()) ** 2).sum(), 0.0, lag.mean()
            continue
        squares[k] = ((lag - a @ c) ** 2).sum()
        departures[k], offsets[k] = a[-1, 1:] @ c[1:], c[0]
    best = int(np.argmin(squares))
    return _OnsetFit(
        onset=float(tried[best]),
        squares=squares,
        smallest=float(squares[best]),
        departure=float(departures[best]),
        offset=float(offsets[best]),
        terms=len(shape),
    )
