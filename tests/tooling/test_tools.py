"""Rigid tools stand against the flat fabric at the start and have the shapes of the study."""

from __future__ import annotations

import numpy as np
import pytest

from weftform.mechanics.contact import rounded_edge
from weftform.tooling import RigidTool, flat_punch, hemisphere, opening

THICKNESS = 0.62
SHAPES = {
    "hemisphere": lambda up: hemisphere(50.0, THICKNESS, up),
    "flat punch": lambda up: flat_punch(50.0, 5.0, THICKNESS, up),
    "opening": lambda up: opening(55.4, 6.0, THICKNESS, up),
}
each_shape = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
each_side = pytest.mark.parametrize("up", [1.0, -1.0], ids=["below", "above"])


def tool(shape, up):
    return RigidTool("tool", *shape(up), up=up, motion="fixed", friction=0.2, stiffness=30.0, tangential_ratio=0.5)


def distance(of, s, z):
    return rounded_edge(s, z, of.side_s, of.s0, of.side_z, of.z0, of.radius)


@each_shape
@each_side
def test_tool_touches_the_surface_of_the_flat_fabric(shape, up):
    """The nearest point of the middle surface z = 0 is half the thickness away, and the normal points to the fabric."""
    here = tool(shape, up)
    found = [distance(here, s, 0.0) for s in np.linspace(0.0, 120.0, 1201)]
    nearest = min(found)
    assert nearest[0] == pytest.approx(0.5 * THICKNESS, rel=1e-12)
    assert nearest[2] == pytest.approx(up)


@each_side
def test_hemisphere_is_a_sphere_with_a_shank(up):
    here = tool(SHAPES["hemisphere"], up)
    centre = -up * (25.0 + 0.5 * THICKNESS)
    for angle in (0.1, 0.7, 1.5):
        s, z = 30.0 * np.sin(angle), centre + up * 30.0 * np.cos(angle)
        d, n_s, n_z = distance(here, s, z)
        assert d == pytest.approx(5.0, rel=1e-12)
        np.testing.assert_allclose([n_s, n_z], [np.sin(angle), up * np.cos(angle)], atol=1e-12)
    d, n_s, n_z = distance(here, 28.0, centre - up * 40.0)
    assert d == pytest.approx(3.0)
    np.testing.assert_allclose([n_s, n_z], [1.0, 0.0], atol=1e-12)


@each_side
def test_opening_has_a_hole_of_its_diameter(up):
    here = tool(SHAPES["opening"], up)
    d, n_s, _ = distance(here, 20.0, -up * 40.0)
    assert d == pytest.approx(27.7 - 20.0)
    assert n_s == pytest.approx(-1.0)


@each_shape
@each_side
def test_drawn_profile_lies_on_the_surface(shape, up):
    here = tool(shape, up)
    for s, z in here.profile(reach=100.0, depth=40.0):
        assert distance(here, s, z)[0] == pytest.approx(0.0, abs=1e-9)
