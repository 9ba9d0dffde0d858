"""The reader gives the same numbers whatever the machine's habits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from weftform.errors import MeasurementError
from weftform.laboratory import Quantity, read_table, sample, sample_names
from weftform.laboratory.presets import FORMED, PRESETS
from weftform.laboratory.text import number
from weftform.laboratory.units import Dimension, split_unit, unit_factor

NEEDED = [Quantity.DISPLACEMENT, Quantity.FORCE]
D, F = [0.0, 0.5, 1.0, 1.5, 2.25], [0.0, 10.25, 21.5, 33.125, 1047.5]


def _check(path) -> None:
    table = read_table(path, NEEDED)
    np.testing.assert_allclose(table.values[Quantity.DISPLACEMENT], D)
    np.testing.assert_allclose(table.values[Quantity.FORCE], F)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|", "   "])
@pytest.mark.parametrize("comma", [False, True])
def test_delimiters_and_decimal_marks(text, delimiter, comma) -> None:
    if comma and delimiter == ",":
        rows = [f'"{d}","{f}"'.replace(",", "@").replace(".", ",").replace("@", ",") for d, f in zip(D, F, strict=True)]
    else:
        rows = [f"{d}{delimiter}{f}" for d, f in zip(D, F, strict=True)]
        rows = [r.replace(".", ",") for r in rows] if comma else rows
    header = delimiter.join(["displacement_mm", "force_N"])
    _check(text("a.csv", "\n".join([header, *rows])))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "windows-1252"])
def test_encodings(text, encoding) -> None:
    rows = "\r\n".join(f"{d};{f}".replace(".", ",") for d, f in zip(D, F, strict=True))
    path = text("a.csv", f"Déplacement (mm);Force (N)\r\n{rows}\r\n".encode(encoding))
    _check(path)
    assert read_table(path, NEEDED).encoding in (encoding, "utf-8")


def test_units_from_header_units_row_and_option(text) -> None:
    scaled = [(d / 10, f / 1000) for d, f in zip(D, F, strict=True)]
    body = "\n".join(f"{d!r},{f!r}" for d, f in scaled)
    for header in ("Displacement (cm),Load [kN]", "displacement_cm,force_kN", "Extension,Load\n(cm),(kN)"):
        _check(text("a.csv", f"{header}\n{body}\n"))
    table = read_table(
        text("b.csv", f"displacement,force\n{body}\n"), NEEDED, units={"displacement": "cm", "force": "kN"}
    )
    np.testing.assert_allclose(table.values[Quantity.FORCE], F)
    assert not table.warnings


def test_missing_units_are_assumed_and_said(text) -> None:
    table = read_table(text("a.csv", "displacement,force\n0,0\n1,2\n2,3\n"), NEEDED)
    assert any("no unit for force_N" in w and "N assumed" in w for w in table.warnings)


def test_preamble_with_as_many_columns_as_the_table(text) -> None:
    body = "\n".join(f"{d},{f}" for d, f in zip(D, F, strict=True))
    path = text("a.csv", f"Specimen label,warp 1\nWidth,50.0\nLength,150\n\nExtension,Load\n(mm),(N)\n{body}\n")
    _check(path)
    assert read_table(path, NEEDED).preset == "instron"
    assert read_table(path, NEEDED).lines[0] == 7


def test_every_shipped_sample_can_be_read() -> None:
    needed = {
        "tensile-warp": NEEDED,
        "tensile-weft": NEEDED,
        "bias-extension": NEEDED,
        "bias-extension-markers": [Quantity.IMAGE, Quantity.MARKER, Quantity.DISPLACEMENT],
        "dic-aramis": [Quantity.X, Quantity.Y],
        "dic-vic3d": [Quantity.X, Quantity.SHIFT_X, Quantity.STRAIN_XX],
        "cao2008-picture-frame": [Quantity.SHEAR_ANGLE, Quantity.NORMALISED_SHEAR_FORCE, Quantity.SPECIMEN],
        "cao2008-bias-extension": NEEDED,
    }
    for name in sample_names():
        if name in needed:
            for path in sample(name):
                assert len(read_table(path, needed[name]).lines) > 20


def test_aramis_strains_are_percent_and_vic3d_strains_are_not() -> None:
    strains = [Quantity.STRAIN_XX, Quantity.STRAIN_YY]
    aramis = read_table(sample("dic-aramis")[0], strains, may_miss=strains)
    assert aramis.preset == "aramis" and aramis.encoding == "windows-1252"
    expected = np.sqrt(1.0 + np.sin(np.radians(20.0))) - 1.0
    assert np.nanmean(aramis.values[Quantity.STRAIN_YY]) == pytest.approx(expected, abs=1e-5)
    vic = read_table(sample("dic-vic3d")[0], strains)
    assert vic.preset == "vic3d"
    assert vic.values[Quantity.STRAIN_YY].mean() == pytest.approx(np.sin(np.radians(20.0)) / 2.0, abs=1e-5)


def test_column_by_name_and_by_number(text) -> None:
    path = text("a.csv", "a;b;c\n1;2;3\n4;5;6\n7;8;9\n")
    for columns in ({"displacement": "b", "force": "c"}, {"displacement": "2", "force_N": "3"}):
        table = read_table(path, NEEDED, columns=columns)
        assert table.values[Quantity.FORCE].tolist() == [3.0, 6.0, 9.0]
        assert table.declared == frozenset(NEEDED)


def test_unknown_quantity_and_preset_are_named(text) -> None:
    path = text("a.csv", "displacement_mm,force_N\n1,2\n3,4\n")
    with pytest.raises(MeasurementError, match="did you mean force_N"):
        read_table(path, NEEDED, columns={"forces": "force_N"})
    with pytest.raises(MeasurementError, match="no reader preset"):
        read_table(path, NEEDED, preset="zwick")


def test_thousands_marks() -> None:
    assert number("1,234.5", False) == 1234.5
    assert number("1.234,5", True) == 1234.5
    assert number("-1.5e-3", False) == -1.5e-3
    assert number("n/a", False) is None
    assert number("1,234,567", False) == 1234567.0
    # a lone mark between three digits and more could be either
    for bad in ("1.2.3", "1e400", "12 N", "0x10", "0,100", "1,234", "12,34.5", "1,23,456"):
        with pytest.raises(ValueError):
            number(bad, False)


def test_blanks_between_thousands(text) -> None:
    rows = [f"{k};1{blank}0{k}0,5" for k, blank in zip(range(9), " \u00a0\u202f" * 3, strict=True)]
    table = read_table(text("a.csv", "\n".join(["displacement_mm;force_N", *rows])), NEEDED)
    np.testing.assert_allclose(table.values[Quantity.FORCE], 1000.5 + 10.0 * np.arange(9))


@given(st.floats(-1e6, 1e6, allow_nan=False), st.booleans())
def test_numbers_survive_writing_with_either_mark(value, comma) -> None:
    written = repr(value).replace(".", ",") if comma else repr(value)
    assert number(written, comma) == value


def test_units() -> None:
    assert unit_factor("kN", Dimension.FORCE) == 1000.0
    assert unit_factor("mN", Dimension.FORCE) == 1e-3 and unit_factor("MN", Dimension.FORCE) == 1e6
    assert unit_factor("MM", Dimension.LENGTH) == 1.0
    assert unit_factor("mm", Dimension.FORCE) is None
    assert split_unit("Displacement / mm") == ("Displacement", "mm")
    assert split_unit("shear_angle_deg") == ("shear_angle", "deg")
    assert split_unit("plain") == ("plain", None)


@pytest.mark.parametrize("quantity", list(Quantity))
@pytest.mark.parametrize("preset", [*PRESETS.values(), FORMED], ids=lambda p: p.name)
def test_every_quantity_is_known_by_its_own_name(quantity, preset) -> None:
    """A message that asks for a column ``shift_x_mm`` must be content with one."""
    if quantity in (Quantity.U, Quantity.V) and preset is not FORMED:
        pytest.skip("asked for on formed parts only; elsewhere u is a displacement")
    assert preset.quantity_of(split_unit(quantity.value)[0]) is quantity
