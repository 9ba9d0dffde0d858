"""The membrane of the time loop against the state function of ``weftform.fabric`` and its power."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from weftform.fabric import Fabric, LinearLaw, ShearLaw, TabulatedLaw
from weftform.fabric.piecewise import SHEAR_FIT_TOLERANCE, pack_shear
from weftform.fabric.total_form import total_form, yarn_kinematics
from weftform.mechanics.membrane import (
    covariant_forces,
    half_tangent,
    log_stretch,
    shear_angle,
    shear_stress,
    shear_stress_slope,
)

MODULI = (35_400.0, 17_700.0, 10.0)
VOLUME = 0.62 * 2.69**2

stretches, angles = st.floats(0.6, 1.8), st.floats(-1.3, 1.3)
rates = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).map(lambda v: np.reshape(v, (2, 2)))


def gradient(warp, weft, angle, rigid_turn=0.4):
    c, s = math.cos(rigid_turn), math.sin(rigid_turn)
    return np.array([[c, -s], [s, c]]) @ [[warp, weft * math.sin(angle)], [0.0, weft * math.cos(angle)]]


def metric(f):
    return f[:, 0] @ f[:, 0], f[:, 1] @ f[:, 1], f[:, 0] @ f[:, 1]


def forces(f, shear=MODULI[2]):
    """Forces on the covariant vectors, shape [2, 2] (columns), from the law as a function of state."""
    state = total_form(f, *MODULI[:2], shear)
    a11, a12, a22 = covariant_forces(
        VOLUME, *metric(f), float(state.warp_stress), float(state.weft_stress), float(state.shear_stress)
    )
    return np.column_stack([a11 * f[:, 0] + a12 * f[:, 1], a12 * f[:, 0] + a22 * f[:, 1]])


@settings(deadline=None, derandomize=True, max_examples=80)
@given(stretches, stretches, angles)
def test_shear_angle_from_the_metric(warp, weft, angle):
    g = metric(gradient(warp, weft, angle))
    # J is the root of a difference: rounding grows by 1 / cos(gamma)^2, which is 14 at 1.3 rad.
    assert half_tangent(*g) == pytest.approx(math.tan(angle / 2), rel=1e-13, abs=1e-14)
    assert shear_angle(*g) == pytest.approx(angle, rel=1e-13, abs=1e-14)


@settings(deadline=None, derandomize=True, max_examples=80)
@given(stretches, stretches, angles)
def test_forces_are_the_stress_of_the_state_function(warp, weft, angle):
    """The force on g_i is V0 times a column of the first Piola stress, J sigma F^-T, at constant
    thickness."""
    f = gradient(warp, weft, angle)
    stress = total_form(f, *MODULI).stress
    piola = np.linalg.det(f) * stress @ np.linalg.inv(f).T
    # Rounding, amplified by the condition of F (at most 3 / cos(1.3) = 11, squared in the metric).
    np.testing.assert_allclose(forces(f), VOLUME * piola, atol=1e-12 * VOLUME * MODULI[0])


@settings(deadline=None, derandomize=True, max_examples=80)
@given(stretches, stretches, angles, rates)
def test_power_of_the_forces_is_that_of_strains_and_angle(warp, weft, angle, rate):
    """f . dg is the power V J (s1 dln l1 + s2 dln l2 + tau dgamma), the rates by central differences."""
    f, step = gradient(warp, weft, angle), 1e-6
    ahead, behind = (yarn_kinematics(f + sign * step * rate) for sign in (1.0, -1.0))
    state = total_form(f, *MODULI)
    power = (
        VOLUME
        * np.linalg.det(f)
        / (2 * step)
        * (
            state.warp_stress * (ahead.warp_log_strain - behind.warp_log_strain)
            + state.weft_stress * (ahead.weft_log_strain - behind.weft_log_strain)
            + state.shear_stress * (ahead.shear_angle - behind.shear_angle)
        )
    )
    # Truncation step^2 times a third derivative (some hundreds), rounding 1e-16 / step.
    assert np.sum(forces(f) * rate) == pytest.approx(power, abs=1e-8 * VOLUME * MODULI[0])


@settings(deadline=None, derandomize=True, max_examples=40)
@given(stretches, stretches, angles)
def test_the_pair_of_forces_makes_no_moment(warp, weft, angle):
    f = gradient(warp, weft, angle)
    f1, f2 = forces(f).T
    moment = f[0, 0] * f1[1] - f[1, 0] * f1[0] + f[0, 1] * f2[1] - f[1, 1] * f2[0]
    assert abs(moment) < 1e-13 * VOLUME * MODULI[0]


@pytest.mark.parametrize(("degrees", "newton"), [(20.0, 0.027722), (40.0, 0.288261)])
def test_square_cell_pulled_on_its_diagonal(degrees, newton):
    """Closed form G from the forces of the loop: the work of the two covariant forces is that of the pull.

    With inextensible sides a, the diagonal is 2 a cos(pi/4 - gamma/2), so ddiagonal/dgamma = a sin(pi/4 -
    gamma/2), and the pull is a F_sh(gamma) cos(gamma) / sin(pi/4 - gamma/2).
    """
    angle = math.radians(degrees)
    fabric = Fabric.load("hexforce-48600-c1300")
    law = pack_shear(fabric.shear.stress)
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    f, rate = np.array([[c, s], [s, c]]), 0.5 * np.array([[-s, c], [c, -s]])
    tau = shear_stress(law.coefficients, law.degree, law.pieces, law.width, law.end_slope, half_tangent(*metric(f)))
    a11, a12, a22 = covariant_forces(VOLUME, *metric(f), 0.0, 0.0, tau)
    pulls = np.column_stack([a11 * f[:, 0] + a12 * f[:, 1], a12 * f[:, 0] + a22 * f[:, 1]])
    force = np.sum(pulls * rate) / (2.69 * math.sin(math.pi / 4 - angle / 2))
    assert force == pytest.approx(newton, abs=0.5e-6)


def test_work_depends_on_the_path_at_constant_thickness():
    """Stress is a function of state, work is not: the volume e A0 J of a sheet of constant thickness changes
    with gamma.

    Round the loop stretch, shear, unstretch, unshear the stretch is given V E int ln l dl of work at gamma =
    0 and gives cos(gamma) times that back; the shear takes l times what it gives back. The energy ledger has
    to integrate the power.
    """
    steps, stretch, angle = 400, 1.02, math.radians(45.0)
    ramp, one = np.linspace(0.0, 1.0, steps + 1), np.ones(steps)
    up, down = ramp[1:], ramp[-2::-1]
    warp = 1.0 + (stretch - 1.0) * np.concatenate([[0.0], up, one, down, 0 * one])
    gamma = angle * np.concatenate([[0.0], 0 * one, up, one, down])
    path = [gradient(w, 1.0, g) for w, g in zip(warp, gamma, strict=True)]
    middle = [0.5 * (a + b) for a, b in pairwise(path)]
    work = sum(np.sum(forces(m) * (b - a)) for m, (a, b) in zip(middle, pairwise(path), strict=True))
    stretching = MODULI[0] * (stretch * math.log(stretch) - stretch + 1.0) * (1.0 - math.cos(angle))
    shearing = MODULI[2] * (stretch - 1.0) * (angle * math.sin(angle) + math.cos(angle) - 1.0)
    # Midpoint rule over 400 steps in each leg: relative error of order 1 / 400^2, a few in front.
    assert work == pytest.approx(VOLUME * (stretching + shearing), rel=5e-5)


def test_a_folded_cell_keeps_a_finite_force():
    assert all(map(math.isfinite, covariant_forces(VOLUME, 1.0, 1.0, 1.0, 10.0, 10.0, 1.0)))
    assert math.isfinite(half_tangent(1.0, 1.0, 1.0))


@pytest.mark.parametrize("stretch", [0.5, 0.8, 0.999, 1.0, 1.001, 1.2, 2.0])
def test_log_stretch_of_the_series_of_artanh(stretch):
    """ln l = artanh(y); cut after y^(2n-1), the rest is below y^(2n+1) / (2n+1) / (1 - y^2)."""
    terms = 8
    series = 1.0 / np.arange(2 * terms - 1, 0, -2)
    y = (stretch**2 - 1) / (stretch**2 + 1)
    rest = abs(y) ** (2 * terms + 1) / (2 * terms + 1) / (1 - y * y)
    assert abs(log_stretch(stretch**2, tuple(series)) - math.log(stretch)) <= rest + 1e-15


SHEAR_LAWS = {
    "card": Fabric.load("hexforce-48600-c1300").shear,
    "constant": ShearLaw(LinearLaw(1.5), math.pi / 2),
    "tabulated": ShearLaw(TabulatedLaw((0.0, 0.35, 0.7, 1.05), (0.0, 0.01, 0.1, 0.9)), 1.05),
    "none": ShearLaw(LinearLaw(0.0), math.pi / 2),
}


@pytest.mark.parametrize("name", SHEAR_LAWS)
def test_shear_stress_in_the_half_tangent_follows_the_law(name):
    law = SHEAR_LAWS[name]
    packed = pack_shear(law.stress)
    call = (packed.coefficients, packed.degree, packed.pieces, packed.width, packed.end_slope)
    angle = np.radians(np.linspace(0.1, 89.9, 180))
    fitted = np.array([shear_stress(*call, t) for t in np.tan(angle / 2)])
    other_way = np.array([shear_stress(*call, -t) for t in np.tan(angle / 2)])
    scale = np.abs(law.shear_stress(np.pi / 2))
    # A polynomial is fitted within SHEAR_FIT_TOLERANCE of the largest ratio tau / t, between nodes perhaps
    # twice that. A table becomes 1024 monotone cubics, each within width^2 of a ratio with jumps in its
    # second derivative.
    tolerance = 2 * SHEAR_FIT_TOLERANCE if packed.pieces == 1 else 20 / 1024**2
    np.testing.assert_allclose(fitted, law.shear_stress(angle), atol=tolerance * scale)
    np.testing.assert_array_equal(other_way, -fitted)  # odd, to the last bit
    assert shear_stress(*call, 0.0) == 0.0


def test_shear_stress_takes_the_sign_of_its_law():
    """A law that opposes nothing but pushes on, tau = -t: odd as any other."""
    for t in (-0.5, 0.5):
        assert shear_stress(np.array([0.0, -1.0]), 1, 1, 1.0, 0.0, t) == -t


@pytest.mark.parametrize("name", SHEAR_LAWS)
def test_slope_of_the_shear_stress(name):
    packed = pack_shear(SHEAR_LAWS[name].stress)
    call = (packed.coefficients, packed.degree, packed.pieces, packed.width, packed.end_slope)
    step, scale = 1e-6, shear_stress(*call, 1.0)
    for t in (-0.8, -0.3, 0.0, 0.1, 0.45, 0.9):
        difference = (shear_stress(*call, t + step) - shear_stress(*call, t - step)) / (2 * step)
        # At t = 0 and at a knot of the cubics the second derivative jumps, and the difference errs by step
        # times the jump; it is a few times the stress at the end of the law, which is the scale. Rounding is
        # far below.
        assert shear_stress_slope(*call, t) == pytest.approx(difference, rel=1e-6, abs=20 * step * scale)
