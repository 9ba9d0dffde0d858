"""The bias-extension test (Secs. 2.3 and 3.6): a strip at 45 degrees to its yarns between two clamps."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from weftform.blank import YarnGrid
from weftform.cases.case import Case, Row
from weftform.cases.clamps import clamped, ends
from weftform.laboratory.kinematics import kinematic_angle, kinematic_limit
from weftform.laboratory.point_by_point import normalised_shear_force
from weftform.result.fields import Fields
from weftform.solver import Motion, Problem, Simulation
from weftform.study.schema import BiasModel
from weftform.study.study import Study

Floats = NDArray[np.float64]

ZONES = ("a", "b", "c")
BOUNDARY = 1.01
"""Cells whose centre lies nearer than this many half diagonals to the edge of a zone are not of its interior."""


def cell_centres(grid: YarnGrid) -> Floats:
    """Flat centroids of the cells [mm], shape [rows - 1, columns - 1, 2]."""
    corners = grid.flat[..., :2]
    rows, columns = grid.cells.shape
    total = np.zeros((rows, columns, 2))
    count = np.zeros((rows, columns, 1))
    for k, (di, dj) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
        has = (grid.cells != 2 + k)[..., None]
        total += has * corners[dj : dj + rows, di : di + columns]
        count += has
    return np.asarray(total / count)


def zone_distances(centres: Floats, height: float, width: float) -> dict[str, Floats]:
    """How far inside each zone of Fig. 2 a point lies [mm], negative outside, shape of ``centres`` without its last axis.

    B: neither yarn through the point ends in a clamp. A: both end in the same clamp. C: the rest.
    """
    across = np.abs(centres[..., 0])
    from_clamp = 0.5 * height - np.abs(centres[..., 1])
    root = np.sqrt(0.5)
    b = root * (from_clamp - 0.5 * width - across)
    a = root * (0.5 * width - across - from_clamp)
    return {"a": a, "b": b, "c": np.minimum(-a, -b)}


class BiasExtension(Case):
    """Pulls the specimen, solving for equilibrium; the three zones are only looked at."""

    columns = (
        *(f"shear_angle_zone_{z}_deg" for z in ZONES),
        *(f"shear_angle_zone_{z}_interior_deg" for z in ZONES),
        *(f"shear_angle_zone_{z}_{half}_deg" for z in ZONES for half in ("upper", "lower")),
        "shear_angle_centre_deg",
        "shear_angle_kinematic_deg",
        "width_mm",
    )

    def __init__(self, study: Study) -> None:
        super().__init__(study)
        assert isinstance(study.model, BiasModel)
        self.model = study.model
        self.height = study.model.specimen.length_mm
        self.width = study.model.specimen.width_mm
        self.fixed, self.moving = ends(self.grid, 1)
        centres = cell_centres(self.grid)
        inside = zone_distances(centres, self.height, self.width)
        exists = self.grid.cell_share > 0.0
        diagonal = self.grid.warp_pitch * np.sqrt(2.0)
        upper = centres[..., 1] > 0.0
        self._masks: dict[str, NDArray[np.bool_]] = {}
        for zone in ZONES:
            members = (inside[zone] > 0.0) & exists
            self._masks[zone] = members
            self._masks[f"{zone}_interior"] = members & (inside[zone] > BOUNDARY * diagonal / 2)
            self._masks[f"{zone}_upper"] = members & upper
            self._masks[f"{zone}_lower"] = members & ~upper
        distance = np.where(exists, np.hypot(centres[..., 0], centres[..., 1]), np.inf)
        self._central = distance <= distance.min() + 1e-6 * diagonal
        self._sides = self._side_nodes()

    def _side_nodes(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Crossings on the left and right edges at mid-height, two each where no crossing lies there."""
        flat = self.grid.flat
        x, y = flat[..., 0], flat[..., 1]
        near = np.abs(y) < 0.75 * self.grid.warp_pitch * np.sqrt(2.0)
        found = []
        for side in (-1.0, 1.0):
            edge = self.grid.active & near & (np.abs(side * x - 0.5 * self.width) < 1e-6 * self.width)
            nodes = np.flatnonzero(edge.ravel())
            closest = np.abs(y.ravel()[nodes])
            found.append(nodes[closest <= closest.min() + 1e-6])
        return found[0], found[1]

    def problem(self) -> Problem:
        return Problem(
            grid=self.grid,
            fabric=self.fabric,
            motions=(Motion((0.0, self.end), (0.0, self.model.loading.displacement_mm)),),
            driven=clamped(self.grid, self.fixed, self.moving, 1),
            settings=self.settings(self.model.loading.ramp),
        )

    @property
    def end(self) -> float:
        return self.model.loading.duration_s

    def displacement(self, simulation: Simulation) -> float:
        return simulation.motion(0)

    def force(self, simulation: Simulation) -> float:
        return float(simulation.driven_forces[len(self.fixed) :, 1].sum())

    def _mean(self, angle: Floats, mask: str) -> float:
        """Mean shear angle of a zone, by area [degrees]; zero where a mesh is too coarse to have such cells."""
        chosen = self._masks[mask]
        share = self.grid.cell_share[chosen]
        return float(np.degrees((angle[chosen] * share).sum() / share.sum())) if share.size else 0.0

    def row(self, simulation: Simulation, fields: Fields, force: float) -> Row:
        angle = fields.shear_angle
        positions = fields.positions.reshape(-1, 3)
        left, right = self._sides
        row = {f"shear_angle_zone_{name}_deg": self._mean(angle, name) for name in self._masks}
        row["shear_angle_centre_deg"] = float(np.degrees(angle[self._central].mean()))
        row["shear_angle_kinematic_deg"] = float(
            np.degrees(kinematic_angle(self.displacement(simulation), self.height, self.width))
        )
        row["width_mm"] = float(positions[right, 0].mean() - positions[left, 0].mean())
        return row

    def summary(self, rows: list[Row], fields: Fields) -> dict[str, Any]:
        final = rows[-1]
        angle = np.radians([row["shear_angle_kinematic_deg"] for row in rows])
        force = np.array([row["force_N"] for row in rows])
        recovered = normalised_shear_force(angle, force, self.height, self.width)
        return {
            "force_N": final["force_N"],
            "displacement_mm": final["displacement_mm"],
            "kinematic_end_mm": kinematic_limit(self.height, self.width),
            **{name: final[name] for name in self.columns},
            "normalised_shear_force": {
                "shear_angle_deg": [float(a) for a in np.degrees(angle)],
                "from_eq_5_N_per_mm": [float(f) for f in recovered],
                "input_law_N_per_mm": [float(f) for f in self.fabric.normalised_shear_force(angle)],
            },
        }

    def warnings(self) -> list[str]:
        end = kinematic_limit(self.height, self.width)
        wanted = self.model.loading.displacement_mm
        if wanted > end:
            return [
                f"{wanted:g} mm lies beyond the kinematic end, {end:.2f} mm, where the yarns of zone B are parallel: only "
                "slipping yarns reach it, and slip is not part of this model"
            ]
        return []
