"""Every way a file can be wrong: it works with a warning that says what was done, or is refused with the
place."""

from __future__ import annotations

import numpy as np
import pytest
from paper_equations import bias_curve, eq4

from weftform.errors import MeasurementError
from weftform.laboratory import Reading, characterise_bias_extension, characterise_tensile

U = np.linspace(0.0, 3.9, 120)
SIZE = {"direction": "warp", "length": 150.0, "width": 50.0}


def _tensile(*files, **options):
    return characterise_tensile(list(files), **{**SIZE, **options})


def _refused(match: str, *files, **options) -> MeasurementError:
    with pytest.raises(MeasurementError, match=match) as caught:
        _tensile(*files, **options)
    return caught.value


def test_missing_column(text) -> None:
    problem = _refused("no column for force_N", text("a.csv", "displacement_mm,temperature\n0,20\n1,20\n2,21\n"))
    assert problem.line == 1 and "temperature" in problem.got and problem.expected and problem.hint


def test_no_header_and_too_many_columns(text) -> None:
    problem = _refused("no header line", text("a.csv", "0,0,1\n1,2,3\n2,4,5\n"))
    assert problem.line == 1 and problem.hint


def test_no_header_two_columns_says_the_order(write) -> None:
    path = write("a.csv", U, eq4(U))
    path.write_text("\n".join(path.read_text().splitlines()[1:]))
    found = _tensile(path)
    assert any("columns taken in the order displacement_mm, force_N" in w for w in found.warnings)
    assert found.fit.r_squared > 0.999999


def test_unit_that_is_none(text) -> None:
    problem = _refused('"tonf" is no unit of force_N', text("a.csv", "displacement (mm),force (tonf)\n0,0\n1,2\n"))
    assert problem.line == 1 and "kN" in problem.expected


def test_header_and_option_contradict(write) -> None:
    problem = _refused("two units for force_N", write("a.csv", U, eq4(U)), reading=Reading(units={"force": "kN"}))
    assert problem.key == "force_N"


def test_mixed_units_between_files(write) -> None:
    files = [write(f"{k}.csv", U, eq4(U) * (1 + 0.01 * k)) for k in range(3)]
    wrong = write("w.csv", U, eq4(U) / 1000.0)
    problem = _refused("units or tests mixed", *files, wrong)
    assert problem.file == wrong and "times the median specimen" in str(problem) and "--unit" in problem.hint


def test_mixed_units_that_are_declared_work(write) -> None:
    newton = write("a.csv", U, eq4(U))
    kilo = write("b.csv", U, eq4(U) / 1000.0, "displacement_mm,force_kN")
    found = _tensile(newton, kilo)
    assert not found.warnings and found.fit.rms < 1e-6


def test_two_tables_in_one_file(text, write) -> None:
    first = write("a.csv", U, eq4(U)).read_text()
    second = write("b.csv", U, eq4(U) / 1000.0, "displacement_mm,force_kN").read_text()
    problem = _refused("second header", text("c.csv", first + second))
    assert problem.line == len(U) + 2


def test_unit_inside_a_cell(text) -> None:
    problem = _refused("unit inside a cell", text("a.csv", "displacement_mm;force_N\n0;0\n1;2\n2;3 kN\n"))
    assert problem.line == 4 and problem.got == "3 kN"


def test_displacement_that_unloads_on_its_way(write) -> None:
    u = np.concatenate([np.linspace(0, 2, 50), np.linspace(2, 1, 25), np.linspace(1, 3.9, 60)])
    problem = _refused("steps back", write("a.csv", u, eq4(u)))
    assert 52 <= problem.line <= 55 and problem.hint


def test_small_steps_back_are_left_out(write) -> None:
    u = U.copy()
    u[40], u[80] = u[38] + 0.001, u[79]
    found = _tensile(write("a.csv", u, eq4(u)))
    assert any("2 rows in which displacement_mm does not increase left out (line 42, 82)" in w for w in found.warnings)
    np.testing.assert_allclose(found.fit.coefficients, [19.75, -123.13, 573.0, -91.645], rtol=1e-6)


def test_return_of_the_crosshead_is_cut_off(write) -> None:
    u = np.concatenate([U, np.linspace(3.9, 0.0, 40)])
    found = _tensile(write("a.csv", u, eq4(u) * np.append(np.ones(120), np.zeros(40))))
    assert any("the return after line 121" in w for w in found.warnings)
    np.testing.assert_allclose(found.fit.coefficients, [19.75, -123.13, 573.0, -91.645], rtol=1e-6)


def test_nan_rows_are_named(text, write) -> None:
    lines = write("a.csv", U, eq4(U)).read_text().splitlines()
    lines[30], lines[60], lines[70] = "1.0,NaN", ",", "2.3,##!"
    found = _tensile(text("b.csv", "\n".join(lines)))
    assert any(
        "3 unreadable rows left out: line 31" in w and "line 31 (force_N: 'NaN'), 61" in w for w in found.warnings
    )
    np.testing.assert_allclose(found.fit.coefficients, [19.75, -123.13, 573.0, -91.645], rtol=1e-6)


def test_a_file_of_nonsense_is_refused_with_its_first_line(text, write) -> None:
    lines = write("a.csv", U, eq4(U)).read_text().splitlines()
    lines[20:80] = ["x,y"] * 60
    problem = _refused("60 of 120 rows cannot be read", text("b.csv", "\n".join(lines)))
    assert problem.line == 21 and problem.hint


def test_single_point(text) -> None:
    problem = _refused("too few points for a curve", text("a.csv", "displacement_mm,force_N\n1,2\n"))
    assert problem.line == 2 and problem.got == "1"


@pytest.mark.parametrize("content", ["", "   \n\n", "\ufeff\n"])
def test_empty_file(text, content) -> None:
    _refused("empty", text("a.csv", content))


def test_comments_only_header_only_and_binary(text, tmp_path) -> None:
    _refused("comments only", text("a.csv", "# nothing\n"))
    assert _refused("a header and no rows", text("b.csv", "displacement_mm,force_N\n")).line == 1
    _refused("binary", text("c.csv", bytes([0, 1, 2, 3, 0, 200])))
    _refused("no row of numbers", text("d.csv", "one two three\nfour five six\n"))
    _refused("folder", tmp_path)
    _refused("no such file", tmp_path / "none.csv")


def test_swapped_columns_in_a_tensile_test(write) -> None:
    problem = _refused("seem swapped", write("a.csv", eq4(U), U))
    assert problem.line == 2 and "--column" in problem.hint


def test_swapped_columns_in_a_bias_test(write) -> None:
    d, f = bias_curve()
    noisy = f + 0.01 * np.random.default_rng(0).standard_normal(len(f))
    for force in (f, noisy):
        with pytest.raises(MeasurementError, match="seem swapped"):
            characterise_bias_extension([write("a.csv", force, d)], height=150, width=50, thickness=0.62)


def test_swapped_columns_that_the_user_declared_are_refused_by_their_size(write) -> None:
    reading = Reading(columns={"displacement": "1", "force": "2"})
    problem = _refused("not one of a 150 mm specimen", write("a.csv", eq4(U), U), reading=reading)
    assert problem.line is not None and "swapped" in problem.hint


def test_clipped_load_cell(write) -> None:
    clipped = np.minimum(eq4(U), 8000.0)
    found = _tensile(write("a.csv", U, clipped), interval=(0.0, 3.0))
    first = 2 + int(np.argmax(clipped >= 8000.0))
    assert any(f"stays at exactly 8000 from line {first}" in w and "clipped" in w for w in found.warnings)
    np.testing.assert_allclose(found.fit.coefficients, [19.75, -123.13, 573.0, -91.645], rtol=1e-6)


def test_different_sampling_rates(write) -> None:
    files = [write(f"{n}.csv", u := np.linspace(0, 3.9, n), eq4(u)) for n in (40, 400, 4000)]
    found = _tensile(*files)
    assert len(found.specimens) == 3 and not found.warnings
    np.testing.assert_allclose(found.fit.coefficients, [19.75, -123.13, 573.0, -91.645], rtol=1e-6)
    assert np.nanmax(found.mean.deviation) < 0.002 * found.mean.mean.max()


def test_force_that_never_changes_and_negative_signs(write) -> None:
    _refused("never changes", write("a.csv", U, np.full(120, 3.0)))
    found = _tensile(write("b.csv", -U, -eq4(U)))
    assert any("sign of displacement_mm and force_N turned" in w for w in found.warnings)
    np.testing.assert_allclose(found.fit.coefficients, [19.75, -123.13, 573.0, -91.645], rtol=1e-6)


def test_the_same_file_twice(write) -> None:
    a = write("a.csv", U, eq4(U))
    _refused("cannot count twice", a, a)
    _refused("no files")


def test_preload_is_named_and_can_be_removed(write) -> None:
    path = write("a.csv", U, eq4(U) + 1000.0)
    assert any("preload" in w and "--zero" in w for w in _tensile(path).warnings)
    found = _tensile(path, reading=Reading(zero=True))
    assert not any("preload" in w for w in found.warnings)
    np.testing.assert_allclose(found.fit.coefficients, [19.75, -123.13, 573.0, -91.645], rtol=1e-6)


def test_sizes_and_degrees_are_checked(write) -> None:
    path = write("a.csv", U, eq4(U))
    _refused("sizes must be positive", path, width=-1.0)
    _refused("no such degree", path, degree=0)
    _refused("interval is empty", path, interval=(2.0, 1.0))
    _refused("too few points for a polynomial", path, interval=(0.0, 0.05), degree=6)
    with pytest.raises(MeasurementError, match="height / width >= 2"):
        characterise_bias_extension([path], height=99, width=50, thickness=0.62)
    with pytest.raises(MeasurementError, match="thickness"):
        characterise_bias_extension([path], height=150, width=50, thickness=0.0)


def test_none_of_the_specimens_asked_for() -> None:
    from weftform.laboratory import sample

    with pytest.raises(MeasurementError, match="none of the specimens"):
        characterise_bias_extension(
            sample("cao2008-bias-extension"),
            height=300,
            width=150,
            thickness=1.2,
            reading=Reading(only=("nobody",)),
        )


def test_damaged_files_end_in_a_result_or_a_measurement_error(tmp_path) -> None:
    """Bytes changed, cut out and put in at random: no other exception, no law that is not finite."""
    import random

    from weftform.laboratory import sample

    originals = [sample("tensile-warp")[0].read_bytes(), sample("tensile-weft")[0].read_bytes()]
    path = tmp_path / "damaged.csv"
    for seed in range(60):
        rng = random.Random(seed)
        raw = bytearray(originals[seed % 2])
        for _ in range(rng.choice([1, 5, 40])):
            k = rng.randrange(len(raw))
            if rng.random() < 0.4:
                raw[k] = rng.randrange(256)
            elif rng.random() < 0.5:
                del raw[k : k + rng.choice([1, 5, 50])]
            else:
                raw[k:k] = rng.choice([b"\n", b";;", b"NaN", b"1e400", b"\xff", b'"'])
        path.write_bytes(bytes(raw))
        try:
            found = _tensile(path, law=rng.choice(["polynomial", "tabulated"]))
        except MeasurementError as problem:
            assert problem.message and problem.file == path
        else:
            assert np.isfinite(found.law.value(U)).all()


def test_a_lost_sample_and_a_knock_are_left_out_and_named(write) -> None:
    force = eq4(U)
    force[50], force[90] = 0.0, 40000.0
    found = _tensile(write("a.csv", U, force))
    assert any("stands alone" in w and "line 52 (0), 92 (4e+04)" in w for w in found.warnings)
    np.testing.assert_allclose(found.fit.coefficients, [19.75, -123.13, 573.0, -91.645], rtol=1e-6)


def test_yarns_that_break_and_noise_are_no_knocks(write) -> None:
    """A drop that lasts stays in the curve; so does every point of a noisy one."""
    broken = np.where(U > 3.5, 0.6, 1.0) * eq4(U)
    noisy = eq4(U) + 100.0 * np.random.default_rng(2).standard_normal(len(U))
    for name, force in (("broken.csv", broken), ("noisy.csv", noisy)):
        found = _tensile(write(name, U, force), interval=(0.0, 3.4))
        assert not any("stands alone" in w for w in found.warnings)
        assert len(found.specimens[0].x) == len(U)


def test_errors_of_a_spreadsheet_are_rows_not_comments(text, write) -> None:
    lines = write("a.csv", U, eq4(U)).read_text().splitlines()
    lines[30], lines[60], lines[80] = "#VALUE!,3", "#N/A,#N/A", "# the operator touched the table"
    found = _tensile(text("b.csv", "\n".join(lines)))
    (said,) = (w for w in found.warnings if "unreadable" in w)
    assert "2 unreadable rows" in said and "line 31" in said and ", 61 " in said


@pytest.mark.parametrize("every", [2, 3])
def test_two_decimal_marks_in_one_file_are_refused(text, every) -> None:
    """A comma read as a mark of thousands would multiply by a hundred."""
    rows = [f"{u:.2f};{f:.2f}" for u, f in zip(U, eq4(U), strict=True)]
    rows = [row.replace(".", ",") if k % every else row for k, row in enumerate(rows)]
    problem = _refused("rows cannot be read", text("a.csv", "\n".join(["displacement_mm;force_N", *rows])))
    assert "decimal mark" in problem.hint and problem.line in (2, 3)


def test_displacement_in_metres_without_a_unit_is_refused(write) -> None:
    problem = _refused("ends at an elongation of", write("a.csv", U / 1000.0, eq4(U), "displacement,force"))
    assert "--unit displacement=m" in problem.hint
    d, f = bias_curve()
    metres = write("b.csv", d / 1000.0, f, "displacement,force_N")
    with pytest.raises(MeasurementError, match="before a bias-extension specimen") as caught:
        characterise_bias_extension([metres], height=150, width=50, thickness=0.62)
    assert caught.value.line == len(d) + 1
    reading = Reading(units={"displacement": "m"})
    assert characterise_bias_extension([metres], height=150, width=50, thickness=0.62, reading=reading).shear
