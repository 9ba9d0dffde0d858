"""The measured shear angle of zone B as a smooth curve of displacement, with its uncertainty.

Angles enter Eq. 5 with high powers, so noise in them would bias the law and not only scatter it. Up to the
onset of slip the kinematic angle is the better measurement: it has no noise, and that it holds there is
what "no slip" means.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from weftform.fabric.laws import Floats
from weftform.laboratory.kinematics import kinematic_angle, kinematic_limit
from weftform.laboratory.markers import MarkerTracking
from weftform.laboratory.slip import SlipOnset, slip_onset
from weftform.laboratory.specimen import Specimen

ANCHOR = 1.0e3
"""Weight with which the measured branch is tied to the kinematic angle at the onset of slip."""


def measured_angles(specimens: Sequence[Specimen], tracking: Sequence[MarkerTracking]) -> tuple[Floats, Floats] | None:
    """Displacements [mm] and angles of zone B [deg], in order: of the markers, else of the angle columns; None without."""
    pairs = [(t.displacement, t.zone("B").mean) for t in tracking]
    if not pairs:
        pairs = [(s.x, s.angle) for s in specimens if s.angle is not None]
    if not pairs:
        return None
    displacement, angle = (np.concatenate(part) for part in zip(*pairs, strict=True))
    ok = np.isfinite(angle)
    if ok.sum() < 2:
        return None
    order = np.argsort(displacement[ok], kind="stable")
    return displacement[ok][order], angle[ok][order]


def slip_in_bias(displacement: Floats, angle_deg: Floats, height: float, width: float) -> SlipOnset:
    """Onset of slip in a bias test, from angles measured while the yarns without slip would not be parallel."""
    d, g = (v[displacement < kinematic_limit(height, width)] for v in (displacement, angle_deg))
    return slip_onset(d, g, np.degrees(kinematic_angle(d, height, width)))


@dataclass(frozen=True, eq=False)
class MeasuredAngle:
    """Angles of zone B measured at some displacements.

    Attributes
    ----------
    displacement, angle_deg
        Increasing [mm], and measured [deg]; shape [n].
    height, width
        Specimen [mm].
    slip
        What :func:`weftform.laboratory.slip.slip_onset` says of them.
    """

    displacement: Floats
    angle_deg: Floats
    height: float
    width: float
    slip: SlipOnset

    @classmethod
    def of(cls, displacement: Floats, angle_deg: Floats, height: float, width: float, slip: SlipOnset) -> MeasuredAngle:
        """From points in any order; several at one displacement are averaged, NaN is left out."""
        ok = np.isfinite(displacement) & np.isfinite(angle_deg)
        d, inverse = np.unique(displacement[ok], return_inverse=True)
        mean = np.bincount(inverse, weights=angle_deg[ok]) / np.maximum(np.bincount(inverse), 1)
        return cls(d, mean, height, width, slip)

    def at(self, displacement: Floats) -> Floats:
        """Smooth shear angle [rad] at displacements [mm]; NaN beyond the last measurement.

        With slip: the kinematic angle up to the onset, then a smoothing spline through the measured angles
        (less the common error of the first image) that starts from it. Without: kinematic angle less a
        smoothing spline of the lag.
        """
        d = np.asarray(displacement, float)
        kinematic = kinematic_angle(d, self.height, self.width)
        onset = self.slip.displacement
        if onset is None:
            lag = kinematic_angle(self.displacement, self.height, self.width) - np.radians(self.angle_deg)
            angle = kinematic - _spline(self.displacement, lag, np.ones(len(lag)), d)
        else:
            past = self.displacement > onset
            start = float(kinematic_angle(onset, self.height, self.width))
            x = np.append(onset, self.displacement[past])
            y = np.append(start, np.radians(self.angle_deg[past] + self.slip.offset_deg))
            weight = np.ones(len(x))
            weight[0] = ANCHOR
            angle = np.where(d <= onset, kinematic, _spline(x, y, weight, np.maximum(d, onset)))
        return np.where((d <= self.displacement[-1]) & (angle >= 0.0), angle, np.nan)

    def drawn_again(self, rng: np.random.Generator) -> MeasuredAngle:
        """The measurement as it might have come out: other noise, with the onset and offset it brings."""
        noise = self.slip.noise_deg if np.isfinite(self.slip.noise_deg) else 0.0
        error = noise * rng.standard_normal(len(self.displacement))
        slip = self.slip
        if slip.displacement is not None and slip.interval is not None:
            before = self.displacement <= slip.displacement
            shared = float(error[before].mean()) if before.any() else 0.0
            spread = (slip.interval[1] - slip.interval[0]) / 3.92
            onset = float(np.clip(slip.displacement + spread * rng.standard_normal(), 0.0, self.displacement[-1]))
            slip = replace(slip, displacement=onset, offset_deg=slip.offset_deg - shared)
        return replace(self, angle_deg=self.angle_deg + error, slip=slip)


def _spline(x: Floats, y: Floats, weight: Floats, at: Floats) -> Floats:
    """Cubic smoothing spline chosen by generalised cross-validation; straight between few points."""
    from scipy.interpolate import make_smoothing_spline

    inside = np.clip(at, x[0], x[-1])
    if len(x) < 6:
        return np.asarray(np.interp(inside, x, y))
    return np.asarray(make_smoothing_spline(x, y, w=weight)(inside))
