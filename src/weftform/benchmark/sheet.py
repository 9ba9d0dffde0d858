"""The sheet that is timed: the shipped hemisphere on a whole blank, in the middle of its stroke."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from weftform.cases import case_of
from weftform.mechanics.compiled import FASTMATH
from weftform.mechanics.contact import rounded_edge
from weftform.solver import Problem, Simulation, loop
from weftform.solver import layout as at
from weftform.solver.simulation import LEDGER_EVERY
from weftform.study import Study

Floats = NDArray[np.float64]

STUDY = "hemisphere-0-90"
SIDE_MM = 150.0
SOURCE_CELLS = 56
"""Cells along a side of the blank that is formed; finer and coarser sheets take over its shape."""
PART_OF_STROKE = 0.6
"""Share of the time of the stroke that has passed when the clock starts: crossings lie on dome, fillet and holder, some
sticking, some slipping."""
PART_OF_SHAPE = 0.002
"""Share of the shape that a sheet without tools starts from: a formed blank let go at once would whip about."""
MOST_PENETRATION_MM = 2.0e-3
PUSHES = 3
SETTLING = 512
"""Steps after a shape has been taken over, so that contact and friction belong to the sheet itself."""


def sheet_study(cells: int) -> Study:
    """The study on a whole blank with ``cells`` cells along a side; the least step goes with the length of a cell."""
    least = Study.load(STUDY).model.solver.least_step_s * min(1.0, SOURCE_CELLS / cells)
    return Study.load(
        STUDY, {"blank.symmetry": "full", "blank.cell_length_mm": SIDE_MM / cells, "solver.least_step_s": least}
    )


def sheet_problem(cells: int, contact: bool) -> Problem:
    """What is advanced; without contact the same sheet with the tools taken away."""
    problem = case_of(sheet_study(cells)).problem()
    return problem if contact else replace(problem, tools=(), motions=(), stroke=-1, holding=-1)


@cache
def formed_source(cells: int = SOURCE_CELLS, part: float = PART_OF_STROKE) -> Simulation:
    """The blank formed from flat for ``part`` of the time of the stroke."""
    study = sheet_study(cells)
    case = case_of(study)
    simulation = Simulation(case.problem())
    simulation.advance_to(case.begin + part * (case.end - case.begin))
    return simulation


MAKERS: dict[str, Callable[[Problem, int], Simulation]] = {
    "cpu": Simulation,
    "cuda": lambda problem, threads: Simulation(problem, threads, "cuda"),
}
"""What advances a problem on each device. Another device adds itself here; it has to restore checkpoints."""


def same_sheet(simulation: Simulation, threads: int, device: str) -> Simulation:
    """The same sheet in the same state, advanced by other threads or another device (one of :data:`MAKERS`)."""
    twin = MAKERS[device](simulation.problem, threads)
    twin.restore(simulation.checkpoint())
    return twin


def formed_sheet(cells: int, contact: bool, source: Simulation | None = None) -> Simulation:
    """A sheet in the middle of its stroke.

    Parameters
    ----------
    cells
        Along a side.
    contact
        With the three tools; without, the formed sheet springs back freely.
    source
        The formed blank whose shape, speed, friction and clock are taken over; :func:`formed_source` without.

    Returns
    -------
    A simulation that has made at least :data:`SETTLING` steps of its own.
    """
    source = source or formed_source()
    simulation = Simulation(sheet_problem(cells, contact))
    taken, saved = source.checkpoint(), simulation.checkpoint()
    rows, columns = simulation.rows, simulation.columns
    for k in range(at.POSITION, at.POSITION + 6):
        found = _on_grid(taken["fields"][:, k, : source.columns], rows, columns)
        if not contact:
            flat = saved["fields"][:, k, :columns]
            found = flat + PART_OF_SHAPE * (found - flat)
        saved["fields"][:, k, :columns] = found
    if contact:
        for name in ("poses", "tools"):
            saved[name] = taken[name]
        for tool in range(len(simulation.problem.tools)):
            for c in range(3):
                saved["grip"][:, tool, c, :columns] = _on_grid(
                    taken["grip"][:, tool, c, : source.columns], rows, columns
                )
    if contact:
        # what the cells of the source cut off at fillets would be thrown out by the finer sheet's contact
        for _ in range(PUSHES):
            _push_out(saved["fields"], columns, saved["tools"], saved["poses"], MOST_PENETRATION_MM)
    saved["clock"][loop.C_TIME] = taken["clock"][loop.C_TIME]
    # cautious until a survey has seen how taut the yarns are
    saved["clock"][[loop.C_STEP, loop.C_LAST_STEP]] = 0.1 * min(simulation.step, source.step)
    simulation.restore(saved)
    settled = simulation.steps + SETTLING
    while simulation.steps < settled:
        simulation.advance_to(simulation.time + 64 * simulation.step)
    # past the short batches of a start, and just after an entry of the ledger
    late = simulation.checkpoint() | {"surveys": taken["surveys"] // LEDGER_EVERY * LEDGER_EVERY}
    simulation.restore(late)
    return simulation


@numba.njit(fastmath=FASTMATH, error_model="numpy", cache=True)
def _push_out(fields: Any, columns: int, tools: Any, poses: Any, allowed: float) -> None:
    """Move crossings that are deeper in a tool than ``allowed`` to its surface."""
    for j in range(fields.shape[0]):
        for i in range(columns):
            for k in range(tools.shape[0]):
                t = tools[k]
                x, y, z = fields[j, 0, i], fields[j, 1, i], fields[j, 2, i]
                away = math.sqrt(x * x + y * y)
                distance, normal_s, normal_z = rounded_edge(away, z - poses[k, 0], t[0], t[1], t[2], t[3], t[4])
                gap = distance - t[5]
                if gap < -allowed:
                    radial = normal_s / max(away, 1e-12)
                    fields[j, 0, i] -= gap * x * radial
                    fields[j, 1, i] -= gap * y * radial
                    fields[j, 2, i] -= gap * normal_z


def _on_grid(field: Floats, rows: int, columns: int) -> Floats:
    """A field of crossings on a grid with other numbers of rows and columns, by bicubic splines."""
    if field.shape == (rows, columns):
        return field
    from scipy.interpolate import RectBivariateSpline

    along = [np.linspace(0.0, 1.0, n) for n in field.shape]
    spline = RectBivariateSpline(*along, field)
    found: Floats = spline(np.linspace(0.0, 1.0, rows), np.linspace(0.0, 1.0, columns))
    return found
