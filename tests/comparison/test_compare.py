"""A result beside what was measured: every item through the public function and the command."""

from __future__ import annotations

import json

import numpy as np
import pytest
from shapes import moved
from typer.testing import CliRunner

import weftform
from weftform.cli import app
from weftform.comparison import LIMITED
from weftform.comparison.figures import angles_figure, curve_figure, markers_figure, outline_figure, write_figures
from weftform.report.style import house_style
from weftform.result.writer import RESOLVED, claim_folder

POINTS = [(10.0, 10.0), (30.0, -20.0), (-40.0, 35.0), (-15.0, -50.0)]
TURN, SHIFT = 30.0, (12.0, -7.0)


def edge(result):
    return result.outline()[1][:-1]


@pytest.fixture
def files(along_yarns, table):
    """An experiment that is the simulation, lying askew, in other units, with known differences."""
    ring = moved(edge(along_yarns)[:, :2], TURN, SHIFT)
    probes = along_yarns.probe(POINTS)
    markers = [
        (f"m{k}", u, v, *(moved(np.array(p.position_mm[:2]), TURN, SHIFT)), p.position_mm[2] + 0.5)
        for k, ((u, v), p) in enumerate(zip(POINTS, probes, strict=True))
    ]
    way = np.linspace(2.0, 25.0, 60)
    return {
        "outline": table("outline.csv", "x (cm);y (cm)", [(x / 10, y / 10) for x, y in ring[::-1]], ";"),
        "angles": table(
            "angles.csv",
            "name,u_mm,v_mm,angle_deg,scatter_deg",
            [
                (f"p{k}", *point, abs(p.shear_angle_deg) + 0.25 * k, 0.5)
                for k, (point, p) in enumerate(zip(POINTS, probes, strict=True))
            ],
        ),
        # the history is 80 share^2 N, share of 30 mm; the measured force is 4 N more, in kN
        "curve": table(
            "force.csv",
            "displacement (mm),force (kN)",
            [(d, (np.interp(d, *simulated(along_yarns)) + 4.0) / 1000.0) for d in way],
        ),
        "markers": table("markers.csv", "marker,u_mm,v_mm,x_mm,y_mm,z_mm", markers),
    }


def simulated(result):
    return result.history["displacement_mm"], result.history["force_N"]


def test_everything_at_once(along_yarns, files, tmp_path) -> None:
    found = weftform.compare(along_yarns, **files, tolerances={"outline": 0.01, "angle": 1, "curve": "10 %"})
    # the file has nine digits of a cm, so its points lie within 1e-8 mm of the outline
    assert found.outline.hausdorff < 1e-6 and np.abs(found.outline.normal).max() < 1e-6
    assert found.placement.turn_deg == pytest.approx(-TURN, abs=1e-6)
    assert found.angles.differences == pytest.approx([0.0, -0.25, -0.5, -0.75], abs=1e-6)
    assert [p.scatter for p in found.angles.points] == [0.5] * 4
    # the history is a chain of chords of 3 mm whose slope changes by 80 * 2 * 0.1^2 / 3 N/mm; samples 0.39 mm apart cut
    # such a corner by a quarter of slope times spacing
    assert found.curve.rms == pytest.approx(4.0, abs=0.06) and found.curve.largest == pytest.approx(4.0, abs=0.06)
    assert found.curve.way[[0, -1]] == pytest.approx([2.0, 25.0])
    # heights are those of the measurement where the outline places it: 0.5 mm off
    assert found.markers.distances == pytest.approx([0.5] * 4, abs=1e-6)
    assert found.ok and len(found.verdicts) == 3
    written = found.write(tmp_path / "out", figures=False)
    assert json.loads(written[0].read_text())["curve"]["rms_percent"] == pytest.approx(
        100.0 * found.curve.rms / (80.0 * (25.0 / 30.0) ** 2 + 4.0), rel=0.01
    )


def test_no_tolerance_no_verdict(along_yarns, files) -> None:
    found = weftform.compare(along_yarns, angles=files["angles"])
    assert found.ok is None and found.as_dict()["verdicts"] == []


@pytest.mark.parametrize("name", LIMITED)
def test_every_tolerance_can_be_kept_and_broken(along_yarns, files, name) -> None:
    """With no registration the outline and the markers are far off; forces and angles differ anyway."""
    item = LIMITED[name].item
    options = {item: files[item], "register_by": "none" if item in ("outline", "markers") else None}
    found = weftform.compare(along_yarns, **options, tolerances={name: 1000})
    value = found.verdicts[0].value
    assert found.ok and value > 0.05
    assert weftform.compare(along_yarns, **options, tolerances={name: value * 0.99}).ok is False


def test_units_of_tolerances(along_yarns, files) -> None:
    found = weftform.compare(
        along_yarns,
        curve=files["curve"],
        angles=files["angles"],
        tolerances={"curve-rms": "0.005 kN", "angle": "0.5deg"},
    )
    assert [v.tolerance.limit for v in found.verdicts] == pytest.approx([5.0, 0.5])
    assert [v.ok for v in found.verdicts] == [True, False]


def test_points_by_their_place_on_the_part(along_yarns, files, table) -> None:
    """x and y in the measured axes are placed with the outline, and find the same material points."""
    probes = along_yarns.probe(POINTS)
    rows = [
        (f"p{k}", *moved(np.array(p.position_mm[:2]), TURN, SHIFT), abs(p.shear_angle_deg))
        for k, p in enumerate(probes)
    ]
    found = weftform.compare(
        along_yarns, outline=files["outline"], angles=table("places.csv", "name,x_mm,y_mm,angle_deg", rows)
    )
    np.testing.assert_allclose([p.yarn_mm for p in found.angles.points], POINTS, atol=1e-5)
    np.testing.assert_allclose(found.angles.differences, 0.0, atol=1e-4)


def test_signs_count_when_asked_for(along_yarns, table) -> None:
    probe = along_yarns.probe([(-40.0, 35.0)])[0]
    assert probe.shear_angle_deg < 0.0
    file = table("a.csv", "name,u_mm,v_mm,angle_deg", [("p", -40.0, 35.0, -probe.shear_angle_deg)])
    assert weftform.compare(along_yarns, angles=file).angles.differences[0] == pytest.approx(0.0, abs=1e-6)
    signed = weftform.compare(along_yarns, angles=file, signed_angles=True)
    assert signed.angles.differences[0] == pytest.approx(2.0 * probe.shear_angle_deg, abs=1e-6)


def test_markers_place_themselves(along_yarns, files) -> None:
    found = weftform.compare(along_yarns, markers=files["markers"])
    assert found.placement.by == "markers" and found.markers.distances.max() < 1e-6
    assert found.placement.shift_mm[2] == pytest.approx(-0.5, abs=1e-6)


def test_markers_over_images_know_their_material_points_from_the_first(along_yarns, files, table) -> None:
    """One camera sees the flat and the formed blank; the outline of the formed part places both."""
    rows = []
    for image, stroke in (("flat", 0.0), ("half", 15.0), ("formed", 30.0)):
        for k, p in enumerate(along_yarns.probe(POINTS, stroke)):
            rows.append((image, f"m{k}", stroke, *moved(np.array(p.position_mm[:2]), TURN, SHIFT)))
    file = table("images.csv", "image,marker,displacement_mm,x_mm,y_mm", rows)
    found = weftform.compare(along_yarns, outline=files["outline"], markers=file)
    np.testing.assert_allclose(found.markers.yarn_mm, POINTS, atol=1e-6)
    assert found.markers.image == "formed" and found.markers.distances.max() < 1e-6
    lost = table("lost.csv", "image,marker,displacement_mm,x_mm,y_mm", [r for r in rows if r[:2] != ("formed", "m2")])
    found = weftform.compare(along_yarns, outline=files["outline"], markers=lost)
    assert len(found.markers.names) == 3 and any("m2" in w for w in found.warnings)


def test_at_an_earlier_stroke(along_yarns, table) -> None:
    frame = along_yarns.frame_at(15.0)
    ring = along_yarns.outline(frame)[1][:-1, :2]
    file = table("o.csv", "x_mm,y_mm", moved(ring, 5.0))
    assert weftform.compare(along_yarns, outline=file, stroke=15.0).outline.hausdorff < 1e-6
    assert weftform.compare(along_yarns, outline=file).outline.hausdorff > 0.1


def test_outline_of_a_result_by_its_columns(along_yarns) -> None:
    """The outline.csv of one run is a measurement for another; 3D points are taken in plan view."""
    from weftform.laboratory import Reading

    reading = Reading(columns={"x": "formed_x_mm", "y": "formed_y_mm"})
    found = weftform.compare(
        along_yarns, outline=along_yarns.folder / "outline.csv", readings={"outline": reading}, register_by="none"
    )
    assert found.outline.hausdorff < 1e-5  # written with six decimals


def test_specimens_are_averaged(along_yarns, table) -> None:
    way = np.linspace(0.0, 30.0, 50)
    force = np.interp(way, *simulated(along_yarns))
    curves = [table(f"f{k}.csv", "displacement_mm,force_N", zip(way, force * k, strict=True)) for k in (0.8, 1.2)]
    found = weftform.compare(along_yarns, curve=curves)
    assert found.curve.mean.specimens == 2 and found.curve.largest < 0.02 * 80.0


def test_command(along_yarns, files, tmp_path) -> None:
    options = [part for item, file in files.items() for part in (f"--{item}", str(file))]
    common = ["compare", str(along_yarns.folder), *options, "--out", str(tmp_path / "out")]
    kept = CliRunner().invoke(app, [*common, "--tolerance", "outline=0.1", "--tolerance", "curve=10%"])
    assert kept.exit_code == 0, kept.output
    assert "within" in kept.output and "OUT OF" not in kept.output
    names = {"comparison.json", "outline.png", "angles.png", "curve.png", "markers.png"}
    assert {p.name for p in (tmp_path / "out").iterdir()} == names
    broken = CliRunner().invoke(app, [*common, "--no-figures", "--tolerance", "angle=0.5", "--json"])
    assert broken.exit_code == 1
    printed = json.loads(broken.stdout)
    assert printed["ok"] is False and printed["verdicts"][0]["value"] == pytest.approx(0.75, abs=1e-6)
    assert printed == json.loads((tmp_path / "out" / "comparison.json").read_text())


def test_command_names_columns_of_one_file(along_yarns, tmp_path) -> None:
    folder = str(along_yarns.folder)
    call = f"compare {folder} --outline {folder}/outline.csv --no-figures --no-registration --json --out {tmp_path}"
    call += " --column outline.x=formed_x_mm --column outline.y=formed_y_mm"
    found = CliRunner().invoke(app, call.split())
    assert found.exit_code == 0 and json.loads(found.stdout)["outline"]["hausdorff_mm"] < 1e-5


def test_results_folder_by_default(along_yarns, files) -> None:
    written = weftform.compare(along_yarns, angles=files["angles"]).write(figures=False)
    assert written == [along_yarns.folder / "comparison" / "comparison.json"]


def test_a_new_run_clears_the_comparison_of_the_former_result(tmp_path) -> None:
    folder = tmp_path / "result"
    (folder / "comparison").mkdir(parents=True)
    (folder / "study.toml").write_text(f"# {RESOLVED}\n")
    for name in ("comparison.json", "outline.png", "notes.txt"):
        (folder / "comparison" / name).write_text("former")
    claim_folder(folder)
    assert [p.name for p in (folder / "comparison").iterdir()] == ["notes.txt"]


def test_captions_fit(along_yarns, files) -> None:
    found = weftform.compare(along_yarns, **files, scale=True, tolerances={"outline": 2, "curve": "10 %"})
    with house_style():
        for draw in (outline_figure, angles_figure, curve_figure, markers_figure):
            figure = draw(found)
            extents = [text.get_window_extent(figure.canvas.get_renderer()) for text in figure.texts]
            assert len(extents) == 2 and all(e.x0 >= 0.0 and e.x1 <= figure.bbox.width for e in extents), draw.__name__


def test_figures_of_many_points(along_yarns, table, tmp_path) -> None:
    """Forty long names neither leave the picture nor run into the caption."""
    rows = [(f"a rather long name {k}", 1.0 * k, 1.0 * k, 10.0) for k in range(40)]
    found = weftform.compare(along_yarns, angles=table("a.csv", "name,u_mm,v_mm,angle_deg", rows))
    figure = angles_figure(found)
    figure.canvas.draw()
    box = figure.axes[1].get_tightbbox()
    caption = max(text.get_window_extent().y1 for text in figure.texts if text.get_text().startswith("Study"))
    assert box.x0 >= 0.0 and box.y0 >= caption and box.x1 <= figure.bbox.width
    assert write_figures(found, tmp_path)[0].stat().st_size > 10_000
