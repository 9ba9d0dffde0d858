"""The incremental law in two fibre frames (Eqs. 12-24): the reference constitutive driver.

Along a prescribed sequence of deformation gradients, the strain increments are turned into two orthonormal
frames, one on each yarn direction, multiplied by the moduli there and summed; the sum of the two frames is
the stress in the Green-Naghdi frame. The time loop does not need any of this, because
:func:`weftform.fabric.total_form.total_form` is its exact integral; it is kept as an independent check of
that claim, for laws with history, and as the pattern of an Abaqus user subroutine.

``docs/theory/fibre-frames.md`` lists how the printed equations are read. As in
:mod:`weftform.fabric.total_form`, the problem is plane, the warp starts along x and the weft along y.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from weftform.fabric.fabric import ShearLaw
from weftform.fabric.laws import Floats, Law
from weftform.fabric.total_form import (
    as_shear_law,
    checked_gradient,
    stress_tensor,
    transposed,
    yarn_kinematics,
)

__all__ = ["FibreFrameHistory", "Frames", "integrate_fibre_frames", "polar_rotation"]


SMALLEST_MIDPOINT = 0.01
"""Area of the mean of two gradients over the geometric mean of theirs, below which a step says nothing: for a
rigid turn it is the squared cosine of half the angle, so this is a turn by 169 degrees in one step."""


class Frames(Enum):
    """Which configuration of a step the frames and the shear modulus are taken from."""

    MIDPOINT = "midpoint"
    """The mean of the two gradients of the step (Hughes and Winget 1980): second order in the step."""
    END = "end"
    """The gradient at the end of the step, as in a subroutine that looks at nothing else: first order."""


@dataclass(frozen=True)
class FibreFrameHistory:
    """Stresses along a deformation path, one entry per given gradient.

    Attributes
    ----------
    stress
        Cauchy stress in the fixed frame [MPa], shape [steps, 2, 2].
    green_naghdi_stress
        The same in the frame turned by the polar rotation [MPa], shape [steps, 2, 2].
    warp_stress, weft_stress
        Stress along each yarn in its own frame [MPa], shape [steps].
    warp_frame_shear, weft_frame_shear
        Shear stress accumulated in each frame by itself [MPa], shape [steps]. They differ as soon as one
        yarn stretches more than the other in a sheared state.
    shear_stress
        Their mean [MPa], shape [steps].
    shear_angle
        Decrease of the angle between the yarns [rad], from the gradient, shape [steps].
    warp_log_strain, weft_log_strain
        Accumulated strain along each yarn, shape [steps].
    """

    stress: Floats
    green_naghdi_stress: Floats
    warp_stress: Floats
    weft_stress: Floats
    warp_frame_shear: Floats
    weft_frame_shear: Floats
    shear_stress: Floats
    shear_angle: Floats
    warp_log_strain: Floats
    weft_log_strain: Floats


def polar_rotation(deformation_gradient: Floats) -> Floats:
    """Rotation R of the polar decomposition F = R U (Eq. 14), shape [..., 2, 2].

    In the plane ``R' F`` is symmetric for the angle ``atan2(F_yx - F_xy, F_xx + F_yy)``, and U is positive
    definite there when the determinant of F is positive.
    """
    gradient = np.asarray(deformation_gradient, dtype=float)
    return _rotation(np.arctan2(gradient[..., 1, 0] - gradient[..., 0, 1], gradient[..., 0, 0] + gradient[..., 1, 1]))


def _rotation(angle: Floats) -> Floats:
    """Columns (f, f turned +90 degrees) with f at ``angle`` [rad]: the matrices T of Eqs. 20 and 21, and
    R."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def _yarn_angles(gradient: Floats, rotation: Floats) -> tuple[Floats, Floats]:
    """Angles [rad] from the Green-Naghdi axes to warp and weft; their components there are those of U (Eqs.
    16-18)."""
    stretch = transposed(rotation) @ gradient
    warp = np.arctan2(stretch[..., 1, 0], stretch[..., 0, 0])
    weft = np.arctan2(-stretch[..., 0, 1], stretch[..., 1, 1])
    return warp, weft


def integrate_fibre_frames(
    deformation_gradient: Floats,
    warp_modulus: float,
    weft_modulus: float,
    shear: ShearLaw | Law | float,
    *,
    frames: Frames = Frames.MIDPOINT,
    average_frame_shears: bool = True,
) -> FibreFrameHistory:
    """Accumulate the stresses of the two fibre frames along a deformation path.

    Parameters
    ----------
    deformation_gradient
        Path, shape [steps, 2, 2]. Before the first entry the fabric is undeformed and free of stress, so a
        path may or may not begin with the identity.
    warp_modulus, weft_modulus
        E11 and E22 [MPa] of Eq. 23.
    shear
        Shear law, a law tau(gamma) [MPa of rad], or a constant G12 [MPa]. Only its modulus is used.
    frames
        Configuration of the step that carries the frames and the modulus.
    average_frame_shears
        Whether both frames carry the mean of the two shears (the paper's update). Left apart, the law
        depends on the path: a closed loop leaves shear stress behind.

    Raises
    ------
    ValueError
        Wrong shape, not finite, a determinant that is not positive, or a step so large that the mean of its
        two gradients has almost no area.

    References
    ----------
    Eqs. 12-24 of the paper; Hughes and Winget, Int. J. Numer. Meth. Engng 15 (1980),
    doi:10.1002/nme.1620151210.
    """
    path = checked_gradient(deformation_gradient)
    if path.ndim != 3:
        raise ValueError(f"expected a path of shape [steps, 2, 2], got {list(path.shape)}")
    before = np.concatenate([np.eye(2)[None], path[:-1]])
    middle = 0.5 * (before + path)
    kept = np.linalg.det(middle) / np.sqrt(np.linalg.det(before) * np.linalg.det(path))
    turned = np.flatnonzero(kept < SMALLEST_MIDPOINT)
    if turned.size:
        raise ValueError(
            f"step {turned[0]} is too large: the mean of its two gradients has almost no area; give more steps"
        )

    velocity = (path - before) @ np.linalg.inv(middle)
    strain = 0.5 * (velocity + transposed(velocity))
    seen_from = middle if frames is Frames.MIDPOINT else path
    rotation = polar_rotation(seen_from)
    strain_green_naghdi = transposed(rotation) @ strain @ rotation
    warp_frame, weft_frame = (_rotation(angle) for angle in _yarn_angles(seen_from, rotation))
    in_warp_frame = transposed(warp_frame) @ strain_green_naghdi @ warp_frame  # Eq. 19
    in_weft_frame = transposed(weft_frame) @ strain_green_naghdi @ weft_frame

    warp_log_strain = np.cumsum(in_warp_frame[:, 0, 0])
    weft_log_strain = np.cumsum(in_weft_frame[:, 1, 1])
    modulus = as_shear_law(shear).modulus(yarn_kinematics(seen_from).shear_angle)
    warp_frame_shear = np.cumsum(modulus * 2.0 * in_warp_frame[:, 0, 1])  # Eqs. 22 and 23
    weft_frame_shear = np.cumsum(modulus * 2.0 * in_weft_frame[:, 0, 1])
    shear_stress = 0.5 * (warp_frame_shear + weft_frame_shear)

    rotation = polar_rotation(path)
    warp_angle, weft_angle = _yarn_angles(path, rotation)
    green_naghdi = stress_tensor(
        _rotation(warp_angle)[:, :, 0],
        _rotation(weft_angle)[:, :, 1],
        warp_modulus * warp_log_strain,
        weft_modulus * weft_log_strain,
        shear_stress if average_frame_shears else warp_frame_shear,
        shear_stress if average_frame_shears else weft_frame_shear,
    )
    return FibreFrameHistory(
        stress=np.asarray(rotation @ green_naghdi @ transposed(rotation)),
        green_naghdi_stress=green_naghdi,
        warp_stress=warp_modulus * warp_log_strain,
        weft_stress=weft_modulus * weft_log_strain,
        warp_frame_shear=warp_frame_shear,
        weft_frame_shear=weft_frame_shear,
        shear_stress=shear_stress,
        shear_angle=yarn_kinematics(path).shear_angle,
        warp_log_strain=warp_log_strain,
        weft_log_strain=weft_log_strain,
    )
