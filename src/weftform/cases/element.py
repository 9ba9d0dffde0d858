"""Elementary tests on one cell (Secs. 3.4 and 3.5, Tables 2 and 3): stretch, simple shear, rigid turn."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weftform.cases.case import Case, Row
from weftform.fabric.fibre_frames import polar_rotation
from weftform.result.fields import Fields
from weftform.solver import Driven, Motion, Problem, Simulation
from weftform.solver.loop import COSINE, IDENTITY, SINE
from weftform.study.schema import ElementModel
from weftform.study.study import Study

Floats = NDArray[np.float64]


class Element(Case):
    """All four corners follow the phases of the loading."""

    columns = (
        "shear_angle_deg",
        "warp_log_strain",
        "weft_log_strain",
        "warp_stress_MPa",
        "weft_stress_MPa",
        "shear_stress_MPa",
        "warp_connector_force_N",
        "weft_connector_force_N",
        "green_naghdi_xx_MPa",
        "green_naghdi_yy_MPa",
        "green_naghdi_xy_MPa",
    )

    def __init__(self, study: Study) -> None:
        super().__init__(study)
        assert isinstance(study.model, ElementModel)
        self.loading = study.model.loading
        self.side = study.model.element.side_mm
        self._motions, self._modes, self._behind, self._kinds = self._plan()

    def _plan(self) -> tuple[list[Motion], list[Floats], list[int], list[int]]:
        corners = self.grid.material.reshape(-1, 2) + 0.5 * self.side
        phases = self.loading.phases
        ends = [self.end * (k + 1) / len(phases) for k in range(len(phases))]
        stretch, shear = 1.0, 0.0
        stretches = [(0.0, 1.0)]
        shears = [(0.0, 0.0)]
        turn = 0.0
        begin = 0.0
        for phase, end in zip(phases, ends, strict=True):
            if phase.warp_stretch is not None:
                stretch = phase.warp_stretch
            elif phase.shear_angle_deg is not None:
                shear = math.tan(math.radians(phase.shear_angle_deg))
            else:
                assert phase.rotation_deg is not None
                turn = math.radians(phase.rotation_deg)
            stretches.append((end, stretch))
            shears.append((end, shear))
            if phase is not phases[-1]:
                begin = end
        u, v = corners.T
        zero = np.zeros_like(u)
        motions = [
            Motion(tuple(t for t, _ in stretches), tuple(s - 1.0 for _, s in stretches)),
            Motion(tuple(t for t, _ in shears), tuple(s for _, s in shears)),
        ]
        modes = [np.stack([u, zero, zero], axis=-1), np.stack([v, zero, zero], axis=-1)]
        behind, kinds = [0, 1], [IDENTITY, IDENTITY]
        if turn:
            x = stretch * u + shear * v
            motions.append(Motion((begin, self.end), (0.0, turn)))
            modes += [np.stack([x, v, zero], axis=-1), np.stack([-v, x, zero], axis=-1)]
            behind += [2, 2]
            kinds += [COSINE, SINE]
        return motions, modes, behind, kinds

    def problem(self) -> Problem:
        nodes = np.arange(4)
        return Problem(
            grid=self.grid,
            fabric=self.fabric,
            motions=tuple(self._motions),
            driven=Driven(nodes, np.ones((4, 3), bool), np.stack(self._modes), tuple(self._behind), tuple(self._kinds)),
            settings=self.settings(self.loading.ramp),
        )

    @property
    def end(self) -> float:
        return self.loading.duration_s

    def displacement(self, simulation: Simulation) -> float:
        """Largest displacement of a corner [mm]."""
        return float(np.linalg.norm(simulation.positions - self.grid.flat, axis=-1).max())

    def force(self, simulation: Simulation) -> float:
        """Size of the force on the corners of the upper weft edge [N]."""
        return float(np.linalg.norm(simulation.driven_forces[2:].sum(axis=0)))

    def row(self, simulation: Simulation, fields: Fields, force: float) -> Row:
        """Stresses along the fibres: membrane plus connectors over the area they stand for, at constant thickness."""
        g1, g2 = (g[0, 0] for g in fields.vectors)
        card = self.fabric.card.membrane
        angle = float(fields.shear_angle[0, 0])
        thickness = self.fabric.thickness
        log_strains = [math.log(float(np.linalg.norm(g))) for g in (g1, g2)]
        # every edge of the cell is a whole connector, so two of them act on the side of the cell
        lines = [2.0 * float(force[0, 0]) * self.side for force in (fields.warp_force, fields.weft_force)]
        moduli = card.warp_modulus_MPa, card.weft_modulus_MPa
        stresses = [
            modulus * strain + line / (self.side * thickness)
            for modulus, strain, line in zip(moduli, log_strains, lines, strict=True)
        ]
        tau = float(self.fabric.shear.shear_stress(angle))
        f1, f2 = (g[:2] / np.linalg.norm(g[:2]) for g in (g1, g2))
        p1 = np.array([-f1[1], f1[0]])
        p2 = np.array([f2[1], -f2[0]])
        stress = (
            stresses[0] * np.outer(f1, f1)
            + stresses[1] * np.outer(f2, f2)
            + 0.5 * tau * (np.outer(f1, p1) + np.outer(p1, f1) + np.outer(p2, f2) + np.outer(f2, p2))
        )
        rotation = polar_rotation(np.column_stack([g1[:2], g2[:2]]))
        turned = rotation.T @ stress @ rotation
        return {
            "shear_angle_deg": math.degrees(angle),
            "warp_log_strain": log_strains[0],
            "weft_log_strain": log_strains[1],
            "warp_stress_MPa": stresses[0],
            "weft_stress_MPa": stresses[1],
            "shear_stress_MPa": tau,
            "warp_connector_force_N": 0.5 * lines[0],
            "weft_connector_force_N": 0.5 * lines[1],
            "green_naghdi_xx_MPa": float(turned[0, 0]),
            "green_naghdi_yy_MPa": float(turned[1, 1]),
            "green_naghdi_xy_MPa": float(turned[0, 1]),
        }

    def summary(self, rows: list[Row], fields: Fields) -> dict[str, Any]:
        final = rows[-1]
        return {
            "force_N": final["force_N"],
            "displacement_mm": final["displacement_mm"],
            "element": {name: final[name] for name in self.columns},
        }
