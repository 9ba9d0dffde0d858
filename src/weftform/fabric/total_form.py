"""The hypoelastic law as a function of state: stress from the deformation gradient alone.

The mean of the engineering shears of the two yarn frames is the rate of the shear angle, for any motion, so
the increments of Eqs. 12-24 integrate exactly: ``E ln(stretch)`` along each yarn and ``tau(shear angle)``
between them. The derivation is in ``docs/theory/membrane.md``; :mod:`weftform.fabric.fibre_frames` is the
incremental form, :mod:`weftform.mechanics.membrane` the same law as the time loop evaluates it.

Everything here is a plane problem. Before deformation the warp lies along x and the weft along y, so the
columns of the deformation gradient are the stretched yarns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weftform.fabric.fabric import ShearLaw
from weftform.fabric.laws import Floats, Law, LinearLaw

__all__ = ["YarnKinematics", "YarnStress", "as_shear_law", "stress_tensor", "total_form", "yarn_kinematics"]


@dataclass(frozen=True)
class YarnKinematics:
    """What the yarns of a plane cell feel.

    Attributes
    ----------
    warp_direction, weft_direction
        Unit vectors along the yarns (Eqs. 16 and 18), shape [..., 2].
    warp_log_strain, weft_log_strain
        Logarithm of the yarn stretches, shape [...].
    shear_angle
        Decrease of the angle between the yarns [rad], within +-pi/2, shape [...].
    """

    warp_direction: Floats
    weft_direction: Floats
    warp_log_strain: Floats
    weft_log_strain: Floats
    shear_angle: Floats


@dataclass(frozen=True)
class YarnStress:
    """Stress of the membrane [MPa].

    Attributes
    ----------
    stress
        Cauchy stress in the fixed frame, shape [..., 2, 2].
    warp_stress, weft_stress
        Stress along the yarns, shape [...].
    shear_stress
        The common shear stress of the two yarn frames, shape [...].
    kinematics
        The state it belongs to.
    """

    stress: Floats
    warp_stress: Floats
    weft_stress: Floats
    shear_stress: Floats
    kinematics: YarnKinematics


def as_shear_law(shear: ShearLaw | Law | float) -> ShearLaw:
    """A shear law from a shear law, a law tau(gamma) in MPa and radians, or a constant modulus G12 [MPa]."""
    if isinstance(shear, ShearLaw):
        return shear
    if isinstance(shear, (int, float)):
        return ShearLaw(LinearLaw(float(shear)), 0.5 * np.pi)
    return ShearLaw(shear, min(shear.valid_to, 0.5 * np.pi))


def checked_gradient(deformation_gradient: Floats) -> Floats:
    """The deformation gradient as an array of floats.

    Raises
    ------
    ValueError
        It is not of shape [..., 2, 2], not finite, or turns the cell inside out.
    """
    gradient = np.asarray(deformation_gradient, dtype=float)
    if gradient.shape[-2:] != (2, 2):
        raise ValueError(f"expected deformation gradients of shape [..., 2, 2], got {list(gradient.shape)}")
    if not np.isfinite(gradient).all():
        raise ValueError("expected finite deformation gradients, got NaN or infinity")
    smallest = float(np.min(np.linalg.det(gradient), initial=np.inf))
    if smallest <= 0.0:
        raise ValueError(f"expected deformation gradients of positive determinant, got {smallest:.4g}")
    return gradient


def transposed(tensor: Floats) -> Floats:
    """Transpose of the last two axes, shape [..., 2, 2]."""
    return np.swapaxes(tensor, -1, -2)


def yarn_kinematics(deformation_gradient: Floats) -> YarnKinematics:
    """Directions, logarithmic strains and shear angle of the yarns.

    Parameters
    ----------
    deformation_gradient
        shape [..., 2, 2], of positive determinant.

    Raises
    ------
    ValueError
        Wrong shape, not finite, or a determinant that is not positive.

    References
    ----------
    Eqs. 16 and 18; the shear angle is that of Eq. 2 without its restriction to the bias test.
    """
    gradient = checked_gradient(deformation_gradient)
    warp, weft = gradient[..., :, 0], gradient[..., :, 1]
    warp_stretch, weft_stretch = np.linalg.norm(warp, axis=-1), np.linalg.norm(weft, axis=-1)
    return YarnKinematics(
        warp_direction=warp / warp_stretch[..., None],
        weft_direction=weft / weft_stretch[..., None],
        warp_log_strain=np.log(warp_stretch),
        weft_log_strain=np.log(weft_stretch),
        shear_angle=np.arctan2(np.sum(warp * weft, axis=-1), np.linalg.det(gradient)),
    )


def stress_tensor(
    warp_direction: Floats,
    weft_direction: Floats,
    warp_stress: Floats,
    weft_stress: Floats,
    warp_frame_shear: Floats,
    weft_frame_shear: Floats,
) -> Floats:
    """Sum of the stresses carried in the two yarn frames (Eq. 24), each with half of its shear.

    The frame of the warp is (warp, warp turned +90 degrees), the frame of the weft (weft turned -90 degrees,
    weft). Half the shear goes into each: the whole of it in both would double the shear force.

    Parameters
    ----------
    warp_direction, weft_direction
        Unit vectors in the frame of the result, shape [..., 2].
    warp_stress, weft_stress
        Stresses along the yarns [MPa], shape [...].
    warp_frame_shear, weft_frame_shear
        Shear stress of each frame [MPa], shape [...]; the same twice where the mean is taken.

    Returns
    -------
    Floats
        Symmetric stress [MPa], shape [..., 2, 2].
    """
    none = np.zeros_like(warp_stress)
    in_warp_frame = _symmetric(warp_stress, none, 0.5 * warp_frame_shear)
    in_weft_frame = _symmetric(none, weft_stress, 0.5 * weft_frame_shear)
    warp_frame = np.stack([warp_direction, _quarter_turn(warp_direction)], axis=-1)
    weft_frame = np.stack([-_quarter_turn(weft_direction), weft_direction], axis=-1)
    return np.asarray(
        warp_frame @ in_warp_frame @ transposed(warp_frame) + weft_frame @ in_weft_frame @ transposed(weft_frame)
    )


def _quarter_turn(vector: Floats) -> Floats:
    return np.stack([-vector[..., 1], vector[..., 0]], axis=-1)


def _symmetric(xx: Floats, yy: Floats, xy: Floats) -> Floats:
    return np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)


def total_form(
    deformation_gradient: Floats, warp_modulus: float, weft_modulus: float, shear: ShearLaw | Law | float
) -> YarnStress:
    """Cauchy stress of the hypoelastic membrane as a function of state.

    Parameters
    ----------
    deformation_gradient
        shape [..., 2, 2], of positive determinant.
    warp_modulus, weft_modulus
        Stiffness along the yarns [MPa] against logarithmic strain.
    shear
        Shear law, a law tau(gamma) [MPa of rad], or a constant G12 [MPa].

    Raises
    ------
    ValueError
        Wrong shape, not finite, or a determinant that is not positive.

    References
    ----------
    The exact integral of Eqs. 12-24; ``docs/theory/membrane.md``.
    """
    state = yarn_kinematics(deformation_gradient)
    warp_stress = warp_modulus * state.warp_log_strain
    weft_stress = weft_modulus * state.weft_log_strain
    shear_stress = as_shear_law(shear).shear_stress(state.shear_angle)
    stress = stress_tensor(
        state.warp_direction, state.weft_direction, warp_stress, weft_stress, shear_stress, shear_stress
    )
    return YarnStress(stress, warp_stress, weft_stress, shear_stress, state)
