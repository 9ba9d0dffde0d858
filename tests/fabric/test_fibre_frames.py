"""The incremental algorithm: it converges to the function of state, with second order, whatever the path."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from weftform.fabric import Fabric
from weftform.fabric.fibre_frames import Frames, integrate_fibre_frames, polar_rotation
from weftform.fabric.total_form import total_form

MODULI = (35_400.0, 17_700.0, 10.0)
TEST_A = np.array([[1.02, 0.3], [0.0, 1.01]])


def turn(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.moveaxis(np.array([[c, -s], [s, c]]), (0, 1), (-2, -1))


def gradients(log_warp, log_weft, shear_angle, rigid_turn):
    """Deformation gradients of shape [steps, 2, 2] from four histories of shape [steps]."""
    none = np.zeros_like(log_warp)
    sheared = np.array(
        [
            [np.exp(log_warp), np.exp(log_weft) * np.sin(shear_angle)],
            [none, np.exp(log_weft) * np.cos(shear_angle)],
        ]
    )
    return turn(rigid_turn) @ np.moveaxis(sheared, (0, 1), (-2, -1))


def straight_path(end, steps):
    share = np.linspace(0.0, 1.0, steps + 1)[1:, None, None]
    return np.eye(2) + share * (np.asarray(end) - np.eye(2))


def turning_path(steps):
    """F: stretch and shear to a moderate state during one full turn."""
    t = np.linspace(0.0, 1.0, steps + 1)[1:]
    return gradients(0.05 * np.sin(2 * t), 0.04 * t**2, 0.6 * np.sin(1.4 * t), 2 * np.pi * t)


def state_vector(history):
    """Stresses over moduli, so that warp, weft and shear weigh alike."""
    return np.array(
        [
            history.warp_stress[-1] / MODULI[0],
            history.weft_stress[-1] / MODULI[1],
            history.shear_stress[-1] / MODULI[2],
        ]
    )


def assert_converges(path, exact, evaluate, steps=200):
    """The error of the finer of two step sizes is less than the difference between the two.

    For second order the error falls to a quarter, so the difference is three times the error of the finer
    one. The floor is the rounding of ``2 * steps`` additions.
    """
    coarse, fine = evaluate(path(steps)), evaluate(path(2 * steps))
    error, difference = np.linalg.norm(fine - exact), np.linalg.norm(fine - coarse)
    assert error <= difference + 2 * steps * 1e-15 * max(1.0, np.linalg.norm(exact))


@pytest.mark.parametrize(
    "end",
    [TEST_A, turn(np.pi / 2) @ TEST_A, [[1.0, 0.5], [0.0, 1.0]], turn(np.pi / 6) @ np.diag([1.05, 1.02])],
    ids=["A", "A-turned", "C-simple-shear", "D-turned-stretch"],
)
def test_closed_forms_are_reached(end):
    exact = total_form(np.asarray(end), *MODULI).stress
    assert_converges(
        lambda n: straight_path(end, n), exact, lambda path: integrate_fibre_frames(path, *MODULI).stress[-1]
    )


def test_trellis_with_the_card_shear_law():
    """B: the modulus is accumulated, the stress law is its integral."""
    shear = Fabric.load("hexforce-48600-c1300").shear

    def path(steps):
        half = 0.5 * np.linspace(0.0, np.radians(40.0), steps + 1)[1:]
        return np.moveaxis(np.array([[np.cos(half), np.sin(half)], [np.sin(half), np.cos(half)]]), -1, 0)

    assert_converges(
        path,
        shear.shear_stress(np.radians(40.0)),
        lambda p: integrate_fibre_frames(p, 3.9, 3.9, shear).shear_stress[-1],
    )


def closed_loop(steps):
    """E: stretch the warp by 2 %, shear by 45 degrees, take the stretch back, take the shear back."""
    ramp = np.linspace(0.0, 1.0, steps + 1)[1:]
    one, none = np.ones(steps), np.zeros(steps)
    stretch = np.log(1.02) * np.concatenate([ramp, one, 1 - ramp, none])
    shear = np.radians(45.0) * np.concatenate([none, ramp, one, 1 - ramp])
    return gradients(stretch, 0 * stretch, shear, 0 * stretch)


def test_closed_loop_with_the_mean_returns_to_no_shear_stress():
    assert_converges(closed_loop, 0.0, lambda path: integrate_fibre_frames(path, *MODULI).stress[-1, 0, 1])


def test_closed_loop_without_the_mean_leaves_shear_stress():
    """Only the unstretching happens in a sheared state, at tan(gamma) = 1: it leaves +-ln 1.02 in the two
    frames."""
    left = MODULI[2] * np.log(1.02)

    def frame_shears(path):
        history = integrate_fibre_frames(path, *MODULI, average_frame_shears=False)
        return np.array([history.warp_frame_shear[-1], history.weft_frame_shear[-1]])

    assert_converges(closed_loop, np.array([left, -left]), frame_shears)
    apart = integrate_fibre_frames(closed_loop(400), *MODULI, average_frame_shears=False)
    # The cell is square again, so the stress left by half of each shear is their mean in xy: it cancels
    # there ...
    assert abs(apart.stress[-1, 0, 1]) < 1e-4 * left
    # ... but not on the way: sheared and unstretched, the same state has another stress than the state
    # function gives.
    end_of_unstretching = 3 * 400 - 1
    exact = total_form(closed_loop(400)[end_of_unstretching], *MODULI).stress
    assert np.abs(apart.stress[end_of_unstretching] - exact).max() > 0.1 * left


def measured_orders(frames):
    exact = total_form(turning_path(1)[-1], *MODULI).stress
    errors = [
        np.linalg.norm(integrate_fibre_frames(turning_path(n), *MODULI, frames=frames).stress[-1] - exact)
        for n in (100, 200, 400, 800)
    ]
    return np.log2(np.array(errors[:-1]) / errors[1:])


def test_full_turn_while_straining_converges_with_second_order():
    """F. The midpoint rule has an error in even powers, so the measured order departs from 2 by a term in
    step^2.

    With 2 pi / 100 per step the next term is some (2 pi / 100)^2 = 0.004 of the first; 0.05 leaves it a
    factor of ten.
    """
    np.testing.assert_allclose(measured_orders(Frames.MIDPOINT), 2.0, atol=0.05)


def test_frames_of_the_end_of_the_step_are_first_order():
    """The next term of the error is one order of the step higher: 2 pi / 100 = 0.06 for the coarsest pair."""
    np.testing.assert_allclose(measured_orders(Frames.END), 1.0, atol=0.12)


smooth = st.lists(st.floats(-0.15, 0.15), min_size=8, max_size=8).map(lambda v: np.reshape(v, (4, 2)))
ends = st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.8, 0.8), st.floats(-3.0, 3.0)).map(np.array)


def wandering(end, detour):
    """A path to ``end`` (log strains, shear angle, turn) with two harmonics of detour in each, shape [4,
    2]."""

    def path(steps):
        t = np.linspace(0.0, 1.0, steps + 1)[1:]
        waves = np.sin(np.pi * np.outer([1.0, 2.0], t))
        return gradients(*(np.outer(end, t) + detour @ waves))

    return path


@settings(deadline=None, derandomize=True, max_examples=30)
@given(ends, smooth, smooth)
def test_stress_does_not_depend_on_the_path(end, detour, other_detour):
    exact = total_form(gradients(*end[:, None])[0], *MODULI)
    exact = np.array([exact.warp_stress / MODULI[0], exact.weft_stress / MODULI[1], exact.shear_stress / MODULI[2]])
    for way in (detour, other_detour):
        assert_converges(wandering(end, way), exact, lambda path: state_vector(integrate_fibre_frames(path, *MODULI)))


@settings(deadline=None, derandomize=True, max_examples=30)
@given(ends, smooth, st.floats(-2.5, 2.5))
def test_rigid_turn_of_the_whole_path_leaves_the_stress_co_rotated(end, detour, angle):
    """Exact at any step: the first step turns and strains together, so the path begins with the turn
    alone."""
    path = np.concatenate([np.eye(2)[None], wandering(end, detour)(50)])
    before = integrate_fibre_frames(path, *MODULI)
    after = integrate_fibre_frames(turn(angle) @ path, *MODULI)
    # Rounding only, 50 additions; a turn by up to 2.5 rad in one step leaves 1 / cos(1.25) = 3 in the
    # inverse.
    atol = 1e-12 * MODULI[0]
    np.testing.assert_allclose(after.stress, turn(angle) @ before.stress @ turn(angle).T, atol=atol)
    np.testing.assert_allclose(after.green_naghdi_stress, before.green_naghdi_stress, atol=atol)


def test_green_naghdi_stress_is_the_stress_seen_from_the_polar_rotation():
    path = turning_path(40)
    history = integrate_fibre_frames(path, *MODULI)
    for gradient, fixed, corotated in zip(path, history.stress, history.green_naghdi_stress, strict=True):
        rotation, _ = scipy.linalg.polar(gradient)
        np.testing.assert_allclose(rotation.T @ fixed @ rotation, corotated, atol=1e-12 * MODULI[0])


def test_polar_rotation_is_that_of_scipy():
    path = turning_path(40)
    expected = [scipy.linalg.polar(gradient)[0] for gradient in path]
    np.testing.assert_allclose(polar_rotation(path), expected, atol=1e-14)


def test_strains_and_angle_belong_to_the_gradient():
    history = integrate_fibre_frames(straight_path(TEST_A, 1000), *MODULI)
    state = total_form(TEST_A, *MODULI).kinematics
    assert history.shear_angle[-1] == pytest.approx(state.shear_angle, rel=1e-14)
    # One midpoint step of relative stretch d errs by d^3 / 12; a thousand steps of 2e-5 and 3e-4 stay below
    # 1e-9.
    assert history.warp_log_strain[-1] == pytest.approx(state.warp_log_strain, abs=1e-9)
    assert history.weft_log_strain[-1] == pytest.approx(state.weft_log_strain, abs=1e-7)


def test_a_rigid_turn_alone_makes_no_stress():
    path = turn(np.linspace(0.1, 2 * np.pi, 30))
    assert np.abs(integrate_fibre_frames(path, *MODULI).stress).max() < 30 * 1e-15 * MODULI[0]


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (np.eye(2), "steps, 2, 2"),
        (np.array([turn(np.pi)]), "step 0 is too large"),
        (np.array([np.eye(2), np.diag([1.0, -1.0])]), "determinant"),
    ],
)
def test_impossible_paths_are_refused(path, message):
    with pytest.raises(ValueError, match=message):
        integrate_fibre_frames(path, *MODULI)
