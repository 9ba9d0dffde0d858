"""Rows shared between threads so that all have the same work."""

import numpy as np
import pytest
from small_problems import pressed, whole_grid

from weftform.solver.bands import EDGE_COST, FACE_COST, LEAST_ROWS, contact_cost, even_edges, share_rows


@pytest.mark.parametrize("bands", [1, 2, 3, 7])
def test_bands_of_equal_rows_differ_by_a_row_at_most(bands):
    """The first has no row before it to do again, so it gets one more."""
    sizes = np.diff(even_edges(np.full(70, 40), bands))
    assert sizes.sum() == 70
    work = sizes + (np.arange(bands) > 0)
    assert work.max() - work.min() <= 1


@pytest.mark.parametrize("bands", [2, 3, 6])
def test_no_band_is_too_narrow_however_uneven_the_rows(bands):
    for cost in (np.geomspace(1, 1e6, 24), np.geomspace(1e6, 1, 24), np.eye(24)[12] * 1000 + 1):
        edges = even_edges(cost, bands)
        assert edges[0] == 0 and edges[-1] == 24
        assert (np.diff(edges) >= LEAST_ROWS).all()


def test_a_round_blank_is_shared_by_its_cells():
    """Rows of a quarter disc get shorter: half of the area lies below 0.40 of the radius."""
    y = (np.arange(400) + 0.5) / 400
    cost = (1000 * np.sqrt(1.0 - y**2)).astype(np.int64)
    assert even_edges(cost, 2)[1] / 400 == pytest.approx(0.404, abs=0.004)


def test_contact_counts_where_tools_are():
    """Two plates over all of a patch, and a ball of radius 25 mm over its middle."""
    problem = pressed(whole_grid(20, 31)).problem
    under = (np.hypot(*np.moveaxis(problem.grid.flat[..., :2], -1, 0)) < 25.0).sum(axis=1)
    assert 0 < under.sum() < under.size * 21
    np.testing.assert_allclose(contact_cost(problem), 2 * FACE_COST * 21 + EDGE_COST * under, rtol=1e-12)


def test_rows_with_more_contact_make_narrower_bands():
    problem = pressed(whole_grid(20, 31)).problem
    below, middle, above = np.diff(share_rows(problem, 3))
    assert below + middle + above == 32
    assert middle < below and middle <= above
