"""From a declared study to the problem that the solver advances."""

from __future__ import annotations

from weftform.solver import Motion, Problem, Settings
from weftform.study.study import Study


def settings_of(study: Study, ramp: float) -> Settings:
    """Numerical settings of a study."""
    solver = study.model.solver
    return Settings(
        ramp=ramp,
        mass_scaling=solver.mass_scaling,
        damping=solver.damping_per_s,
        hourglass=solver.hourglass,
        safety=solver.safety,
        most_steps=solver.most_steps,
    )


def forming_problem(study: Study) -> Problem:
    """A blank between rigid tools: the holder closes during ``closing_s``, then the stroke is made in ``duration_s``."""
    loading = study.model.loading
    end = loading.closing_s + loading.duration_s
    stroke = Motion((loading.closing_s, end), (0.0, loading.stroke_mm))
    closing = max(loading.closing_s, 1e-12)
    return Problem(
        grid=study.grid,
        fabric=study.fabric,
        tools=study.tools,
        motions=(stroke, Motion((0.0, closing), (0.0, 1.0))),
        stroke=0,
        holding=1,
        settings=settings_of(study, loading.ramp),
    )
