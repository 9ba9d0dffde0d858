"""Prescribed motions: they arrive, never turn back, and start and stop softly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from weftform.mechanics.motion import motion_value, peak_speed, pushed_velocity, soft_progress

ramps = st.floats(0.01, 0.5)
examples = settings(deadline=None, derandomize=True, max_examples=40)


def speed(progress, ramp, end_ramp, step=1e-6):
    return (soft_progress(progress + step, ramp, end_ramp) - soft_progress(progress - step, ramp, end_ramp)) / (
        2 * step
    )


@examples
@given(ramps, ramps)
def test_goes_from_nought_to_one_without_turning_back(ramp, end_ramp):
    travelled = np.array([soft_progress(p, ramp, end_ramp) for p in np.linspace(-0.1, 1.1, 601)])
    assert travelled[0] == 0.0 and travelled[-1] == 1.0
    assert soft_progress(0.0, ramp, end_ramp) == 0.0 and soft_progress(1.0, ramp, end_ramp) == 1.0
    # Rounding where it stands still.
    assert (np.diff(travelled) >= -1e-15).all()


@examples
@given(ramps, ramps, st.floats(0.0, 1.0))
def test_backwards_it_is_the_motion_with_the_ramps_exchanged(ramp, end_ramp, progress):
    forth, back = soft_progress(progress, ramp, end_ramp), soft_progress(1.0 - progress, end_ramp, ramp)
    assert forth + back == pytest.approx(1.0, abs=1e-14)


@examples
@given(ramps, ramps, st.floats(0.0, 1.0))
def test_speed_is_that_of_the_smooth_step(ramp, end_ramp, progress):
    """What two ramps leave of the way in the middle, times 3 x^2 - 2 x^3 in the ramps: so it is continuous and starts
    from rest."""
    x = min(progress / ramp, (1.0 - progress) / end_ramp)
    share = 3 * x**2 - 2 * x**3 if x < 1.0 else 1.0
    # Central differences: rounding 1e-16 / 1e-6; the third derivative reaches 12 / 0.01^2 and jumps at the
    # joints, where the second derivative is zero on both sides, so truncation is below 1e-12 * 1e5.
    middle = 1.0 / (1.0 - ramp / 2 - end_ramp / 2)
    assert speed(progress, ramp, end_ramp) == pytest.approx(share * middle, abs=1e-6)
    assert peak_speed(ramp, end_ramp) == pytest.approx(middle, rel=1e-15)


@pytest.mark.parametrize("ramp", [0.01, 0.1, 0.3, 0.5])
@pytest.mark.parametrize("end_ramp", [0.1, 0.5])
def test_speed_and_acceleration_do_not_jump_at_the_joints(ramp, end_ramp):
    for joint, length in ((0.0, ramp), (ramp, ramp), (1.0 - end_ramp, end_ramp), (1.0, end_ramp)):
        gap = 1e-4 * min(ramp, end_ramp)
        before, after = (speed(joint + side * gap, ramp, end_ramp, gap / 10) for side in (-1, 1))
        # Over the gap 2e-4 of a ramp, from the flat end of the smooth step: 6 x^2 / 2 of the speed, x = 1e-4.
        assert abs(after - before) < 1e-6
        # The acceleration is 6 x / ramp there, peak 2: below 12e-4 / ramp.
        before, after = (speed(joint + side * gap, ramp, end_ramp, gap) for side in (-1, 1))
        assert abs(after - before) / (2 * gap) < 12e-4 / length


TIMES, VALUES = np.array([0.0, 2.0, 3.0, 5.0]), np.array([1.0, 4.0, 4.0, -2.0])


def value(time, ramp=0.2):
    return motion_value(TIMES, VALUES, 4, (ramp, 0.1), time)


def test_passes_through_its_knots_and_stays_at_the_ends():
    for time, expected in zip(TIMES, VALUES, strict=True):
        assert value(time) == pytest.approx(expected, rel=1e-15)
    assert value(-1.0) == 1.0 and value(9.0) == -2.0


def test_a_plateau_stays_flat_and_each_leg_is_monotone():
    assert {value(t) for t in np.linspace(2.0, 3.0, 21)} == {4.0}
    assert (np.diff([value(t) for t in np.linspace(0.0, 2.0, 101)]) >= 0.0).all()
    assert (np.diff([value(t) for t in np.linspace(3.0, 5.0, 101)]) <= 0.0).all()


def test_stands_still_at_every_knot():
    for time in TIMES:
        step = 1e-5
        # Within the first 1e-5 of a leg of 1 s or more the way is 6 mm times x^3 / ramp^2: below 1e-13 mm.
        assert abs(value(time + step) - value(time - step)) / (2 * step) < 1e-7


@pytest.mark.parametrize("rate", [0.0, 50.0])
def test_a_pushed_body_gains_what_the_force_gives_and_damping_takes(rate):
    """Energy in each step: force times way is what kinetic energy and the heat of damping gain, to rounding."""
    force, mass, step, velocity = 3.0, 0.2, 1e-3, 0.0
    work = heat = 0.0
    for _ in range(500):
        new = pushed_velocity(velocity, force, mass, rate, step)
        work += force * 0.5 * (velocity + new) * step
        heat += 0.25 * rate * mass * (velocity + new) ** 2 * step
        velocity = new
    assert work == pytest.approx(0.5 * mass * velocity**2 + heat, rel=1e-12)
    expected = force * 0.5 / mass if rate == 0.0 else force / (mass * rate) * (1.0 - np.exp(-rate * 0.5))
    assert velocity == pytest.approx(expected, rel=1e-3)
