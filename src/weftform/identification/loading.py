"""What the testing machine of a study does: its travel, the shear angle that it reaches, and shorter travels."""

from __future__ import annotations

import math
from dataclasses import replace

from weftform.errors import IdentificationError
from weftform.laboratory.kinematics import frame_angle, kinematic_angle, kinematic_limit
from weftform.study.schema import BiasModel, BiaxialModel, ElementModel, FormingModel, FrameModel, TensileModel
from weftform.study.study import Study

MARGIN = 1.02
"""A shortened test goes on this much beyond the last point that is compared."""


def travel(study: Study) -> float:
    """Displacement at the end of a study [mm].

    Raises
    ------
    IdentificationError
        The study has no force against a displacement that only grows.
    """
    model = study.model
    if isinstance(model, ElementModel):
        raise IdentificationError(
            "a test of one element has no force curve to fit", key="kind", expected="a test with a displacement"
        )
    if isinstance(model, FormingModel):
        return model.loading.stroke_mm
    if isinstance(model, BiaxialModel):
        if model.loading.warp_strain == 0.0:
            raise IdentificationError("the warp is not pulled, so there is no force against displacement to fit")
        return model.loading.warp_strain * model.specimen.warp_length_mm
    if isinstance(model, FrameModel):
        angles = model.loading.shear_angles_deg
        if len(angles) > 1 or angles[0] <= 0.0:
            raise IdentificationError(
                "a cyclic frame test has several forces at one displacement",
                key="loading.shear_angles_deg",
                expected="one positive angle",
                got=str(angles),
            )
        phi = math.radians(45.0 - 0.5 * angles[0])
        return 2.0 * model.specimen.frame_side_mm * (math.cos(phi) - math.sqrt(0.5))
    return model.loading.displacement_mm


def shear_angle_at(study: Study, displacement: float) -> float | None:
    """Shear angle [rad] by the kinematics of the test at a displacement [mm]; None for a test that has none."""
    model = study.model
    if isinstance(model, BiasModel):
        height, width = model.specimen.length_mm, model.specimen.width_mm
        return float(kinematic_angle(min(displacement, 0.98 * kinematic_limit(height, width)), height, width))
    if isinstance(model, FrameModel):
        return float(frame_angle(displacement, model.specimen.frame_side_mm))
    return None


def shortened(study: Study, end: float) -> Study:
    """The same test over soon after ``end`` [mm]; one that is not a pull along its length stays as it is.

    It takes as long as before: the forces of the shorter way are smaller, so it has to be slower to stay quasi-static.
    """
    model = study.model
    if not isinstance(model, (BiasModel, TensileModel)) or MARGIN * end >= 0.95 * model.loading.displacement_mm:
        return study
    pull = model.loading.model_copy(update={"displacement_mm": MARGIN * end})
    return replace(study, model=model.model_copy(update={"loading": pull}))
