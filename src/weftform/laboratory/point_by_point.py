"""Eq. 5 read point by point: the normalised shear force of a bias test without a polynomial in between."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from weftform.fabric.laws import Floats


def normalised_shear_force(
    angle: Floats, force: Floats, height: float, width: float, half_angle_force: Callable[[float], float] | None = None
) -> Floats:
    """Normalised shear force of a bias test [N/mm] by Eq. 5, from its force and shear angle.

    Parameters
    ----------
    angle, force
        Increasing shear angle of the central zone [rad] and force [N], from the start of the test.
    half_angle_force
        Callable F_sh at half the angle; without, the result itself is used there, from the smallest angles upwards.

    Notes
    -----
    Eq. 5 holds F_sh at the angle and at half of it. Going up in angle, the half angle has always been done
    before; between the points the result is interpolated linearly, and below the first it is proportional to the
    angle.
    """
    angle, force = np.asarray(angle, float), np.asarray(force, float)
    half = 0.5 * angle
    drive = (height / width - 1.0) * force * (np.cos(half) - np.sin(half))
    scale = (2.0 * height - 3.0 * width) * np.cos(angle)
    found = np.zeros_like(angle)
    for k, (gamma, pull) in enumerate(zip(angle, drive, strict=True)):
        if gamma <= 0.0:
            continue
        if half_angle_force is not None:
            at_half = float(half_angle_force(0.5 * gamma))
        else:
            known = np.flatnonzero(angle[:k] > 0.0)
            if known.size == 0 or angle[known[0]] > 0.5 * gamma:
                # proportional below the first known point: F_sh(gamma / 2) = F_sh(gamma) / 2
                found[k] = pull / (scale[k] + 0.5 * width * math.cos(0.5 * gamma))
                continue
            at_half = float(np.interp(0.5 * gamma, angle[known], found[known]))
        found[k] = (pull - width * at_half * math.cos(0.5 * gamma)) / scale[k]
    return found
