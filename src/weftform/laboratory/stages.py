"""Stages of a curve: the straight part of a tensile test, placing / transition / locking of a shear curve."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from weftform.fabric.laws import Floats, Law

STRAIGHT_WITHIN = 0.01
"""The linear stage of a tensile test stays within this share of the largest force of its own straight
line."""
STIFFNESS_RATIO = 10.0
LEAST_STEEPENING = 2.0
"""Locking needs a last slope of so many times the slope before it; a curve that bends less has not locked."""


@dataclass(frozen=True)
class TensileStages:
    """The three stages of Sec. 2.4.1.

    Attributes
    ----------
    crimp_end, linear_end
        Displacements [mm]: crimp is 0..crimp_end, linear crimp_end..linear_end, damage follows.
    linear_stiffness
        Slope of the linear stage [N/mm].
    damage
        Whether the curve falls below the straight line by three tolerances later on; where it does not, the
        linear stage is taken to the largest force.
    tolerance
        Largest distance from the straight line [N]: the criterion.
    """

    crimp_end: float
    linear_end: float
    linear_stiffness: float
    damage: bool
    tolerance: float


def tensile_stages(
    displacement: Floats, force: Floats, scatter: float = 0.0, *, straight_within: float = STRAIGHT_WITHIN
) -> TensileStages:
    """Find the crimp, linear and damage stages of a mean tensile curve.

    The linear stage is the part with the largest rise of force over which the curve stays within
    ``straight_within`` of the largest force (or three times the noise of the mean curve, where that is
    more) of its own least-squares line; it ends at the largest force at the latest.

    Parameters
    ----------
    displacement, force
        Mean curve [mm], [N], shape [m].
    scatter
        Standard deviation of the noise of the mean curve [N].
    """
    peak = int(np.argmax(force))
    tolerance = max(straight_within * float(force[peak]), 3.0 * scatter)
    grid = np.linspace(displacement[0], displacement[peak], 121)
    f = np.interp(grid, displacement, force)
    best, rise = (0, len(grid) - 1), -np.inf
    for i in range(len(grid) - 4):
        for j in range(len(grid) - 1, i + 3, -1):
            if f[j] - f[i] <= rise:
                continue
            u, v = grid[i : j + 1] - grid[i : j + 1].mean(), f[i : j + 1]
            slope = float(u @ v / (u @ u))
            if np.abs(v - v.mean() - slope * u).max() <= tolerance:
                best, rise = (i, j), f[j] - f[i]
                break
    i, j = best
    u, v = grid[i : j + 1], f[i : j + 1]
    slope = float(np.polynomial.Polynomial.fit(u, v, 1).convert().coef[1])
    line = float(v.mean()) + slope * (displacement - float(u.mean()))
    damage = bool(((line - force)[displacement > grid[j]] > 3.0 * tolerance).any())
    return TensileStages(
        crimp_end=float(grid[i]),
        linear_end=float(grid[j]) if damage else float(grid[-1]),
        linear_stiffness=slope,
        damage=damage,
        tolerance=tolerance,
    )


class LockingCriterion(Enum):
    """How the locking angle is found."""

    BROKEN_LINE = "broken-line"
    """Second knot of the best continuous line of three straight parts; it depends on how far the test
    went."""
    STIFFNESS_RATIO = "stiffness-ratio"
    """Where dF_sh/dgamma reaches a multiple of the mean stiffness over the first ten degrees, for good."""


@dataclass(frozen=True)
class ShearStages:
    """Placing, transition and locking (Sec. 2.4.3), angles in degrees.

    Attributes
    ----------
    placing_end_deg
        First knot of the broken line.
    locking_deg
        By the criterion; None where the measured range does not reach it.
    slopes
        Of the three parts of the broken line [N/mm per degree].
    criterion
        In words, with its numbers.
    """

    placing_end_deg: float
    locking_deg: float | None
    slopes: tuple[float, float, float]
    criterion: str


def shear_stages(
    law: Law,
    valid_to: float,
    *,
    criterion: LockingCriterion = LockingCriterion.BROKEN_LINE,
    stiffness_ratio: float = STIFFNESS_RATIO,
) -> ShearStages:
    """The three stages of a fitted F_sh(gamma) over its measured range.

    The two knots of the broken line minimise the sum of squares, each part at least 5 % of the range. With
    ``BROKEN_LINE`` the locking angle is the second knot, where the tangents of transition and locking meet,
    provided that the last part is at least twice as steep as the one before.

    Parameters
    ----------
    law
        F_sh [N/mm] of gamma [rad].
    valid_to
        End of the measured range [rad].
    """
    angle = np.linspace(0.0, valid_to, 121)
    x, y = np.degrees(angle), law.value(angle)
    span = float(x[-1])
    coarse = np.linspace(0.05, 0.95, 19) * span
    _, first, second, _ = _best_broken_line(x, y, coarse, coarse)
    near = np.linspace(-0.05, 0.05, 11) * span
    _, first, second, c = _best_broken_line(
        x,
        y,
        np.clip(first + near, 0.05 * span, 0.95 * span),
        np.clip(second + near, 0.05 * span, 0.95 * span),
    )
    slopes = (float(c[1]), float(c[1] + c[2]), float(c[1] + c[2] + c[3]))
    locking: float | None
    if criterion is LockingCriterion.BROKEN_LINE:
        steep = slopes[2] >= LEAST_STEEPENING * max(slopes[1], 0.0) and slopes[2] > 0.0
        locking = second if steep else None
        words = (
            f"second knot of the best three-part broken line of F_sh over 0-{span:.3g} deg, if the last "
            f"part is at least "
            f"{LEAST_STEEPENING:g} times as steep as the one before"
        )
    else:
        early = min(np.radians(10.0), valid_to)
        stiff = law.slope(angle) >= stiffness_ratio * float(law.value(early)) / early
        below = np.flatnonzero(~stiff)
        start = int(below[-1]) + 1 if below.size else 0
        locking = float(x[start]) if start < len(x) else None
        words = (
            f"dF_sh/dgamma stays above {stiffness_ratio:g} times its mean over 0-{np.degrees(early):.3g} "
            f"deg, "
            f"seen over 0-{span:.3g} deg"
        )
    return ShearStages(first, locking, slopes, words)


def _best_broken_line(x: Floats, y: Floats, firsts: Floats, seconds: Floats) -> tuple[float, float, float, Floats]:
    """Sum of squares, knots and coefficients of the best continuous line of three straight parts."""
    best: tuple[float, float, float, Floats] | None = None
    apart = 0.05 * float(x[-1] - x[0])
    for first in firsts:
        for second in seconds:
            if second - first < apart * (1.0 - 1e-9):
                continue
            a = np.column_stack([np.ones(len(x)), x, np.maximum(x - first, 0.0), np.maximum(x - second, 0.0)])
            c = np.linalg.lstsq(a, y, rcond=None)[0]
            rest = float(((y - a @ c) ** 2).sum())
            if best is None or rest < best[0]:
                best = (rest, float(first), float(second), c)
    assert best is not None  # the grids always hold knots far enough apart
    return best
