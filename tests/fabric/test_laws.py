"""Laws: value, slope, continuation and composition; the tension law of the paper."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from weftform.errors import CardError
from weftform.fabric import LinearLaw, LogStrainLaw, PolynomialLaw, Scaled, Sum, TabulatedLaw, TensionLaw
from weftform.fabric.laws import first_fall

PRINTED = (19.75, -123.13, 573.0, -170.85)
REPAIRED = (19.75, -123.13, 573.0, -91.645)
A0 = -3.446

LAWS = {
    "polynomial": PolynomialLaw(REPAIRED, 3.9),
    "linear": LinearLaw(12_250.0),
    "log-strain": LogStrainLaw(12_250.0, 150.0),
    "tabulated": TabulatedLaw((0.0, 1.0, 2.0, 3.0, 3.9), (0.0, 378.0, 2665.0, 6999.0, 10_992.0)),
    "tabulated without origin": TabulatedLaw((1.0, 2.0, 3.0, 3.9), (378.0, 2665.0, 6999.0, 10_992.0)),
    "scaled": Scaled(PolynomialLaw(REPAIRED, 3.9), factor_x=150.0, factor_y=1 / 51),
    "sum": Sum((PolynomialLaw(REPAIRED, 3.9), LinearLaw(10.0))),
    "sum with a curved law": Sum((PolynomialLaw(REPAIRED, 3.9), LogStrainLaw(10.0, 1.0))),
}
each_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)


def reach(law) -> float:
    return law.valid_to if np.isfinite(law.valid_to) else 4.0


@each_law
def test_starts_at_the_origin(law):
    assert law.value(0.0) == 0.0


@each_law
def test_slope_is_the_derivative_of_the_value(law):
    end = reach(law)
    x = np.linspace(0.01, 1.49, 149) * end  # no sample on the end, where the second derivative jumps
    step = 1e-5 * end
    difference = (law.value(x + step) - law.value(x - step)) / (2 * step)
    # Central differences err by step^2 / 6 times the third derivative (a few scale / end^3, or across a knot
    # of a table, by step / 2 times the jump of the second derivative); rounding is 1e-16 / 1e-5. The scale
    # is the largest slope.
    scale = np.abs(law.slope(x)).max()
    np.testing.assert_allclose(law.slope(x), difference, atol=1e-4 * scale)


@pytest.mark.parametrize("name", [name for name, law in LAWS.items() if np.isfinite(law.valid_to)])
def test_goes_on_in_a_straight_line_beyond_its_validity(name):
    law = LAWS[name]
    end = law.valid_to
    beyond = end * np.array([1.0, 1.5, 3.0, 100.0])
    expected = law.value(end) + law.slope(end) * (beyond - end)
    # Rounding of the largest value.
    np.testing.assert_allclose(law.value(beyond), expected, rtol=1e-13)
    np.testing.assert_allclose(law.slope(beyond), law.slope(end), rtol=1e-13)


def test_a_sum_with_a_law_that_is_never_straight_is_valid_everywhere():
    assert LAWS["sum with a curved law"].valid_to == np.inf
    assert LAWS["sum"].valid_to == 3.9
    assert Sum((LinearLaw(1.0), Scaled(LinearLaw(2.0)))).valid_to == np.inf


@each_law
def test_takes_numbers_and_arrays_of_any_shape(law):
    x = np.array([[0.1, 0.2, 0.3], [1.0, 2.0, 5.0]])
    assert law.value(x).shape == law.slope(x).shape == x.shape
    for place in np.ndindex(x.shape):
        assert float(law.value(x[place])) == pytest.approx(law.value(x)[place], rel=1e-14)


@pytest.mark.parametrize(
    ("x", "y", "reason"),
    [
        ((0.0, 1.0), (0.0,), "same length"),
        ((0.0,), (0.0,), "two points"),
        ((0.0, 2.0, 1.0), (0.0, 1.0, 2.0), "2 followed by 1"),
        ((0.0, 1.0, 1.0), (0.0, 1.0, 2.0), "1 followed by 1"),
        ((0.0, 1.0), (0.5, 1.0), "0 -> 0.5"),
        ((-1.0, 1.0), (0.0, 1.0), "-1 -> 0"),
    ],
)
def test_tables_that_are_no_law_are_refused(x, y, reason):
    with pytest.raises(CardError, match=reason):
        TabulatedLaw(x, y)


@settings(deadline=None, derandomize=True, max_examples=50)
@given(st.lists(st.tuples(st.floats(0.01, 2.0), st.just(0.0) | st.floats(1e-6, 5.0)), min_size=2, max_size=8))
def test_a_table_that_rises_makes_a_law_that_rises(increments):
    x, y = np.cumsum(increments, axis=0).T
    law = TabulatedLaw((0.0, *x), (0.0, *y))
    samples = law.value(np.linspace(0.0, 1.2 * x[-1], 400))
    # Rounding of the cubic pieces.
    assert (np.diff(samples) >= -1e-13 * max(1.0, y[-1])).all()


# The tension law of the paper (Eqs. 3, 4 and 11)


def test_the_printed_quartic_is_negative_at_its_own_end():
    printed = PolynomialLaw(PRINTED, 3.9, A0)
    assert float(printed.value(3.9)) == pytest.approx(-7335.0, abs=0.5)
    fall = first_fall(printed, 3.9)
    assert fall is not None and fall.start == pytest.approx(2.368, abs=2e-3)  # first root of the derivative
    assert fall.end == pytest.approx(3.9, rel=1e-12)


def test_the_repaired_quartic_meets_the_force_of_section_3_2():
    repaired = PolynomialLaw(REPAIRED, 3.9, A0)
    assert pytest.approx(10_989.0, abs=0.5) == 215.47 * 51
    np.testing.assert_allclose(
        repaired.value(np.array([1.0, 2.0, 3.0, 3.9])), [374.5, 2661.2, 6995.4, 10_989.0], atol=0.05
    )
    assert first_fall(repaired, 3.9) is None
    turn_over = np.polynomial.Polynomial([0.0, *REPAIRED]).deriv().roots()
    assert [r.real for r in turn_over if abs(r.imag) < 1e-9] == [pytest.approx(4.54, abs=0.005)]


@pytest.mark.parametrize("power", range(5))
def test_only_the_quartic_coefficient_repairs_the_curve(power):
    """Meet F(3.9 mm) = 10 989 N by changing one coefficient of the printed curve: only that of u^4 leaves it
    rising."""
    powers = np.array([A0, *PRINTED])
    powers[power] += (215.47 * 51 - np.polynomial.Polynomial(powers)(3.9)) / 3.9**power
    rises = first_fall(PolynomialLaw(tuple(powers[1:]), 3.9, powers[0]), 3.9) is None
    assert rises == (power == 4)
    if power == 4:
        assert powers[4] == pytest.approx(REPAIRED[3], abs=5e-4)


def test_the_repaired_quartic_is_straight_above_two_millimetres():
    """The best line through 2-3.9 mm leaves 0.7 % of the end force root mean square, and 2 % at the worst
    point."""
    u = np.linspace(2.0, 3.9, 1001)
    force = PolynomialLaw(REPAIRED, 3.9).value(u)
    error = (np.polynomial.Polynomial.fit(u, force, 1)(u) - force) / force[-1]
    assert np.sqrt(np.mean(error**2)) < 0.007
    assert np.abs(error).max() < 0.02


@settings(deadline=None, derandomize=True, max_examples=50)
@given(st.floats(0.5, 20.0), st.floats(0.0, 6.0))
def test_lines_of_connectors_add_up_to_the_specimen_for_any_spacing(spacing, elongation):
    """Eq. 11 with fractional numbers of lines: width / l0 + 1 lines, each at the strain of the specimen."""
    tension = TensionLaw(PolynomialLaw(REPAIRED, 3.9), length=150.0, width=50.0)
    one_line = tension.line_law(spacing).value(elongation / 150.0)
    strip = (50.0 / spacing + 1.0) * one_line
    assert float(strip) == pytest.approx(float(tension.force(elongation)), rel=1e-12, abs=1e-12)


def test_limits_of_one_connector_in_section_3_2():
    tension = TensionLaw(PolynomialLaw(REPAIRED, 3.9, A0), length=150.0, width=50.0)
    line = tension.line_law(1.0)
    assert line.valid_to == pytest.approx(0.026, rel=1e-12)  # Uc_max of a connector of 1 mm
    assert float(line.value(0.026)) == pytest.approx(215.47, abs=0.005)


def test_a_slack_specimen_carries_its_share_of_the_first_stiffness():
    law = PolynomialLaw(REPAIRED, 3.9)
    assert float(TensionLaw(law, 150.0, 50.0).force(-1.0)) == 0.0
    assert float(TensionLaw(law, 150.0, 50.0, slack_ratio=0.01).force(-1.0)) == pytest.approx(-0.1975)
    assert float(TensionLaw(law, 150.0, 50.0, slack_ratio=0.01).force(1.0)) == float(law.value(1.0))


def test_a_level_end_is_no_fall() -> None:
    """Rounding makes the slope of a level end about -1e-17 of the others."""

    class Level:
        valid_to = 1.0

        def value(self, x):
            return np.asarray(x)

        def slope(self, x):
            return np.where(np.asarray(x) > 0.99, -1e-17, 1.0)

    assert first_fall(Level(), 1.0) is None
