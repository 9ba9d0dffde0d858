"""Lines of the comparison with the paper, and the parts of it that need no simulation."""

from __future__ import annotations

import json
import math

import pytest

from weftform.fabric import Fabric
from weftform.reproduction.items import Item
from weftform.reproduction.laws import law_items, misprints
from weftform.reproduction.net import LARGEST, sphere_net_angle

FABRIC = Fabric.load("hexforce-48600-c1300")


def item(reference, computed, tolerance=None, absolute=False):
    return Item("section", "what", "source", reference, computed, tolerance, absolute)


# -- one line --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("reference", "computed", "tolerance", "absolute", "difference", "agrees"),
    [
        (100.0, 101.0, 0.02, False, 0.01, True),
        (100.0, 97.0, 0.02, False, -0.03, False),
        (-100.0, -103.0, 0.05, False, 0.03, True),
        (100.0, 101.0, 0.5, True, 1.0, False),
        (100.0, 100.25, 0.5, True, 0.25, True),
        (0.0, 0.1, 0.2, False, 0.1, True),
        (0.0, 0.3, 0.2, False, 0.3, False),
        (100.0, 200.0, None, False, 1.0, None),
        (None, 200.0, 0.1, False, None, None),
        (100.0, math.nan, 0.1, False, math.nan, False),
    ],
)
def test_difference_and_agreement(reference, computed, tolerance, absolute, difference, agrees):
    """Relative but for ``absolute`` or a reference of zero; None where nothing has to agree; nan never agrees."""
    made = item(reference, computed, tolerance, absolute)
    if difference is None:
        assert made.difference is None
    else:
        assert made.difference == pytest.approx(difference, nan_ok=True)
    assert made.agrees is agrees
    assert made.as_dict()["agrees"] is agrees


def test_text_of_a_line():
    assert item(100.0, 101.0, 0.02).cells() == ("what [source]", "100", "101", "+1.00 %", "agrees (within 2 %)")
    assert item(100.0, 103.0, 0.02).cells()[4] == "DISAGREES (within 2 %)"
    assert item(0.0, 0.1, 0.2).cells()[3:] == ("+0.1", "agrees (within 0.2)")
    assert item(None, 0.1).cells()[1:4] == ("not given", "0.1", "")


# -- the net on the sphere -------------------------------------------------------------------------


def series_angle(z, terms=40):
    """gamma(z) = pi/2 - f by its power series: z g'' + g' = cos g with g(0) = 0.

    With c = cos g and s = sin g: (k + 1)^2 g_(k+1) = c_k, k c_k = -sum j g_j s_(k-j), k s_k = sum j g_j c_(k-j).
    """
    g, c, s = [0.0], [1.0], [0.0]
    for k in range(terms):
        g.append(c[k] / (k + 1) ** 2)
        n = k + 1
        c.append(-sum(j * g[j] * s[n - j] for j in range(1, n + 1)) / n)
        s.append(sum(j * g[j] * c[n - j] for j in range(1, n + 1)) / n)
    return sum(a * z**k for k, a in enumerate(g))


@pytest.mark.parametrize(("u", "v"), [(12.0, 12.0), (5.0, 20.0), (20.0, 20.0), (1.0, 0.5)])
def test_net_angle_is_the_series_at_the_pole(u, v):
    radius = 25.31
    expected = series_angle(u * v / radius**2)
    assert sphere_net_angle(u, v, radius) == pytest.approx(expected, rel=1e-6)
    assert sphere_net_angle(-u, v, radius) == pytest.approx(-expected, rel=1e-6)
    assert sphere_net_angle(-u, -v, radius) == pytest.approx(expected, rel=1e-6)


def test_net_angle_satisfies_its_equation():
    """z g'' + g' = cos g by differences."""
    z, h = 0.8, 1e-3
    low, here, high = (sphere_net_angle(1.0, x, 1.0) for x in (z - h, z, z + h))
    assert z * (high - 2 * here + low) / h**2 + (high - low) / (2 * h) == pytest.approx(math.cos(here), abs=1e-4)


def test_net_has_an_axis_and_an_end():
    assert sphere_net_angle(0.0, 20.0, 25.0) == 0.0
    with pytest.raises(ValueError, match="beyond the net"):
        sphere_net_angle(1.0, 1.01 * LARGEST, 1.0)


# -- equations -------------------------------------------------------------------------------------


def test_all_law_items_agree():
    items = law_items(FABRIC)
    assert len([made for made in items if made.source == "Eq. 9"]) == 5
    assert [made.what for made in items if not made.agrees] == []


def test_items_can_be_written_as_json():
    json.dumps([made.as_dict() for made in [*law_items(FABRIC), *misprints(FABRIC)]])


def test_misprints_are_listed_with_both_values_and_need_not_agree():
    items = misprints(FABRIC)
    assert len(items) == 7
    assert all(made.agrees is None and made.remark and made.reference is not None for made in items)
    by_what = {made.what: made.computed for made in items}
    assert by_what["F(3.9 mm) of Eq. 4 as printed (N)"] == pytest.approx(-7335.0, abs=5.0)
    assert by_what["E ln 2 with the printed E = 34 500 MPa (MPa)"] == pytest.approx(23913.6, abs=0.5)
    assert by_what["kinematic shear angle at 21 mm (deg)"] == pytest.approx(27.65, abs=0.01)
    assert by_what["imposed displacement of the tensile strip (mm)"] == 3.9
