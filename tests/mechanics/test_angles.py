"""Shear angles from tangents of their halves."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from weftform.mechanics.angles import angle_between, arc_tangent, mean_half_tangent, root_of_secants

angles = st.floats(-math.radians(89.9), math.radians(89.9))


@settings(deadline=None)
@given(st.floats(-1.0, 1.0))
def test_arc_tangent(x):
    assert arc_tangent(x) == pytest.approx(math.atan(x), rel=1e-15, abs=1e-300)


@settings(deadline=None)
@given(angles, angles)
def test_change_and_mean_of_two_angles(a, b):
    now, before = math.tan(0.5 * a), math.tan(0.5 * b)
    root = root_of_secants(now, before)
    assert root == pytest.approx(1.0 / (math.cos(0.5 * a) * math.cos(0.5 * b)), rel=1e-13)
    assert angle_between(now, before, root) == pytest.approx(a - b, rel=1e-13, abs=1e-14)
    assert mean_half_tangent(now, before, root) == pytest.approx(math.tan(0.25 * (a + b)), rel=1e-13, abs=1e-14)
