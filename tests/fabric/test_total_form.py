"""The law as a function of state, against closed forms and against its own definition as a rate.

Numbers in the tables are quoted to so many decimals, so the tolerance is half a unit of the last one.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from weftform.fabric import Fabric, LinearLaw, PolynomialLaw, ShearLaw
from weftform.fabric.total_form import as_shear_law, total_form, yarn_kinematics

EQ_10 = np.array([0.0829, -1.3447, 9.0399, -23.9304, 22.9438])
"""G12 [MPa] as printed, constant first, of the shear angle in radians."""

MODULI = (35_400.0, 17_700.0, 10.0)


def turn(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def gradient(warp_stretch, weft_stretch, shear_angle, rigid_turn=0.0) -> np.ndarray:
    """Columns: the warp along x, the weft closed onto it by the shear angle, both turned."""
    sheared = np.array([[warp_stretch, weft_stretch * np.sin(shear_angle)], [0.0, weft_stretch * np.cos(shear_angle)]])
    return turn(rigid_turn) @ sheared


def trellis(angle) -> np.ndarray:
    """Gradients [..., 2, 2] of two yarns that close symmetrically by a shear angle [...] and keep their
    length."""
    c, s = np.cos(angle / 2), np.sin(angle / 2)
    return np.moveaxis(np.array([[c, s], [s, c]]), (0, 1), (-2, -1))


def components(stress: np.ndarray) -> tuple[float, float, float]:
    return stress[0, 0], stress[1, 1], stress[0, 1]


states = st.builds(
    gradient,
    st.floats(0.6, 1.8),
    st.floats(0.6, 1.8),
    st.floats(-1.2, 1.2),
    st.floats(-np.pi, np.pi),
)
rates = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).map(lambda v: np.reshape(v, (2, 2)))


@pytest.mark.parametrize(
    ("given_gradient", "expected", "last_digit"),
    [
        ([[1.02, 0.3], [0.0, 1.01]], (776.744, 848.652, 254.962), 1e-3),  # A
        (turn(np.pi / 2) @ [[1.02, 0.3], [0.0, 1.01]], (848.652, 776.744, -254.962), 1e-3),  # A, turned
        ([[1.0, 0.5], [0.0, 1.0]], (396.819, 1578.002, 793.637), 1e-3),  # C
        (turn(np.pi / 6) @ np.diag([1.05, 1.02]), (1383.0055, 694.6728, 596.1136), 1e-4),  # D
    ],
    ids=["A", "A-turned", "C-simple-shear", "D-turned-stretch"],
)
def test_closed_forms(given_gradient, expected, last_digit):
    stress = total_form(np.asarray(given_gradient), *MODULI).stress
    np.testing.assert_allclose(components(stress), expected, atol=0.5 * last_digit, rtol=0)


def test_trellis():
    """B: both yarns turn by half the shear angle towards each other and keep their length.

    The quoted stresses are those of Eq. 8 over 0.62 mm, the law of the card.
    """
    angle = np.radians([10.0, 20.0, 30.0, 40.0])
    state = total_form(trellis(angle), *MODULI[:2], Fabric.load("hexforce-48600-c1300").shear)
    expected = [0.0052030, 0.0101458, 0.0225730, 0.0953535]
    np.testing.assert_allclose(state.shear_stress, expected, atol=0.5e-7, rtol=0)
    np.testing.assert_allclose(state.kinematics.shear_angle, angle, rtol=1e-14)
    # No yarn stretches, so what is left is rounding of ln 1 times the modulus.
    np.testing.assert_allclose(state.warp_stress, 0.0, atol=1e-15 * MODULI[0])


def test_printed_modulus_is_the_card_law_rounded_twice():
    """Eq. 10 differs from the derivative of Eq. 8 over 0.62 mm by 1.8e-4 MPa in one coefficient
    (gamma^1): 0.1 %."""
    angle = np.radians([10.0, 20.0, 30.0, 40.0])
    printed = PolynomialLaw(tuple(EQ_10 / np.arange(1, 6)), np.pi / 2)
    card = Fabric.load("hexforce-48600-c1300").shear
    np.testing.assert_allclose(printed.value(angle), card.shear_stress(angle), rtol=1e-3)


def test_closed_loop_returns_to_no_stress():
    """E for a function of state: the end of the loop is the undeformed cell."""
    assert np.abs(total_form(np.eye(2), *MODULI).stress).max() == 0.0


@pytest.mark.parametrize(("degrees", "newton"), [(20.0, 0.027722), (40.0, 0.288261)])
def test_square_cell_pulled_on_its_diagonal(degrees, newton):
    """G: the diagonal of a cell with inextensible sides a is 2 a cos(pi/4 - gamma/2).

    Its force F does the work of the membrane, F d(diagonal) = e a^2 cos(gamma) (stress : D), and with no
    stretch the right side is e a^2 cos(gamma) tau dgamma, so F = a F_sh(gamma) cos(gamma) / sin(pi/4 -
    gamma/2). The test takes the power from the stress tensor and a finite rate of deformation instead of
    using that formula, then compares both.
    """
    side, gamma, step = 2.69, np.radians(degrees), 1e-5
    fabric = Fabric.load("hexforce-48600-c1300")

    velocity_gradient = (trellis(gamma + step) - trellis(gamma - step)) @ np.linalg.inv(trellis(gamma))
    stress = total_form(trellis(gamma), 3.9, 3.9, fabric.shear).stress
    work = np.sum(stress * velocity_gradient) * fabric.thickness * side**2 * np.cos(gamma)

    def diagonal(angle):
        return side * np.hypot(*trellis(angle).sum(axis=1))

    force = work / (diagonal(gamma + step) - diagonal(gamma - step))
    closed = side * fabric.normalised_shear_force(gamma) * np.cos(gamma) / np.sin(np.pi / 4 - gamma / 2)
    # Central differences: relative error step^2 times a factor of order one, plus rounding / step.
    assert force == pytest.approx(closed, rel=1e-9)
    assert closed == pytest.approx(newton, abs=0.5e-6)


@settings(deadline=None, derandomize=True, max_examples=60)
@given(states, st.floats(-np.pi, np.pi))
def test_rigid_turn_leaves_the_stress_co_rotated(state, angle):
    before, after = (total_form(f, *MODULI) for f in (state, turn(angle) @ state))
    # Rounding: some tens of operations on numbers of the size of the moduli.
    atol = 1e-13 * MODULI[0]
    np.testing.assert_allclose(after.stress, turn(angle) @ before.stress @ turn(angle).T, atol=atol)
    np.testing.assert_allclose(after.shear_stress, before.shear_stress, atol=1e-12 * MODULI[2])


@settings(deadline=None, derandomize=True, max_examples=60)
@given(states, rates)
def test_frame_shears_and_power(state, rate):
    """2 D12 of the two frames is dgamma +- (dln l2 - dln l1) tan gamma, and stress : D is conjugate to all
    three."""
    step = 1e-6
    ahead, behind = (yarn_kinematics(state + sign * step * rate) for sign in (1.0, -1.0))
    d_warp = (ahead.warp_log_strain - behind.warp_log_strain) / (2 * step)
    d_weft = (ahead.weft_log_strain - behind.weft_log_strain) / (2 * step)
    d_gamma = (ahead.shear_angle - behind.shear_angle) / (2 * step)

    velocity_gradient = rate @ np.linalg.inv(state)
    deformation_rate = 0.5 * (velocity_gradient + velocity_gradient.T)
    law = total_form(state, *MODULI)
    now = law.kinematics
    f, g = now.warp_direction, now.weft_direction
    in_warp_frame = 2.0 * f @ deformation_rate @ np.array([-f[1], f[0]])
    in_weft_frame = 2.0 * np.array([g[1], -g[0]]) @ deformation_rate @ g
    coupling = (d_weft - d_warp) * np.tan(now.shear_angle)
    # Central differences: truncation step^2 * third derivative, rounding 1e-16 / step; stretches from 0.6
    # and angles to 1.2 rad keep the derivatives below some hundreds.
    atol = 1e-8
    np.testing.assert_allclose(in_warp_frame, d_gamma + coupling, atol=atol)
    np.testing.assert_allclose(in_weft_frame, d_gamma - coupling, atol=atol)
    power = law.warp_stress * d_warp + law.weft_stress * d_weft + law.shear_stress * d_gamma
    np.testing.assert_allclose(np.sum(law.stress * deformation_rate), power, atol=atol * MODULI[0])


def test_many_states_at_once_equal_one_by_one():
    many = np.array([[gradient(1.1, 0.9, g, 2 * g) for g in (-0.5, 0.0, 0.7)], [np.eye(2)] * 3])
    together = total_form(many, *MODULI)
    assert together.stress.shape == (2, 3, 2, 2)
    for place in np.ndindex(2, 3):
        np.testing.assert_array_equal(together.stress[place], total_form(many[place], *MODULI).stress)


def test_shear_law_is_odd_whatever_it_is_made_from():
    law = PolynomialLaw((10.0,), 1.0)
    for shear in (10.0, LinearLaw(10.0), law, ShearLaw(law, 1.0)):
        np.testing.assert_allclose(as_shear_law(shear).shear_stress(np.array([-0.3, 0.3])), [-3.0, 3.0])


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (np.eye(3), "shape"),
        (np.diag([1.0, np.nan]), "finite"),
        (np.diag([1.0, -1.0]), "determinant"),
        (np.zeros((2, 2)), "determinant"),
    ],
)
def test_impossible_gradients_are_refused(bad, message):
    with pytest.raises(ValueError, match=message):
        total_form(bad, *MODULI)
