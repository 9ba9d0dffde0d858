"""What cannot be compared is refused with one message that names the place, before anything is written."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import circle, square
from typer.testing import CliRunner

import weftform
from weftform.cli import main
from weftform.errors import MeasurementError, ResultError

ANGLES = "name,u_mm,v_mm,angle_deg"


def refused(match, result, kind=MeasurementError, **options):
    with pytest.raises(kind, match=match) as caught:
        weftform.compare(result, **options)
    assert caught.value.exit_code == 2
    return caught.value


def test_nothing_to_compare(along_yarns) -> None:
    assert "--outline" in refused("nothing to compare", along_yarns).expected


@pytest.mark.parametrize("item", ["outline", "angles", "curve", "markers"])
def test_empty_file_and_missing_columns(along_yarns, item, tmp_path) -> None:
    empty = tmp_path / "empty.csv"
    empty.write_text("")
    assert refused("empty", along_yarns, **{item: empty}).file == empty
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("temperature_C,humidity\n20,50\n21,51\n22,52\n")
    problem = refused("no column for", along_yarns, **{item: wrong})
    assert problem.line == 1 and "temperature" in problem.got
    assert refused("no such file", along_yarns, **{item: tmp_path / "none.csv"}).file.name == "none.csv"


def test_outline_that_crosses_itself(along_yarns, table) -> None:
    points = square(50.0, 5)
    points[[7, 12]] = points[[12, 7]]
    problem = refused("crosses or touches itself", along_yarns, outline=table("o.csv", "x_mm,y_mm", points))
    assert problem.line is not None and 2 <= problem.line <= 21


def test_open_outline(along_yarns, table) -> None:
    file = table("o.csv", "x_mm,y_mm", circle(70.0, 100)[:60])
    problem = refused("is open", along_yarns, outline=file)
    assert problem.line == 61 and "closed" in problem.expected


def test_outline_whose_last_side_is_long_ends_with_its_first_point(along_yarns, table) -> None:
    points = np.vstack([circle(70.0, 100)[:60], circle(70.0, 100)[:1]])
    assert weftform.compare(along_yarns, outline=table("o.csv", "x_mm,y_mm", points)).outline is not None


def test_outline_of_a_line_or_two_points(along_yarns, table) -> None:
    refused("too few points", along_yarns, outline=table("o.csv", "x_mm,y_mm", [(0.0, 0.0), (1.0, 1.0), (0.0, 0.0)]))
    line = [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (1.0, 1.0)]
    refused("crosses or touches", along_yarns, outline=table("p.csv", "x_mm,y_mm", line))


def test_outline_in_a_wrong_unit_is_said(along_yarns, table) -> None:
    file = table("o.csv", "x_mm,y_mm", along_yarns.outline()[1][:-1, :2] / 10.0)
    found = weftform.compare(along_yarns, outline=file)
    assert any("is its unit right" in w for w in found.warnings)


def test_unit_that_is_none(along_yarns, table) -> None:
    file = table("o.csv", "x (furlong),y (furlong)", square(50.0))
    assert "mm" in refused("is no unit of", along_yarns, outline=file).expected


@pytest.mark.parametrize("header", [ANGLES, "name,x_mm,y_mm,angle_deg"])
def test_point_outside(along_yarns, table, header) -> None:
    file = table("a.csv", header, [("inner", 1.0, 1.0, 5.0), ("outer", 400.0, 0.0, 5.0)])
    problem = refused('point "outer" is outside', along_yarns, angles=file)
    assert problem.line == 3 and "400" in problem.got


def test_points_without_a_place_or_twice(along_yarns, table) -> None:
    refused("where the points are", along_yarns, angles=table("a.csv", "name,angle_deg", [("p", 1.0), ("q", 2.0)]))
    twice = table("b.csv", ANGLES, [("p", 1.0, 1.0, 5.0), ("q", 2.0, 2.0, 5.0), ("p", 1.0, 1.0, 6.0)])
    assert refused("stands twice", along_yarns, angles=twice).line == 4


def test_curves_that_do_not_overlap(along_yarns, table) -> None:
    way = np.linspace(40.0, 60.0, 30)
    file = table("f.csv", "displacement_mm,force_N", zip(way, way**2, strict=True))
    problem = refused("no displacement in common", along_yarns, curve=file)
    assert "30 mm" in problem.expected and "40 to 60" in problem.got


def test_markers_without_material_points(along_yarns, table) -> None:
    file = table("m.csv", "marker,x_mm,y_mm", [("a", 1.0, 2.0), ("b", 3.0, 4.0)])
    assert "u_mm" in refused("material points of the markers", along_yarns, markers=file).expected
    outside = table("n.csv", "marker,u_mm,v_mm,x_mm,y_mm", [("a", 0.0, 0.0, 1.0, 2.0), ("b", 0.0, 500.0, 3.0, 4.0)])
    assert refused('"b" is outside', along_yarns, markers=outside).line == 3
    twice = table("t.csv", "marker,u_mm,v_mm,x_mm,y_mm", [("a", 0.0, 0.0, 1.0, 2.0), ("a", 0.0, 5.0, 3.0, 4.0)])
    assert refused("appears twice", along_yarns, markers=twice).line == 3
    lost = table("l.csv", "marker,u_mm,v_mm,x_mm,y_mm", [("a", 0.0, 0.0, "", ""), ("b", 0.0, 5.0, "nan", "nan")])
    refused("no marker can be compared", along_yarns, markers=lost)


def test_registration_that_has_nothing_to_go_by(along_yarns, table) -> None:
    angles = table("a.csv", ANGLES, [("p", 1.0, 1.0, 5.0), ("q", 2.0, 1.0, 5.0)])
    refused("a scale can be found only", along_yarns, angles=angles, scale=True)
    refused("no outline to place", along_yarns, angles=angles, register_by="outline")
    one = table("m.csv", "marker,u_mm,v_mm,x_mm,y_mm", [("a", 0.0, 0.0, 1.0, 2.0)])
    refused("two markers at least", along_yarns, markers=one, register_by="markers")


@pytest.mark.parametrize(
    ("tolerances", "match"),
    [
        ({"outlin": 2}, 'no tolerance "outlin"'),
        ({"angle": "3 mm"}, "is no unit"),
        ({"angle": "5%"}, "is no unit"),
        ({"angle": -1}, "not a tolerance"),
        ({"angle": "nan"}, "not a tolerance"),
        ({"angle": "much"}, "not a tolerance"),
        ({"curve": 5}, "limited and not compared"),
    ],
)
def test_tolerances(along_yarns, table, tolerances, match) -> None:
    angles = table("a.csv", ANGLES, [("p", 1.0, 1.0, 5.0), ("q", 2.0, 1.0, 5.0)])
    problem = refused(match, along_yarns, angles=angles, tolerances=tolerances)
    assert problem.key.startswith("--tolerance")


def test_not_a_result(tmp_path, table) -> None:
    file = table("o.csv", "x_mm,y_mm", square(50.0))
    refused("no such folder", tmp_path / "none", ResultError, outline=file)
    refused("study.toml is missing", tmp_path, ResultError, outline=file)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--column", "outlin.x=a"], 'no file "outlin"'),
        (["--column", "x"], "not of the form"),
        (["--unit", "x=cm", "--unit", "x=mm"], "given twice"),
        (["--no-registration", "--register-by", "markers"], "exclude each other"),
        (["--tolerance", "angle=1"], "limited and not compared"),
    ],
)
def test_command_says_one_thing_and_writes_nothing(
    along_yarns, table, tmp_path, monkeypatch, capsys, arguments, message
):
    file = table("o.csv", "x_mm,y_mm", square(50.0))
    out = tmp_path / "out"
    call = ["weftform", "compare", str(along_yarns.folder), "--outline", str(file), "--out", str(out), *arguments]
    monkeypatch.setattr("sys.argv", call)
    with pytest.raises(SystemExit) as ended:
        main()
    said = capsys.readouterr().err
    assert ended.value.code == 2 and message in said and said.count("error: ") == 1 and "Traceback" not in said
    assert not out.exists()


def test_folder_that_cannot_be_written(along_yarns, table, tmp_path) -> None:
    angles = table("a.csv", ANGLES, [("p", 1.0, 1.0, 5.0), ("q", 2.0, 1.0, 5.0)])
    (tmp_path / "file").write_text("")
    with pytest.raises(ResultError, match="cannot be written"):
        weftform.compare(along_yarns, angles=angles).write(tmp_path / "file" / "out")


def test_help_is_there() -> None:
    from weftform.cli import app

    assert CliRunner().invoke(app, ["compare", "--help"]).exit_code == 0
