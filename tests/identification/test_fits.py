"""What to fit: its syntax, names, starts and bounds, and the laws it makes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from weftform.errors import IdentificationError
from weftform.fabric import Fabric
from weftform.identification import Fit
from weftform.identification.fits import Parameter
from weftform.identification.laws import changed, changes_of, families_of
from weftform.study import Study

STUDY = Study.load("bias-extension")
FORMING = Study.load("hemisphere-0-90")


def one(text: str, study: Study = STUDY, covered: float | None = 26.0):
    (family,) = families_of([Fit.parse(text)], study, covered)
    return family


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("shear.G12", Fit("shear.G12")),
        ("shear.G12=0.05", Fit("shear.G12", 0.05)),
        ("shear.G12:0.01..0.5", Fit("shear.G12", None, (0.01, 0.5))),
        ("shear.G12=5e-2:1e-2..0.5", Fit("shear.G12", 0.05, (0.01, 0.5))),
        ("shear.polynomial,degree=3,to=40", Fit("shear.polynomial", None, None, {"degree": 3.0, "to": 40.0})),
        ("shear.coefficients[1]=-0.4:-1..-0.1", Fit("shear.coefficients[1]", -0.4, (-1.0, -0.1))),
    ],
)
def test_syntax(text, wanted):
    assert Fit.parse(text) == wanted


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "cannot be read"),
        ("shear.G12=", "cannot be read"),
        ("shear.G12=abc", "not a number"),
        ("shear.G12:0.5", "cannot be read"),
        ("shear.G12:0.5..0.1", "reversed"),
        ("shear.G12:0.5..0.5", "reversed or equal"),
        ("shear.G12=1:0.01..0.5", "outside of the bounds"),
        ("shear.G12=nan", "not finite"),
        ("shear.polynomial,degree=x", "not a number"),
    ],
)
def test_text_that_says_nothing_is_refused(text, message):
    with pytest.raises(IdentificationError, match=message):
        Fit.parse(text)


def test_reversed_bounds_come_with_the_right_order():
    with pytest.raises(IdentificationError) as caught:
        Fit.parse("shear.G12:0.5..0.1")
    assert "shear.G12:0.1..0.5" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("shear.g12", "shear.G12"),
        ("shear.polinomial", "shear.polynomial"),
        ("tension.wrap.scale", "tension.warp.scale"),
        ("fabric.thicknes_mm", "fabric.thickness_mm"),
        ("loading.duration", "loading.duration_s"),
    ],
)
def test_unknown_name_is_refused_with_the_nearest(text, hint):
    with pytest.raises(IdentificationError, match="nothing of that name") as caught:
        one(text)
    assert caught.value.hint == f"did you mean {hint}?"


@pytest.mark.parametrize(
    "text", ["shear.coefficients", "fabric.card", "output.rows", "shear.coefficients[9]", "shear", "name"]
)
def test_what_is_no_real_number_is_refused(text):
    with pytest.raises(IdentificationError):
        one(text)


@pytest.mark.parametrize(
    "text", ["shear.G12,degree=3", "shear.polynomial,knots=3", "shear.polynomial,degree=0", "shear.polynomial,degree=2.5",
             "shear.polynomial,to=120", "shear.table,intervals=1", "shear.G12:-1..1"]
)  # fmt: skip
def test_options_that_do_not_exist_are_refused(text):
    with pytest.raises(IdentificationError):
        one(text)


def test_card_value_outside_of_given_bounds_is_refused():
    with pytest.raises(IdentificationError, match="starts outside") as caught:
        one("fabric.thickness_mm:1..2")
    assert "0.62" in str(caught.value)


@pytest.mark.parametrize(
    "pair", [("shear.G12", "shear.polynomial"), ("shear.scale", "shear.coefficients[0]"), ("tension.scale", "tension.weft.scale"),
             ("tension.warp.scale", "tension.warp.coefficients[1]"), ("shear.G12", "shear.G12")]
)  # fmt: skip
def test_two_fits_of_the_same_numbers_are_refused(pair):
    with pytest.raises(IdentificationError, match="change the same"):
        families_of([Fit.parse(text) for text in pair], STUDY, 26.0)


def test_nothing_to_fit_is_refused():
    with pytest.raises(IdentificationError, match="nothing to fit"):
        families_of([], STUDY, 26.0)


def test_constant_starts_from_the_secant_of_the_law():
    """So that the start gives the force of the card at the end of the curves, by Eq. 5 nearly."""
    (parameter,) = one("shear.G12", covered=26.0).parameters
    stress = float(STUDY.fabric.shear.shear_stress(np.radians(26.0)))
    assert parameter.start == pytest.approx(stress / np.radians(26.0))
    assert parameter.lower < parameter.start < parameter.upper


def test_polynomial_of_the_degree_of_the_card_starts_as_the_card():
    """Eq. 10 is of degree 4, so that its values at five angles are the whole of it."""
    family = one("shear.polynomial,degree=4,to=45")
    fabric = changed(STUDY, changes_of([family], [p.start for p in family.parameters])).fabric
    angle = np.radians(np.linspace(0.0, 45.0, 50))
    np.testing.assert_allclose(fabric.shear.modulus(angle), STUDY.fabric.shear.modulus(angle), rtol=1e-9)


@given(st.lists(st.floats(0.01, 10.0), min_size=4, max_size=4))
@settings(max_examples=20, deadline=None)
def test_polynomial_takes_its_values_at_its_angles(values):
    family = one("shear.polynomial=1,degree=3,to=40")
    (table,) = changes_of([family], values).card.values()
    modulus = np.polynomial.Polynomial(table["coefficients"])
    angles = [float(p.name.split()[2]) for p in family.parameters]
    assert angles == pytest.approx([0.0, 10.0, 30.0, 40.0])
    np.testing.assert_allclose(modulus(np.radians(angles)), values, rtol=1e-6, atol=1e-6)


@given(st.lists(st.floats(1e-4, 1e2), min_size=6, max_size=6))
@settings(max_examples=20, deadline=None)
def test_table_never_falls_whatever_the_optimiser_tries(values):
    """Each interval has a positive secant, so a card accepts every point between the bounds."""
    family = one("shear.table=1,intervals=6,to=42")
    fabric = changed(STUDY, changes_of([family], values)).fabric
    edges = np.radians(np.linspace(0.0, 42.0, 7))
    np.testing.assert_allclose(
        np.diff(fabric.shear.shear_stress(edges)), np.asarray(values) * np.diff(edges), rtol=1e-9
    )


def test_factors_multiply_the_law_and_both_directions_where_one_copies_the_other():
    changes = changes_of([one("tension.weft.scale")], [1.5])
    fabric = changed(STUDY, changes).fabric
    for law in (fabric.warp, fabric.weft):
        assert float(law.force(2.0)) == pytest.approx(1.5 * float(STUDY.fabric.warp.force(2.0)))
    changes = changes_of([one("shear.scale")], [0.7])
    angle = np.radians([5.0, 20.0, 40.0])
    np.testing.assert_allclose(
        changed(STUDY, changes).fabric.shear.shear_stress(angle), 0.7 * STUDY.fabric.shear.shear_stress(angle)
    )


def test_factor_of_a_variant_is_refused(tmp_path):
    card = tmp_path / "card.toml"
    text = Study.load("bias-extension").fabric.card.model_dump(mode="json", exclude_unset=True)
    import tomlkit

    text["tension"]["variants"] = {"soft": {"warp": dict(text["tension"]["warp"]), "weft": {"same_as": "warp"}}}
    card.write_text(tomlkit.dumps(text))
    soft = Study.load("bias-extension", {"fabric.card": str(card), "fabric.tension_variant": "soft"})
    with pytest.raises(IdentificationError, match="variant"):
        one("tension.scale", soft)


def test_single_coefficients_and_keys_change_alone():
    families = families_of(
        [Fit.parse("shear.coefficients[0]=0.06"), Fit.parse("shear.coefficients[2]"), Fit.parse("loading.duration_s")],
        STUDY,
        26.0,
    )
    made = changed(STUDY, changes_of(families, [0.06, 2.0, 0.8]))
    assert made.fabric.card.shear.coefficients == [0.06, -0.4168, 2.0, -3.7092, 2.8450]
    assert made.model.loading.duration_s == 0.8
    assert made.model.specimen == STUDY.model.specimen


def test_default_bounds_stay_within_what_a_study_allows():
    """Friction may be 2 at most, and twenty times 0.2 is more."""
    (parameter,) = one("contact.punch.friction", FORMING).parameters
    assert 0.0 < parameter.lower < 0.2 < parameter.upper <= 2.0


def test_start_at_zero_needs_bounds():
    bare = Study.load("bias-extension", {"fabric.override.membrane.warp_modulus_MPa": 0.0})
    with pytest.raises(IdentificationError, match="no bounds follow"):
        one("membrane.warp_modulus_MPa", bare)
    (parameter,) = one("membrane.warp_modulus_MPa:0..10", bare).parameters
    assert (parameter.lower, parameter.start, parameter.upper) == (0.0, 0.0, 10.0)


@given(st.floats(1e-3, 1e3), st.floats(0.05, 1.0), st.floats(1.0, 20.0), st.floats(0.0, 1.0))
def test_coordinates_and_values_are_inverse(start, down, up, share):
    for lower in (start * down, -start):
        p = Parameter("p", "", start, lower, start * up + 1e-9)
        value = p.lower + share * (p.upper - p.lower)
        assert p.value(p.normalised(value)) == pytest.approx(value, rel=1e-9, abs=1e-9 * start)
        assert p.normalised(start) == pytest.approx(0.0, abs=1e-12)


def test_fabric_is_untouched():
    assert STUDY.fabric.card == Fabric.load("hexforce-48600-c1300").card
