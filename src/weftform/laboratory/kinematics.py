"""Kinematics and normalisation of the shear tests: closed forms of the paper's Secs. 2.3 and 2.4."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def kinematic_end(height: float, width: float) -> float:
    """Displacement at which inextensible yarns are fully closed in a bias test [mm]: ``(sqrt 2 - 1)(H - W)``."""
    return (math.sqrt(2.0) - 1.0) * (height - width)


def bias_shear_angle(displacement: Floats | float, height: float, width: float) -> Floats:
    """Shear angle of the central zone of a bias test with inextensible yarns [rad] (Eq. 2).

    With ``D = H - W`` the diagonal of the zone: ``sin gamma = (1 + d / D)^2 - 1``; 90 degrees from the kinematic end on.
    """
    stretched = 1.0 + np.asarray(displacement, float) / (height - width)
    return np.arcsin(np.clip(stretched**2 - 1.0, -1.0, 1.0))


def bias_force(angle: Floats | float, height: float, width: float, shear_force: object) -> Floats:
    """Force of a bias test with three zones of uniform shear [N], from the normalised shear force (inverse of Eq. 5).

    Parameters
    ----------
    angle
        Shear angle of the central zone [rad].
    shear_force
        Callable: F_sh [N/mm] of an angle [rad].

    Notes
    -----
    Power of the clamp against the torques per area ``C_s = F_sh cos gamma`` of zone B, ``W (2H - 3W) / 2``, and of zone C,
    ``W^2``, at half the angle and half the rate.
    """
    angle = np.asarray(angle, float)
    half = 0.5 * angle
    full_torque = shear_force(angle) * np.cos(angle)  # type: ignore[operator]
    half_torque = shear_force(half) * np.cos(half)  # type: ignore[operator]
    arm = (height - width) * (np.cos(half) - np.sin(half))
    return np.asarray((width * (2 * height - 3 * width) * full_torque + width**2 * half_torque) / arm)


def normalised_shear_force(
    angle: Floats, force: Floats, height: float, width: float, half_angle_force: object | None = None
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
    Eq. 5 holds F_sh at the angle and at half of it. Going up in angle, the half angle has always been done before; between the points
    the result is interpolated linearly, and below the first it is proportional to the angle.
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
            at_half = float(half_angle_force(0.5 * gamma))  # type: ignore[operator]
        else:
            known = np.flatnonzero(angle[:k] > 0.0)
            if known.size == 0 or angle[known[0]] > 0.5 * gamma:
                # proportional below the first known point: F_sh(gamma / 2) = F_sh(gamma) / 2
                found[k] = pull / (scale[k] + 0.5 * width * math.cos(0.5 * gamma))
                continue
            at_half = float(np.interp(0.5 * gamma, angle[known], found[known]))
        found[k] = (pull - width * at_half * math.cos(0.5 * gamma)) / scale[k]
    return found


def frame_force(angle: Floats | float, frame_side: float, fabric_side: float, shear_force: object) -> Floats:
    """Force along the diagonal of a picture frame [N] from the normalised shear force.

    ``F = 2 F_sh cos(phi) L^2 / L_frame`` with ``phi = (pi / 2 - gamma) / 2`` half the angle of the frame.
    """
    angle = np.asarray(angle, float)
    phi = 0.25 * math.pi - 0.5 * angle
    return np.asarray(2.0 * shear_force(angle) * np.cos(phi) * fabric_side**2 / frame_side)  # type: ignore[operator]


def normalised_frame_force(
    angle: Floats | float, force: Floats | float, frame_side: float, fabric_side: float
) -> Floats:
    """Normalised shear force of a picture frame [N/mm] from the force along its diagonal: inverse of :func:`frame_force`."""
    phi = 0.25 * math.pi - 0.5 * np.asarray(angle, float)
    return np.asarray(np.asarray(force, float) * frame_side / (2.0 * np.cos(phi) * fabric_side**2))
