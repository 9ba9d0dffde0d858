"""Tension along the yarns: the clamped strip (Sec. 3.2) and the biaxial test."""

from __future__ import annotations

from typing import Any

import numpy as np

from weftform.cases.case import Case, Row
from weftform.cases.clamps import clamped, ends
from weftform.result.fields import Fields
from weftform.solver import Driven, Motion, Problem, Simulation
from weftform.study.schema import BiaxialModel, TensileModel
from weftform.study.study import Study


class Tensile(Case):
    """A strip clamped at both ends, pulled along its warp or weft."""

    def __init__(self, study: Study) -> None:
        super().__init__(study)
        assert isinstance(study.model, TensileModel)
        self.model = study.model
        self.axis = 0 if self.model.specimen.direction == "warp" else 1
        self.fixed, self.moving = ends(self.grid, self.axis)

    def problem(self) -> Problem:
        pull = Motion((0.0, self.end), (0.0, self.model.loading.displacement_mm))
        return Problem(
            grid=self.grid,
            fabric=self.fabric,
            motions=(pull,),
            driven=clamped(self.grid, self.fixed, self.moving, self.axis),
            settings=self.settings(self.model.loading.ramp),
        )

    @property
    def end(self) -> float:
        return self.model.loading.duration_s

    def displacement(self, simulation: Simulation) -> float:
        return simulation.motion(0)

    def force(self, simulation: Simulation) -> float:
        return float(simulation.driven_forces[len(self.fixed) :, self.axis].sum())

    def summary(self, rows: list[Row], fields: Fields) -> dict[str, Any]:
        warp = self.axis == 0
        law = self.fabric.warp if warp else self.fabric.weft
        pitch, spacing = self.grid.warp_pitch, self.grid.weft_pitch
        if not warp:
            pitch, spacing = spacing, pitch
        final = rows[-1]
        specimen = self.model.specimen
        lines = law.width / spacing + 1.0
        nominal = final["displacement_mm"] / specimen.length_mm
        return {
            "force_N": final["force_N"],
            "displacement_mm": final["displacement_mm"],
            "connector": {
                "displacement_mm": nominal * pitch,
                "force_N": float(law.force(nominal * law.length)) / lines,
                "lines": specimen.width_mm / spacing + 1.0,
                "connectors_per_line": specimen.length_mm / pitch,
            },
        }


class Biaxial(Case):
    """A rectangle pulled along warp and weft; its edges slide freely along themselves."""

    columns = ("weft_displacement_mm", "weft_force_N", "warp_force_N_per_mm", "weft_force_N_per_mm")

    def __init__(self, study: Study) -> None:
        super().__init__(study)
        assert isinstance(study.model, BiaxialModel)
        self.model = study.model
        self.edges = [ends(self.grid, axis) for axis in (0, 1)]

    def problem(self) -> Problem:
        nodes = np.unique(np.concatenate([n for pair in self.edges for n in pair]))
        held = np.zeros((len(nodes), 3), bool)
        modes = np.zeros((2, len(nodes), 3))
        sizes = self.model.specimen.warp_length_mm, self.model.specimen.weft_length_mm
        strains = self.model.loading.warp_strain, self.model.loading.weft_strain
        motions = []
        for axis, (low, high) in enumerate(self.edges):
            held[np.isin(nodes, low) | np.isin(nodes, high), axis] = True
            modes[axis, np.isin(nodes, high), axis] = 1.0
            motions.append(Motion((0.0, self.end), (0.0, strains[axis] * sizes[axis])))
        return Problem(
            grid=self.grid,
            fabric=self.fabric,
            motions=tuple(motions),
            driven=Driven(nodes, held, modes, (0, 1), (0, 0)),
            settings=self.settings(self.model.loading.ramp),
        )

    @property
    def end(self) -> float:
        return self.model.loading.duration_s

    def displacement(self, simulation: Simulation) -> float:
        return simulation.motion(0)

    def force(self, simulation: Simulation) -> float:
        return self._pull(simulation, 0)

    def _pull(self, simulation: Simulation, axis: int) -> float:
        return float((simulation.driven_forces[:, axis] * simulation.problem.driven.modes[axis, :, axis]).sum())  # type: ignore[union-attr]

    def row(self, simulation: Simulation, fields: Fields, force: float) -> Row:
        weft = self._pull(simulation, 1)
        specimen = self.model.specimen
        return {
            "weft_displacement_mm": simulation.motion(1),
            "weft_force_N": weft,
            "warp_force_N_per_mm": force / specimen.weft_length_mm,
            "weft_force_N_per_mm": weft / specimen.warp_length_mm,
        }

    def summary(self, rows: list[Row], fields: Fields) -> dict[str, Any]:
        final = rows[-1]
        return {
            "force_N": final["force_N"],
            "displacement_mm": final["displacement_mm"],
            **{name: final[name] for name in self.columns},
        }
