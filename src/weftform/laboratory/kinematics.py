"""Geometry and energy of the bias-extension test and of the picture frame (Eqs. 1, 2, 5 to 7).

Angles in radians, lengths in mm, forces in N. See docs/theory/normalisation.md for the derivations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats


def check_bias_specimen(height: float, width: float) -> None:
    """Refuse a specimen without a zone of pure shear.

    Raises
    ------
    MeasurementError
        A size is not positive, or the height is less than twice the width (Sec. 2.3.1).
    """
    if not (np.isfinite(height) and np.isfinite(width) and height > 0 and width > 0):
        raise MeasurementError("specimen sizes must be positive", expected="mm > 0", got=f"{height:g} x {width:g}")
    if height < 2.0 * width:
        raise MeasurementError(
            "the specimen is too short for a bias-extension test: its centre is not in pure shear",
            expected="height / width >= 2 (Sec. 2.3.1)",
            got=f"{height:g} / {width:g} = {height / width:.3g}",
            hint="height is the free length between the clamps, along the pull",
        )


def kinematic_limit(height: float, width: float) -> float:
    """Displacement [mm] at which yarns without stretch or slip lie parallel: (sqrt 2 - 1)(H - W)."""
    return float(np.sqrt(2.0) - 1.0) * (height - width)


def kinematic_angle(displacement: Floats | float, height: float, width: float) -> Floats:
    """Shear angle [rad] of zone B for inextensible yarns without slip (Eqs. 1 and 2).

    ``gamma = asin((1 + d / D)^2 - 1)`` with ``D = H - W``, the diagonal of zone B; the angle stays at 90
    degrees beyond :func:`kinematic_limit`. It equals ``90 deg - 2 acos((D + d) / (sqrt 2 D))``.
    """
    stretch = 1.0 + np.asarray(displacement, float) / (height - width)
    return np.arcsin(np.clip(stretch**2 - 1.0, -1.0, 1.0))


def kinematic_displacement(angle: Floats | float, height: float, width: float) -> Floats:
    """Displacement [mm] at a kinematic shear angle [rad]; the inverse of :func:`kinematic_angle`."""
    return np.asarray((height - width) * (np.sqrt(1.0 + np.sin(np.asarray(angle, float))) - 1.0))


def bias_design(angle: Floats, height: float, width: float, basis: Callable[[Floats], Floats]) -> Floats:
    """Force [N] of the test per unit of each coefficient of F_sh, shape [points, p] (Eq. 7 solved for F).

    With ``F_sh = sum_k a_k b_k(gamma)`` the energy balance of the test (Eq. 5) reads ::

        F (H/W - 1)(cos g/2 - sin g/2) = sum_k a_k [ (2H - 3W) cos(g) b_k(g) + W cos(g/2) b_k(g/2) ]

    which is linear in ``a_k``. Errors of measurement are in F, so this is the form to put into least
    squares. For powers ``b_k(g) = g^k`` it is Eq. 7 multiplied by known factors, with ``x z / 2^k`` added
    in its bracket and ``z = W cos(g/2)``.

    Parameters
    ----------
    angle
        Shear angles of zone B [rad], shape [points].
    height, width
        Specimen [mm].
    basis
        Values of the functions ``b_k``, shape [points, p], at angles [rad].
    """
    g = np.asarray(angle, float)
    half = 0.5 * g
    pure = (2.0 * height - 3.0 * width) * np.cos(g)
    lever = (height / width - 1.0) * (np.cos(half) - np.sin(half))
    torque = pure[:, None] * basis(g) + (width * np.cos(half))[:, None] * basis(half)
    return np.asarray(torque / lever[:, None])


def bias_force(angle: Floats, coefficients: Sequence[float], height: float, width: float) -> Floats:
    """Force [N] at shear angles of zone B [rad] for F_sh [N/mm] with coefficients of gamma, gamma^2, ..."""
    powers = np.arange(1, len(coefficients) + 1)
    design = bias_design(np.atleast_1d(angle), height, width, lambda g: g[:, None] ** powers)
    return np.asarray(design @ np.asarray(coefficients, float)).reshape(np.shape(angle))


def frame_angle(displacement: Floats | float, frame_side: float) -> Floats:
    """Shear angle [rad] of a picture frame of the given side [mm], pulled along its diagonal.

    ``cos(pi/4 - gamma/2) = 1/sqrt 2 + d / (2 L)``; 90 degrees beyond the end of the travel.
    """
    cosine = np.sqrt(0.5) + np.asarray(displacement, float) / (2.0 * frame_side)
    return np.asarray(0.5 * np.pi - 2.0 * np.arccos(np.clip(cosine, -1.0, 1.0)))


def frame_limit(frame_side: float) -> float:
    """Displacement [mm] at which a picture frame is closed."""
    return float(2.0 - np.sqrt(2.0)) * frame_side


def frame_lever(angle: Floats, frame_side: float, fabric_side: float) -> Floats:
    """Force [N] of a picture frame per unit of normalised shear force [N/mm].

    ``F = 2 cos(pi/4 - gamma/2) F_sh L_fabric^2 / L_frame``: the normalisation of Cao et al. (2008), and the
    energy balance ``F dd = C_s L_fabric^2 dgamma`` with ``C_s = F_sh cos(gamma)``.
    """
    return np.asarray(2.0 * np.cos(0.25 * np.pi - 0.5 * np.asarray(angle, float)) * fabric_side**2 / frame_side)
