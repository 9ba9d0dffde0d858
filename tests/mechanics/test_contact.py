"""Rounded edges against brute force and their own gradient; Coulomb's return mapping."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from weftform.mechanics.contact import coulomb, rounded_edge

TOOLS = {
    "hemisphere": (1.0, 0.0, -1.0, 75.0, 75.0),
    "flat punch": (1.0, 20.0, -1.0, 10.0, 10.0),
    "die": (-1.0, 90.0, 1.0, -6.0, 6.0),
    "blank-holder ring": (-1.0, 80.5, -1.0, 0.5, 0.5),
    "sharp edge": (1.0, 20.0, 1.0, 3.0, 0.0),
}
"""side_s, s0, side_z, z0, radius [mm]."""

each_tool = pytest.mark.parametrize("tool", TOOLS.values(), ids=TOOLS)
places = st.tuples(st.floats(0.0, 150.0), st.floats(-60.0, 150.0))
examples = settings(deadline=None, derandomize=True, max_examples=60)


def at(tool, s, z):
    return rounded_edge(s, z, *tool)


def surface(tool, spacing=0.05, reach=400.0):
    """Points of the tool's surface, at most ``spacing`` apart: two straight faces and a quarter circle."""
    side_s, s0, side_z, z0, radius = tool
    far = np.arange(0.0, reach, spacing)
    arc = np.linspace(0.0, np.pi / 2, 2 + int(radius * np.pi / 2 / spacing))
    u = np.concatenate([-far, radius * np.sin(arc), np.full_like(far, radius)])
    w = np.concatenate([np.full_like(far, radius), radius * np.cos(arc), -far])
    return s0 + side_s * u, z0 + side_z * w


@each_tool
def test_distance_against_brute_force(tool):
    """The nearest of many surface points is farther than the surface, by at most half their spacing."""
    surface_s, surface_z = surface(tool)
    rng = np.random.default_rng(1)
    for s, z in np.column_stack([rng.uniform(0.0, 150.0, 200), rng.uniform(-60.0, 150.0, 200)]):
        nearest = np.hypot(surface_s - s, surface_z - z).min()
        distance = abs(at(tool, s, z)[0])
        assert distance - 1e-12 * 200 <= nearest <= distance + 0.025


@each_tool
def test_inside_is_negative(tool):
    side_s, s0, side_z, z0, radius = tool
    assert at(tool, s0 - side_s * 5.0, z0 - side_z * 5.0)[0] == pytest.approx(-5.0 - radius)
    assert at(tool, s0 + side_s * (radius + 3.0), z0 - side_z * 5.0)[0] == pytest.approx(3.0)
    assert at(tool, s0 - side_s * 5.0, z0 + side_z * (radius + 3.0))[0] == pytest.approx(3.0)


@each_tool
@examples
@given(places)
def test_normal_is_the_gradient_of_the_distance(tool, place):
    s, z = place
    side_s, s0, side_z, z0, _ = tool
    u, w, step = side_s * (s - s0), side_z * (z - z0), 1e-6
    # The distance has a kink on the diagonal inside, and none elsewhere; differences need room on both
    # sides. Near the edge of the quadrant the second derivative is 1 / reach, so there the truncation is
    # step / reach.
    assume(not (u < 2 * step and w < 2 * step and abs(u - w) < 4 * step))
    reach = math.hypot(max(u, 0.0), max(w, 0.0))
    assume(reach == 0.0 or reach > 1e-2)
    assume(min(abs(u), abs(w)) > 2 * step)
    _, n_s, n_z = at(tool, s, z)
    slope_s = (at(tool, s + step, z)[0] - at(tool, s - step, z)[0]) / (2 * step)
    slope_z = (at(tool, s, z + step)[0] - at(tool, s, z - step)[0]) / (2 * step)
    # Rounding of a distance of up to 300 mm: 3e-14 / 1e-6; truncation (step / reach)^2 = 1e-8.
    assert n_s == pytest.approx(slope_s, abs=1e-7)
    assert n_z == pytest.approx(slope_z, abs=1e-7)


@each_tool
@examples
@given(places, places)
def test_distance_is_continuous(tool, one, other):
    """A distance changes by no more than the way between two points; this holds across every face and
    corner."""
    way = math.dist(one, other)
    assert abs(at(tool, *one)[0] - at(tool, *other)[0]) <= way + 1e-12 * 300


@each_tool
@examples
@given(places)
def test_normal_has_unit_length(tool, place):
    _, n_s, n_z = at(tool, *place)
    assert math.hypot(n_s, n_z) == pytest.approx(1.0, rel=1e-14)


@each_tool
@pytest.mark.parametrize("offset", [0.0, 1e-200, 1e-160, 1e-155, 1e-150, 1e-12, -1e-12])
@pytest.mark.parametrize("deep", [-5.0, 0.0])
def test_normal_on_the_edges_of_the_quadrant(tool, offset, deep):
    """On u = 0 or w = 0 inside, where the square of an offset vanishes or loses its digits, the normal has
    unit length.

    ``rounded_edge`` is called in (u, w) itself, as adding s0 would swallow the offset.
    """
    radius = tool[-1]
    for u, w in ((offset, deep), (deep, offset)):
        _, n_u, n_w = rounded_edge(u, w, 1.0, 0.0, 1.0, 0.0, radius)
        assert math.hypot(n_u, n_w) == pytest.approx(1.0, rel=1e-12)


@examples
@given(places)
def test_a_hemisphere_is_a_sphere_ahead_of_its_shank(place):
    s, z = place
    radius = 75.0
    distance, n_s, n_z = at(TOOLS["hemisphere"], s, z)
    r = math.hypot(s, z - radius)
    if z <= radius:
        assert distance == pytest.approx(r - radius, abs=1e-13 * 200)
        if r > 1e-6:
            assert (n_s, n_z) == pytest.approx((s / r, (z - radius) / r), abs=1e-12)
    elif s > 0.0:
        assert distance == pytest.approx(s - radius, abs=1e-13 * 200)  # the wall of the shank
        assert (n_s, n_z) == pytest.approx((1.0, 0.0), abs=1e-15)


def test_the_die_has_a_face_a_fillet_and_a_hole():
    die = TOOLS["die"]  # hole radius 90 - 6 = 84 mm, face at z = 0, fillet radius 6 mm
    assert at(die, 120.0, 2.0) == pytest.approx((2.0, 0.0, 1.0))
    assert at(die, 80.0, -30.0) == pytest.approx((4.0, -1.0, 0.0))
    crest = 6.0 / math.sqrt(2.0)
    distance, n_s, n_z = at(die, 90.0 - crest, -6.0 + crest)
    assert distance == pytest.approx(0.0, abs=1e-13 * 90)
    assert (n_s, n_z) == pytest.approx((-math.sqrt(0.5), math.sqrt(0.5)))


def test_the_ring_presses_down_outside_its_hole():
    ring = TOOLS["blank-holder ring"]
    assert at(ring, 120.0, -0.3) == pytest.approx((0.3, 0.0, -1.0))
    assert at(ring, 70.0, 5.0) == pytest.approx((10.0, -1.0, 0.0))


# Coulomb

components = st.floats(-1e3, 1e3)
limits = st.floats(0.0, 1e3)


@examples
@given(components, components, components, limits)
def test_friction_never_exceeds_its_limit(x, y, z, limit):
    size = math.sqrt(x * x + y * y + z * z)
    *friction, heat = coulomb(x, y, z, limit)
    assert math.hypot(*friction) <= limit * (1 + 1e-14) + 1e-150
    assert heat >= 0.0
    assert heat == pytest.approx(max((size - limit) * limit, 0.0), abs=1e-12 * (size**2 + 1e-150))


@examples
@given(components, components, components, st.floats(1e-3, 1e3))
def test_below_the_limit_it_sticks_and_above_it_keeps_the_direction(x, y, z, limit):
    size = math.sqrt(x * x + y * y + z * z)
    assume(abs(size - limit) > 1e-9 * limit)
    *friction, heat = coulomb(x, y, z, limit)
    if size <= limit:
        assert tuple(friction) == (x, y, z) and heat == 0.0
    else:
        share = limit / size
        assert friction == pytest.approx([share * x, share * y, share * z], rel=1e-14, abs=1e-300)
        assert heat > 0.0


@examples
@given(st.lists(st.tuples(components, components), min_size=1, max_size=30), st.floats(0.0, 50.0))
def test_sliding_dissipates(moves, limit):
    """Force times slip is never negative and is the heat returned.

    A spring stretched from the last force to the trial and let go to the limit would lose excess^2 / (2
    stiffness) more in every step; the crossings never feel that part, it vanishes with the step.
    """
    stiffness, friction = 2.0, np.zeros(3)
    work = heat = unfelt = 0.0
    for move in moves:
        step = np.array([*move, 0.0])
        trial = friction + stiffness * step
        *now, product = coulomb(*trial, limit)
        slip = (trial - np.array(now)) / stiffness
        assert float(np.array(now) @ slip) == pytest.approx(product / stiffness, rel=1e-9, abs=1e-9)
        assert product >= 0.0
        work += float((friction + 0.5 * stiffness * step) @ step)  # a spring stretched from the last force
        heat += product / stiffness
        unfelt += (np.linalg.norm(trial) - np.linalg.norm(now)) ** 2 / (2 * stiffness)
        friction = np.array(now)
    stored = float(friction @ friction) / (2 * stiffness)
    assert work == pytest.approx(stored + heat + unfelt, rel=1e-9, abs=1e-9)


def test_no_load_no_friction():
    assert coulomb(3.0, 4.0, 0.0, 0.0) == (0.0, 0.0, 0.0, 0.0)
    assert coulomb(0.0, 0.0, 0.0, 1.0) == (0.0, 0.0, 0.0, 0.0)
    assert coulomb(0.0, 0.0, 0.0, 0.0) == (0.0, 0.0, 0.0, 0.0)
