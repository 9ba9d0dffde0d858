"""Tests of bias extension in a formula instead of a simulation, so that the machinery is tested in milliseconds."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from weftform.identification.worker import Outcome, Task
from weftform.laboratory.kinematics import bias_design, kinematic_angle
from weftform.study import Study

POINTS = 81


def bias_curve(study: Study) -> tuple[np.ndarray, np.ndarray]:
    """Force of a bias test with inextensible yarns and uniform zones (Eq. 5), and a tensile strip by its card."""
    model = study.model
    d = np.linspace(0.0, model.loading.displacement_mm, POINTS)
    if model.kind == "tensile":
        return d, study.fabric.warp.force(d)
    height, width = model.specimen.length_mm, model.specimen.width_mm
    angle = kinematic_angle(d, height, width)
    return d, bias_design(angle, height, width, lambda g: study.fabric.normalised_shear_force(g)[:, None])[:, 0]


class Formula:
    """Stands in for the simulation; counts its calls and can break off."""

    def __init__(self) -> None:
        self.calls = 0
        self.most = 10**9
        self.fails_above: float | None = None

    def __call__(self, task: Task, scratch: Path) -> Outcome:
        if self.calls >= self.most:
            raise KeyboardInterrupt
        self.calls += 1
        d, force = bias_curve(task.study)
        if self.fails_above is not None and force[-1] > self.fails_above:
            return Outcome(task.key, failure="blew up")
        return Outcome(task.key, tuple(map(float, d)), tuple(map(float, force)))
