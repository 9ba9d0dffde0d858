"""The fabric card: what it says of the paper's fabric, and how it refuses what cannot be used."""

from __future__ import annotations

import numpy as np
import pytest

from weftform.errors import CardError
from weftform.fabric import Fabric, shipped_cards

SHIPPED = "hexforce-48600-c1300"


def refusal(tmp_path, old: str, new: str) -> CardError:
    """The error of the shipped card with one piece of its text replaced."""
    text = shipped_cards()[SHIPPED].read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(CardError) as caught:
        Fabric.load(path)
    assert caught.value.file == path
    assert str(caught.value).startswith(str(path))
    return caught.value


def line_with(tmp_path, start: str) -> int:
    lines = (tmp_path / "mine.toml").read_text(encoding="utf-8").splitlines()
    return next(number for number, line in enumerate(lines, 1) if line.startswith(start))


@pytest.mark.parametrize("name", shipped_cards())
def test_every_shipped_card_loads(name):
    fabric = Fabric.load(name)
    assert fabric.thickness > 0.0 and fabric.areal_density > 0.0


def test_the_fabric_of_the_paper():
    fabric = Fabric.load(SHIPPED)
    assert fabric.thickness == 0.62
    assert fabric.areal_density == pytest.approx(600e-12)  # 600 g/m2 = 6e-10 tonne/mm2
    assert fabric.balanced
    # Without a0 = -3.446 N the card's curve is that much above the force of Sec. 3.2.
    assert float(fabric.warp.force(3.9)) == pytest.approx(215.47 * 51 + 3.446, abs=0.1)
    assert float(fabric.weft.force(3.9)) == float(fabric.warp.force(3.9))


def test_shear_modulus_dips_and_stays_positive():
    shear = Fabric.load(SHIPPED).shear
    angle = np.radians(np.linspace(0.0, 90.0, 90_001))
    modulus = shear.modulus(angle)
    assert modulus[0] == pytest.approx(0.0829, abs=5e-5)
    assert np.degrees(angle[modulus.argmin()]) == pytest.approx(7.5, abs=0.05)
    assert modulus.min() == pytest.approx(0.0148, abs=1e-4)
    assert (modulus > 0.0).all()


def test_normalised_shear_force_is_eq_8():
    fabric = Fabric.load(SHIPPED)
    angle = np.radians(40.0)
    eq_8 = np.polynomial.Polynomial([0.0, 0.0514, -0.4168, 1.8682, -3.7092, 2.8450])(angle)
    assert float(fabric.normalised_shear_force(angle)) == pytest.approx(eq_8, rel=1e-14)
    assert float(fabric.normalised_shear_force(-angle)) == pytest.approx(-eq_8, rel=1e-14)


def test_three_ways_to_write_one_shear_law():
    powers = np.array([0.0514, -0.4168, 1.8682, -3.7092, 2.8450])
    written = {
        "shear-stress": powers / 0.62,
        "shear-modulus": powers / 0.62 * np.arange(1, 6),
    }
    angle = np.radians(np.linspace(-89.0, 89.0, 50))
    expected = Fabric.load(SHIPPED).shear.shear_stress(angle)
    for quantity, coefficients in written.items():
        table = {"law": "polynomial", "quantity": quantity, "coefficients": coefficients.tolist()}
        shear = Fabric.load(SHIPPED, override={"shear": table}).shear
        # Rounding; near the middle the terms of the polynomial cancel to a tenth of the largest.
        np.testing.assert_allclose(shear.shear_stress(angle), expected, rtol=1e-13, atol=1e-15)


def test_a_tabulated_shear_law_is_in_degrees():
    table = {
        "law": "tabulated",
        "quantity": "normalised-shear-force",
        "shear_angle_deg": [0, 20, 40],
        "values": [0.0, 0.01, 0.07],
    }
    shear = Fabric.load(SHIPPED, override={"shear": table}).shear
    assert shear.valid_to == pytest.approx(np.radians(40.0), rel=1e-14)
    stress = shear.shear_stress(np.radians([-20.0, 20.0, 40.0]))
    np.testing.assert_allclose(stress, np.array([-0.01, 0.01, 0.07]) / 0.62, rtol=1e-12)


# Refusals: file, key, and what was expected


@pytest.mark.parametrize(
    ("written", "reason", "got"),
    [
        ("-0.62", "greater than 0", "-0.62"),
        ("nan", "finite", "nan"),
        ("inf", "finite", "inf"),
        ('"thick"', "number", "thick"),
    ],
)
def test_thickness_must_be_a_positive_number(tmp_path, written, reason, got):
    error = refusal(tmp_path, "thickness_mm = 0.62", f"thickness_mm = {written}")
    assert error.key == "fabric.thickness_mm"
    assert error.line == line_with(tmp_path, "thickness_mm")
    assert reason in error.message and got in error.got


def test_an_unknown_key_gets_a_suggestion(tmp_path):
    error = refusal(tmp_path, "thickness_mm", "thicknes_mm")
    assert error.key == "fabric.thicknes_mm"
    assert error.line == line_with(tmp_path, "thicknes_mm")
    assert "unknown key" in error.message
    assert "thickness_mm" in error.expected and error.hint == "did you mean thickness_mm?"


@pytest.mark.parametrize(
    ("old", "new", "key", "reason"),
    [
        ('law = "polynomial"\n', "", "tension.warp", "law is missing"),
        ('law = "polynomial"\n', 'law = "cubic"\n', "tension.warp.law", "polynomial"),
        ("valid_to_mm = 3.9", "", "tension.warp", "needs valid_to_mm"),
        ("specimen_width_mm = 50.0", "", "tension.warp", "needs specimen_width_mm"),
        ('same_as = "warp"', 'same_as = "weft"', "tension", "the other direction"),
        ("valid_to_deg = 90.0", "valid_to_deg = 91.0", "shear.valid_to_deg", "90"),
        ("format = 1", "format = 2", "format", "1"),
        ('name = "hexforce-48600-c1300"', 'name = ""', "name", "at least 1 character"),
    ],
)
def test_incomplete_or_contradictory_cards(tmp_path, old, new, key, reason):
    error = refusal(tmp_path, old, new)
    assert error.key == key
    assert reason in str(error)


def test_the_printed_tension_law_is_refused_with_its_reason():
    with pytest.raises(CardError) as caught:
        Fabric.load(SHIPPED, variant="printed")
    error = caught.value
    assert error.key == "tension.variants.printed.warp"
    assert error.line is not None
    assert "not monotone" in error.message and "2.37 and 3.9 mm" in error.message
    assert "F(3.9 mm) = -7335 N" in error.got
    assert "rises over 0-3.9 mm" in error.expected


def test_a_force_at_no_elongation_is_refused():
    with pytest.raises(CardError) as caught:
        Fabric.load(SHIPPED, override={"tension": {"warp": {"constant_N": -3.446}}})
    assert caught.value.key == "tension.warp"
    assert caught.value.got == "F(0) = -3.446 N"
    assert "constant_N" in caught.value.hint


def test_a_shear_modulus_that_turns_negative_is_refused(tmp_path):
    error = refusal(tmp_path, "[0.0514, -0.4168,", "[0.0514, -0.9,")
    assert error.key == "shear"
    assert "negative" in error.message and "G12 >= 0" in error.expected
    assert "valid_to_deg" in error.hint


TABLE = {"law": "tabulated", "specimen_length_mm": 150.0, "specimen_width_mm": 50.0}


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        ({"displacement_mm": [0, 2, 1], "force_N": [0, 1, 2]}, "must increase"),
        ({"displacement_mm": [0, 1, 2], "force_N": [0, 2, 1]}, "not monotone"),
        ({"displacement_mm": [0, 1], "force_N": [0, 1, 2]}, "same length"),
        ({"displacement_mm": [0, 1], "force_N": [3, 4]}, "origin"),
    ],
)
def test_tables_that_cannot_be_used_name_their_place(points, reason):
    with pytest.raises(CardError) as caught:
        Fabric.load(SHIPPED, override={"tension": {"warp": TABLE | points}})
    assert caught.value.key == "tension.warp"
    assert caught.value.file == shipped_cards()[SHIPPED]
    assert reason in caught.value.message


@pytest.mark.parametrize(
    ("extra", "reason"),
    [
        ({"shear_angle_deg": [0, 30, 20]}, "30 followed by 20"),
        ({"shear_angle_deg": [0, 30, 95]}, "exceed 90"),
        ({"shear_angle_deg": [0, 30, 40], "valid_to_deg": 35}, "last point"),
    ],
)
def test_shear_tables_that_cannot_be_used(extra, reason):
    table = {"law": "tabulated", "quantity": "shear-stress", "values": [0.0, 0.1, 0.4]} | extra
    with pytest.raises(CardError, match=reason) as caught:
        Fabric.load(SHIPPED, override={"shear": table})
    assert caught.value.key == "shear"


def test_an_override_with_a_law_or_a_reference_replaces_the_table():
    linear = {
        "law": "linear",
        "stiffness_N_per_mm": 100.0,
        "specimen_length_mm": 10.0,
        "specimen_width_mm": 5.0,
    }
    fabric = Fabric.load(SHIPPED, override={"tension": {"weft": linear}})
    assert float(fabric.weft.force(2.0)) == 200.0 and not fabric.balanced
    fabric = Fabric.load(SHIPPED, override={"tension": {"weft": linear, "warp": {"same_as": "weft"}}})
    assert float(fabric.warp.force(2.0)) == 200.0 and fabric.balanced


def test_cards_that_do_not_exist(tmp_path):
    with pytest.raises(CardError, match="no card named") as caught:
        Fabric.load("hexforce")
    assert SHIPPED in caught.value.expected
    (tmp_path / "mine.toml").touch()
    with pytest.raises(CardError, match="no such file") as caught:
        Fabric.load("min.toml", near=tmp_path)
    assert caught.value.hint == "did you mean mine.toml?"


def test_a_variant_that_does_not_exist():
    with pytest.raises(CardError, match='no tension variant "other"') as caught:
        Fabric.load(SHIPPED, variant="other")
    assert caught.value.expected == "printed"
