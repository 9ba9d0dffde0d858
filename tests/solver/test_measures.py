"""Strains and angles that surveys and the ledger find, against those of the result fields."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_problems import FABRIC, bias_grid, free, whole_grid

from weftform.result.fields import STRAIN, Fields
from weftform.solver import layout as at
from weftform.solver import survey

GRIDS = [
    pytest.param(whole_grid(10, 9), id="whole"),
    pytest.param(bias_grid(7), id="half cells"),
    pytest.param(bias_grid(8, planes=("x", "y")), id="half cells on planes of symmetry"),
]


def disturbed(grid, seed=3):
    """A patch whose crossings are out of their places by a tenth of a cell: any corner may have closed most."""
    simulation = free(grid)
    moved = np.random.default_rng(seed).normal(0.0, 0.1 * grid.warp_pitch, (*grid.shape, 3))
    moved[..., :2][grid.on_plane] = 0.0
    for c in range(3):
        simulation.sheet.state[simulation.sheet.row_index, at.POSITION + c, : grid.shape[1]] += moved[..., c]
    return simulation, Fields(grid, FABRIC, simulation.positions)


@pytest.mark.parametrize("grid", GRIDS)
def test_largest_angle_between_connectors(grid):
    simulation, fields = disturbed(grid)
    simulation.ledger()
    assert math.degrees(simulation.largest_shear) == pytest.approx(fields.largest_shear(), rel=1e-12)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("grid", [*GRIDS, pytest.param(bias_grid(8), id="half cells at the end of a block")])
def test_survey_finds_the_extremes(grid, seed):
    simulation, fields = disturbed(grid, seed)
    found = simulation._survey()
    warp, weft = (
        fields._lines[direction][STRAIN][lines > 0.0]
        for direction, lines in ((True, grid.warp_lines), (False, grid.weft_lines))
    )
    assert found[survey.WARP_STRAIN] == pytest.approx(warp.max(), rel=1e-12)
    assert found[survey.WEFT_STRAIN] == pytest.approx(weft.max(), rel=1e-12)
    assert found[survey.SLACKEST] == pytest.approx(min(warp.min(), weft.min()), rel=1e-12)
    expected = np.tan(0.5 * np.nanmax(np.abs(fields.shear_angle)))
    assert found[survey.HALF_TANGENT] == pytest.approx(expected, rel=1e-12)
