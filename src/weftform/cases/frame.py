"""The picture frame: a square of fabric pinned along its edges, sheared by a frame of rigid sides."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from weftform.cases.case import Case, Row
from weftform.laboratory.kinematics import frame_lever
from weftform.result.fields import Fields
from weftform.solver import Driven, Motion, Problem, Simulation
from weftform.solver.loop import COSINE, SINE
from weftform.study.schema import FrameModel
from weftform.study.study import Study

Floats = NDArray[np.float64]


class PictureFrame(Case):
    """Every crossing on the edge follows the frame; with several angles the shear is cyclic.

    The sides of the fabric turn by half the shear angle ``a`` towards each other: a material point (U, V) of the
    edge goes to ``U (cos a, sin a) + V (sin a, cos a)``.
    """

    columns = ("shear_angle_frame_deg", "normalised_shear_force_N_per_mm", "shear_angle_mean_deg")

    def __init__(self, study: Study) -> None:
        super().__init__(study)
        assert isinstance(study.model, FrameModel)
        self.model = study.model
        edge = np.zeros(self.grid.shape, bool)
        edge[[0, -1]] = True
        edge[:, [0, -1]] = True
        self.nodes = np.flatnonzero(edge.ravel())
        u, v = self.grid.material.reshape(-1, 2)[self.nodes].T
        zero = np.zeros_like(u)
        self.modes = np.stack([np.stack([u, v, zero], axis=-1), np.stack([v, u, zero], axis=-1)])

    def problem(self) -> Problem:
        angles = self.model.loading.shear_angles_deg
        times = np.linspace(0.0, self.end, len(angles) + 1)
        half = [0.0, *(0.5 * np.radians(a) for a in angles)]
        held = np.ones((len(self.nodes), 3), bool)
        return Problem(
            grid=self.grid,
            fabric=self.fabric,
            motions=(Motion(tuple(times), tuple(float(h) for h in half)),),
            driven=Driven(self.nodes, held, self.modes, (0, 0), (COSINE, SINE)),
            settings=self.settings(self.model.loading.ramp),
        )

    @property
    def end(self) -> float:
        return self.model.loading.duration_s

    def _angle(self, simulation: Simulation) -> float:
        return 2.0 * simulation.motion(0)

    def displacement(self, simulation: Simulation) -> float:
        """Opening of the frame along its diagonal [mm]."""
        phi = 0.25 * np.pi - 0.5 * self._angle(simulation)
        side = self.model.specimen.frame_side_mm
        return float(2.0 * side * (np.cos(phi) - np.cos(0.25 * np.pi)))

    def force(self, simulation: Simulation) -> float:
        """Force along the diagonal: the torque on the fabric over the lever of the frame."""
        half = simulation.motion(0)
        turning = -np.sin(half) * self.modes[0] + np.cos(half) * self.modes[1]
        torque = 0.5 * float((simulation.driven_forces * turning).sum())
        phi = 0.25 * np.pi - half
        return float(torque / (self.model.specimen.frame_side_mm * np.sin(phi)))

    def row(self, simulation: Simulation, fields: Fields, force: float) -> Row:
        angle = self._angle(simulation)
        specimen = self.model.specimen
        return {
            "shear_angle_frame_deg": float(np.degrees(angle)),
            "normalised_shear_force_N_per_mm": float(
                force / frame_lever(np.asarray(angle), specimen.frame_side_mm, specimen.fabric_side_mm)
            ),
            "shear_angle_mean_deg": float(np.degrees(np.nanmean(fields.shear_angle))),
        }

    def summary(self, rows: list[Row], fields: Fields) -> dict[str, Any]:
        final = rows[-1]
        angle = np.radians([row["shear_angle_frame_deg"] for row in rows])
        return {
            "force_N": final["force_N"],
            "displacement_mm": final["displacement_mm"],
            **{name: final[name] for name in self.columns},
            "normalised_shear_force": {
                "shear_angle_deg": [float(a) for a in np.degrees(angle)],
                "from_frame_N_per_mm": [row["normalised_shear_force_N_per_mm"] for row in rows],
                "input_law_N_per_mm": [float(f) for f in self.fabric.normalised_shear_force(angle)],
            },
        }
