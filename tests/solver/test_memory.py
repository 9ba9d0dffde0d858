"""Memory of the solver grows with the cells and stays small."""

from __future__ import annotations

import numpy as np
import pytest
from small_problems import pressed, whole_grid

from weftform.solver import survey

MOST = 400.0
"""Bytes per cell, three tools included."""


def bytes_per_cell(simulation):
    arrays = [
        value
        for part in (simulation.sheet, simulation.machine)
        for value in vars(part).values()
        if isinstance(value, np.ndarray)
    ]
    return sum(array.nbytes for array in arrays) / simulation.problem.grid.cell_count


def test_memory_is_linear_in_the_cells():
    # rows are padded to one of a few widths, so small blanks differ by that
    for n in (50, 100, 200):
        assert bytes_per_cell(pressed(whole_grid(n, n, length=0.5))) < MOST


@pytest.mark.slow
def test_a_million_cells_run():
    simulation = pressed(whole_grid(1000, 1000, length=0.15), threads=2)
    assert bytes_per_cell(simulation) < 0.5 * MOST
    simulation.advance_to(12 * simulation.step)
    assert simulation.steps >= 8
    assert simulation.last[survey.FINITE]
