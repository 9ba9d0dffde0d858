"""The stable step of a simulation, from what a survey found."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from weftform.mechanics import stable_step as stability
from weftform.solver import loop, survey
from weftform.solver.machine import Machine
from weftform.solver.material import Material, largest
from weftform.solver.problem import Problem

Floats = NDArray[np.float64]

HOLDER_PERIODS = 20.0
"""Automatic mass of a force-driven tool: one radian of its bounce on the contact takes this many initial steps."""


def fabric_step(problem: Problem, material: Material, density: float, found: Floats) -> float:
    """Stable step of the fabric and its contacts [s], without a safety.

    Tangents are taken at the largest strains of the whole blank: safe wherever a law stiffens, and never far from the truth
    (docs/theory/dynamics.md).

    Parameters
    ----------
    density
        Mass per area [tonne/mm2].
    found
        Entries of a survey, shape [survey.ENTRIES].
    """
    grid = problem.grid
    warp_force, warp_slope = largest(material.warp, found[survey.WARP_STRAIN])
    weft_force, weft_slope = largest(material.weft, found[survey.WEFT_STRAIN])
    t = min(found[survey.HALF_TANGENT], 1.0)
    sine = 2.0 * t / (1.0 + t * t)
    ratio, ratio_slope = largest(material.shear, t)
    modulus = 0.5 * (ratio + t * ratio_slope) * (1.0 + t * t) + t * ratio
    aspect = grid.cell_area / min(grid.warp_pitch, grid.weft_pitch) ** 2
    cell = problem.fabric.thickness * aspect * (modulus / max(1.0 - sine, 1e-3) + sum(material.moduli))
    # a yarn under tension resists sideways with its force over its length
    taut = max(warp_force, 0.0) / grid.warp_pitch + max(weft_force, 0.0) / grid.weft_pitch
    crossing = stability.crossing_stiffness(
        warp_slope / grid.warp_pitch, weft_slope / grid.weft_pitch, cell + taut, sine
    )
    contact = sum(tool.stiffness for tool in problem.tools) * grid.cell_area
    return stability.stable_step(crossing, contact, density * grid.cell_area, problem.settings.viscosity)


def holder_step(machine: Machine) -> float:
    """Stable step of the tools that are pushed, with the contact on the whole blank as their spring [s]."""
    masses, springs = machine.tools[:, loop.T_MASS], machine.springs
    return min(
        (2.0 * math.sqrt(mass / spring) for mass, spring in zip(masses, springs, strict=True) if mass > 0.0),
        default=math.inf,
    )


def choose_holder_mass(machine: Machine, step: float) -> None:
    """Give the tools that are pushed a mass where the study gives none, and half of critical damping of their bounce."""
    for row, spring in zip(machine.tools, machine.springs, strict=True):
        if row[loop.T_MASS] == 0.0:
            continue
        if np.isnan(row[loop.T_MASS]):
            row[loop.T_MASS] = spring * (HOLDER_PERIODS * step) ** 2
        row[loop.T_DAMPING] = math.sqrt(spring / row[loop.T_MASS])
