"""What a study would do: size, stable step, number of steps and duration, estimated before anything runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from weftform.cases import case_of
from weftform.fabric.fabric import TensionLaw
from weftform.mechanics.stable_step import stable_step
from weftform.processors import threads_for
from weftform.study import Study
from weftform.study.schema import FormingModel
from weftform.verdict import MUCH_INERTIA, blank_summary

NS_PER_CELL_STEP = 30.0
"""Of one thread with three tools on a laptop of 2023; `weftform doctor` measures this machine."""

WORKING_FORCE = 1.5
"""N per mm of width: a tension that forming with a holder reaches, to estimate how stiff the yarns will be by then."""


@dataclass(frozen=True)
class Forecast:
    """Estimates for a study; numbers with units in their names."""

    study: str
    cells: int
    half_cells: int
    cell_length_mm: tuple[float, float]
    mass_kg: float
    area_mm2: float
    area_error: float
    first_step_s: float
    smallest_step_s: float
    inertia: float
    """Factor by which ``solver.least_step_s`` scales the mass then."""
    simulated_s: float
    steps: int
    threads: int
    duration_s: float
    memory_MB: float
    warnings: list[str] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        return dict(self.__dict__)

    def lines(self) -> list[str]:
        """The forecast in words."""
        a, b = self.cell_length_mm
        return [
            f"study      {self.study}",
            f"cells      {self.cells:,}" + (f", {self.half_cells:,} of them half cells" if self.half_cells else ""),
            f"cell       {a:.4g} mm along warp, {b:.4g} mm along weft",
            f"blank      {self.area_mm2:.0f} mm2, {1e3 * self.mass_kg:.3g} g"
            + (
                f"; the cells cover {100 * self.area_error:+.2f} % of the outline"
                if abs(self.area_error) > 5e-7
                else ""
            ),
            f"step       {self.first_step_s:.2e} s at first, about {self.smallest_step_s:.2e} s once the yarns are tight"
            + (f" (mass scaled by {self.inertia:.2g})" if self.inertia > 1.0 else ""),
            f"steps      about {self.steps:,} for {self.simulated_s:.3g} s of simulated time",
            f"duration   about {self.duration_s:.1f} s with {self.threads} thread{'s' * (self.threads > 1)}"
            " (once the kernels are compiled)",
            f"memory     about {self.memory_MB:.0f} MB",
            *(f"warning    {warning}" for warning in self.warnings),
        ]


def forecast(study: Study) -> Forecast:
    """Estimate what a run of a study would take."""
    grid, fabric, model = study.grid, study.fabric, study.model
    density = fabric.areal_density * model.solver.mass_scaling
    mass = density * grid.cell_area
    contact = sum(tool.stiffness for tool in study.tools) * grid.cell_area

    def step(warp_strain: float, weft_strain: float) -> float:
        warp = _tangent(fabric.warp, grid.weft_pitch, warp_strain) / grid.warp_pitch
        weft = _tangent(fabric.weft, grid.warp_pitch, weft_strain) / grid.weft_pitch
        return model.solver.safety * stable_step(max(warp, weft), contact, mass, model.solver.viscosity)

    def made(stable: float) -> float:
        """The step that a run makes: where the stable one is shorter than the least, the mass is scaled."""
        return max(stable, model.solver.least_step_s)

    stable = step(
        _strain_at(fabric.warp, grid.weft_pitch, WORKING_FORCE), _strain_at(fabric.weft, grid.warp_pitch, WORKING_FORCE)
    )
    first, tight = made(step(0.0, 0.0)), made(stable)
    inertia = (tight / stable) ** 2
    time = case_of(study).end
    steps = int(0.5 * time * (1.0 / first + 1.0 / tight))
    threads = threads_for(grid.cell_count, None)
    blank = blank_summary(study)
    places = grid.cells.size
    return Forecast(
        study=study.name,
        cells=grid.cell_count,
        half_cells=int(blank["half_cells"]),
        cell_length_mm=(grid.warp_pitch, grid.weft_pitch),
        mass_kg=float(blank["mass_kg"]),
        area_mm2=float(blank["area_mm2"]),
        area_error=float(blank["area_error"]),
        first_step_s=first,
        smallest_step_s=tight,
        inertia=inertia,
        simulated_s=time,
        steps=steps,
        threads=threads,
        duration_s=steps * places * NS_PER_CELL_STEP * 1e-9 / threads,
        memory_MB=150.0 + places * 500e-6,
        warnings=_warnings(study, steps, float(blank["area_error"]), inertia),
    )


def _tangent(law: TensionLaw, spacing: float, strain: float) -> float:
    return float(np.max(law.line_law(spacing).slope(np.linspace(0.0, strain, 20))))


def _strain_at(law: TensionLaw, spacing: float, force: float) -> float:
    """Nominal strain at a tension per width [N/mm]."""
    line = law.line_law(spacing)
    strain = np.linspace(0.0, 0.05, 2001)
    return float(np.interp(force * spacing, line.value(strain), strain))


def _warnings(study: Study, steps: int, area_error: float, inertia: float) -> list[str]:
    found = case_of(study).warnings()
    model, grid = study.model, study.grid
    if isinstance(model, FormingModel):
        target = model.blank.cell_length_mm
        change = max(abs(grid.warp_pitch / target - 1.0), abs(grid.weft_pitch / target - 1.0))
        if change > 0.05:
            found.append(
                f"the cell length was changed by {100 * change:.1f} % to meet the outline; "
                "blank.fit_cells = false keeps it"
            )
    if abs(area_error) > 0.01:
        found.append(f"the cells cover {100 * area_error:+.1f} % of the outline's area; smaller cells come closer")
    if inertia > MUCH_INERTIA:
        found.append(
            f"solver.least_step_s scales the mass by {inertia:.2g} once the yarns are tight: kinetic energy may be too large; "
            "lower it in proportion to the cells"
        )
    if steps > model.solver.most_steps:
        found.append("more steps than solver.most_steps allows: the run would stop before its end")
    return found
