"""The stable step against the eigenvalues of a small periodic net, and against the explicit scheme itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

from weftform.mechanics.stable_step import crossing_stiffness, stable_step

MASS = 3.0e-9


def net_stiffness(count, warp, weft, sine, grounded=0.0):
    """Stiffness of a periodic net of count x count crossings, two displacements each, shape [2 n^2, 2 n^2].

    Springs ``warp`` along one lattice direction and ``weft`` along the other, at an angle whose cosine is
    ``sine``; each acts along itself only. ``grounded`` holds every crossing by a spring in all directions.
    """
    along = {(1, 0): (warp, np.array([1.0, 0.0])), (0, 1): (weft, np.array([sine, math.sqrt(1 - sine**2)]))}
    stiffness = grounded * np.eye(2 * count * count)
    for i in range(count):
        for j in range(count):
            here = 2 * (i * count + j)
            for (di, dj), (spring, n) in along.items():
                there = 2 * ((i + di) % count * count + (j + dj) % count)
                block = spring * np.outer(n, n)
                for row, col, sign in (
                    (here, here, 1),
                    (there, there, 1),
                    (here, there, -1),
                    (there, here, -1),
                ):
                    stiffness[row : row + 2, col : col + 2] += sign * block
    return stiffness


CASES = [
    (1000.0, 1000.0, 0.0, 0.0),
    (1000.0, 10.0, 0.0, 0.0),
    (1000.0, 400.0, 0.6, 0.0),
    (1000.0, 1000.0, 0.9, 0.0),
    (1000.0, 400.0, -0.6, 50.0),
    (0.0, 0.0, 0.3, 70.0),
]


@pytest.mark.parametrize(("warp", "weft", "sine", "contact"), CASES)
def test_step_is_that_of_the_highest_mode(warp, weft, sine, contact):
    """With an even number of crossings the zig-zag fits in the net, so the estimate is exact."""
    largest = np.linalg.eigvalsh(net_stiffness(4, warp, weft, sine, contact))[-1]
    step = stable_step(crossing_stiffness(warp, weft, 0.0, sine), contact, MASS)
    assert step == pytest.approx(2.0 / math.sqrt(largest / MASS), rel=1e-12)


@pytest.mark.parametrize(("warp", "weft", "sine", "contact"), CASES)
def test_step_is_safe_where_the_zig_zag_does_not_fit(warp, weft, sine, contact):
    largest = np.linalg.eigvalsh(net_stiffness(5, warp, weft, sine, contact))[-1]
    step = stable_step(crossing_stiffness(warp, weft, 0.0, sine), contact, MASS)
    assert step <= 2.0 / math.sqrt(largest / MASS) * (1 + 1e-12)


@pytest.mark.parametrize("membrane", [0.5, 40.0])
def test_the_membrane_is_added_and_shortens_the_step(membrane):
    without, with_it = (crossing_stiffness(1000.0, 400.0, m, 0.6) for m in (0.0, membrane))
    assert with_it == pytest.approx(without + membrane, rel=1e-15)
    assert stable_step(with_it, 0.0, MASS) < stable_step(without, 0.0, MASS)


@pytest.mark.parametrize(("share", "stays"), [(0.99, True), (1.01, False)])
def test_central_differences_stay_bounded_below_the_step_and_grow_above_it(share, stays):
    stiffness = net_stiffness(4, 1000.0, 400.0, 0.6)
    step = share * stable_step(crossing_stiffness(1000.0, 400.0, 0.0, 0.6), 0.0, MASS)
    displacement = np.random.default_rng(2).normal(size=stiffness.shape[0])
    displacement -= displacement.reshape(-1, 2).mean(axis=0)[None].repeat(16, axis=0).ravel()
    velocity = np.zeros_like(displacement)
    start = np.linalg.norm(displacement)
    for _ in range(400):
        velocity -= step / MASS * (stiffness @ displacement)
        displacement += step * velocity
    # At 1 % above, the highest mode grows by exp(2 acosh(1.01)) = 1.33 a step, at 1 % below no mode exceeds
    # 1 / sqrt(1 - 0.99^2) = 7 times its start.
    assert (np.linalg.norm(displacement) < 8 * start) == stays
