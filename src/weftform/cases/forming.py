"""Forming between rigid tools: the holder closes, then the stroke is made."""

from __future__ import annotations

from typing import Any

from weftform.blank.outline import diagonal_angle
from weftform.cases.case import Case, Row
from weftform.result.fields import Fields
from weftform.result.outline import draw_in, formed_outline
from weftform.solver import Motion, Problem, Simulation
from weftform.study.schema import FormingModel
from weftform.study.study import Study


class Forming(Case):
    """A blank between rigid tools (Sec. 4)."""

    noisy_force = True
    columns = ("holder_displacement_mm", "holder_reaction_N", "penetration_mm")

    def __init__(self, study: Study) -> None:
        super().__init__(study)
        assert isinstance(study.model, FormingModel)
        self.loading = study.model.loading
        tools = list(enumerate(study.tools))
        self.punch = next(k for k, tool in tools if tool.motion == "stroke")
        self.holder = next((k for k, tool in tools if tool.motion == "force"), None)

    def problem(self) -> Problem:
        loading = self.loading
        stroke = Motion((self.begin, self.end), (0.0, loading.stroke_mm))
        return Problem(
            grid=self.grid,
            fabric=self.fabric,
            tools=self.study.tools,
            motions=(stroke, Motion((0.0, max(self.begin, 1e-12)), (0.0, 1.0))),
            stroke=0,
            holding=1,
            settings=self.settings(loading.ramp, loading.end_ramp),
        )

    @property
    def begin(self) -> float:
        return self.loading.closing_s

    @property
    def end(self) -> float:
        return self.loading.closing_s + self.loading.duration_s

    def displacement(self, simulation: Simulation) -> float:
        return abs(simulation.tool_position(self.punch))

    def force(self, simulation: Simulation) -> float:
        return abs(simulation.tool_reaction(self.punch)) * self.grid.copies

    def row(self, simulation: Simulation, fields: Fields, force: float) -> Row:
        holder = self.holder
        return {
            "holder_displacement_mm": simulation.tool_position(holder) if holder is not None else 0.0,
            "holder_reaction_N": abs(simulation.tool_reaction(holder)) * self.grid.copies
            if holder is not None
            else 0.0,
            "penetration_mm": simulation.penetration,
        }

    def summary(self, rows: list[Row], fields: Fields) -> dict[str, Any]:
        flat, formed, _ = formed_outline(self.grid, fields.positions)
        return {
            "punch_force_N": rows[-1]["force_N"],
            "stroke_mm": rows[-1]["displacement_mm"],
            "holder_displacement_mm": rows[-1]["holder_displacement_mm"],
            "draw_in_mm": draw_in(flat, formed, diagonal_angle(self.study.outline)),
        }

    def warnings(self) -> list[str]:
        fillets = [abs(tool.radius) for tool in self.study.tools if tool.side_s < 0.0 and tool.radius > 1.0]
        if fillets and max(self.grid.warp_pitch, self.grid.weft_pitch) > min(fillets):
            return [f"cells longer than the smallest fillet ({min(fillets):g} mm) cut its corner"]
        return []
