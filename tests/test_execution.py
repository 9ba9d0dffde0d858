"""Running a study: the result folder, its numbers, interruption and resumption, refusals; slow: the physics of the
hemisphere."""

from __future__ import annotations

import csv
import json
import math

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

from weftform.cases import case_of
from weftform.cli import app
from weftform.errors import CardError, ResultError, StudyError, UnstableRun
from weftform.exchange.vtkhdf import Series
from weftform.execution import COLUMNS, run
from weftform.fabric.fabric import shipped_cards
from weftform.result import Result
from weftform.solver import Simulation, loop
from weftform.study import Study

SMALL = {"blank.cell_length_mm": 5.36, "output.frames": 7, "output.rows": 41}
"""15 by 15 crossings at 0 degrees, 21 by 21 at 45, in about a second each."""


@pytest.fixture(scope="module")
def domes(tmp_path_factory):
    """The small hemisphere at 0/90 and at +-45 degrees."""
    made = {}
    for name in ("hemisphere-0-90", "hemisphere-45"):
        made[name] = run(Study.load(name, SMALL), tmp_path_factory.mktemp(name) / "out")
    return made


@pytest.fixture(scope="module", params=["hemisphere-0-90", "hemisphere-45"])
def dome(domes, request):
    return domes[request.param]


# -- the result folder -----------------------------------------------------------------------------


def test_summary_says_what_the_contract_asks_for(dome):
    s = dome.summary
    assert s["study"] == dome.study.name
    assert s["cells"] == dome.grid.cell_count
    assert s["status"] == "done" and s["ok"] is True and s["warnings"] == []
    assert s["steps"] > 1000 and s["wall_s"] > 0 and s["threads"] >= 1
    assert s["ns_per_cell_step"] == pytest.approx(1e9 * s["wall_s"] / s["steps"] / s["cells"], rel=1e-6)
    assert s["stroke_mm"] == pytest.approx(30.0, abs=1e-6)
    assert set(s["draw_in_mm"]) == {"edge_x", "edge_y", "corner"}
    angles = s["shear_angle_deg"]
    assert angles["max"] >= angles["max_cell"] >= angles["p99"] >= angles["mean"] > 1.0


def test_energy_ledger_of_the_dome_closes_and_it_is_quasi_static(dome):
    assert dome.summary["energy"]["balance_error"] < 0.01
    assert dome.summary["energy"]["kinetic_over_internal"] < 0.05
    assert dome.summary["penetration_share_of_thickness"] < 0.05


def test_history_has_every_row_and_no_nan(dome):
    with (dome.folder / "history.csv").open() as file:
        rows = list(csv.reader(file))
    columns = [*COLUMNS, *case_of(dome.study).columns]
    assert rows[0] == columns
    assert len(rows) == 1 + 41
    assert all(len(row) == len(columns) for row in rows)
    history = dome.history
    assert all(np.isfinite(values).all() for values in history.values())
    assert (np.diff(history["time_s"]) > 0).all()
    assert history["displacement_mm"][-1] == pytest.approx(30.0, abs=1e-6)
    assert history["force_N"][-1] == pytest.approx(dome.summary["punch_force_N"])


def test_blank_holder_carries_its_force_on_the_whole_blank(dome):
    """238.45 N from the end of the closing on; it bounces a little as the blank slides."""
    history = dome.history
    late = history["time_s"] > 0.05
    assert np.mean(history["holder_reaction_N"][late]) == pytest.approx(238.45, rel=0.02)


def test_work_is_the_integral_of_the_punch_force(dome):
    """The punch does most of the work, the holder the rest (force times its way). Forces are means between rows, so
    the sum over rows is the integral up to the change of speed within a row."""
    history = dome.history
    punch = float(np.sum(history["force_N"][1:] * np.diff(history["displacement_mm"])))
    holder = 238.45 * history["holder_displacement_mm"][-1]
    assert history["external_work_mJ"][-1] == pytest.approx(punch + holder, rel=0.03)


@pytest.mark.parametrize("frames", [2, 7, 31, 50])
def test_every_asked_instant_is_kept(tmp_path, frames):
    """Also where rows and frames fall within a step of each other, or are equal but for rounding."""
    changes = {
        "blank.cell_length_mm": 5.36,
        "loading.stroke_mm": 0.5,
        "loading.duration_s": 0.01,
        "loading.closing_s": 0.005,
    }
    study = Study.load("hemisphere-0-90", {**changes, "output.frames": frames, "output.rows": 301})
    result = run(study, tmp_path / "out")
    assert len(result.times) == frames
    assert len(result.history["time_s"]) == 301
    np.testing.assert_allclose(result.times, 0.005 + np.linspace(0, 0.01, frames), atol=2e-5)


def test_fields_file_holds_frames_whose_points_move(dome):
    with h5py.File(dome.folder / "fields.vtkhdf") as file:
        root = file["VTKHDF"]
        assert root["Steps"].attrs["NSteps"] == 7
        count = int(root["NumberOfPoints"][0])
        points = root["Points"][:].reshape(7, count, 3)
        moved = root["PointData/Displacement_mm"][:].reshape(7, count, 3)
        np.testing.assert_allclose(points - moved, np.tile(dome.grid.flat[dome.grid.active], (7, 1, 1)), atol=1e-12)
        top = points[..., 2].max(axis=1)
        np.testing.assert_allclose(top, dome.strokes, atol=0.02)  # it lies on the punch, which carries it up
        assert np.isfinite(root["CellData/ShearAngle_deg"][:]).all()
    np.testing.assert_allclose(dome.strokes[[0, -1]], [0.0, 30.0], atol=1e-6)


def test_vtk_opens_the_fields(dome):
    pytest.importorskip("vtkmodules.vtkIOHDF")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(str(dome.folder / "fields.vtkhdf"))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 7
    reader.SetStep(6)
    reader.Update()
    grid = reader.GetOutputDataObject(0)
    assert grid.GetNumberOfCells() == dome.grid.cell_count
    for name in ("ShearAngle_deg", "WarpStrain", "WeftForce_N_per_mm", "WarpDirection", "MembraneStress_MPa"):
        assert grid.GetCellData().HasArray(name)
    angles = vtk_to_numpy(grid.GetCellData().GetArray("ShearAngle_deg"))
    assert np.abs(angles).max() == pytest.approx(dome.summary["shear_angle_deg"]["max_cell"])


def test_outline_file_is_the_edge_of_the_whole_blank(dome):
    with (dome.folder / "outline.csv").open() as file:
        rows = list(csv.DictReader(file))
    flat = np.array([[float(r["flat_x_mm"]), float(r["flat_y_mm"])] for r in rows])
    formed = np.array([[float(r["formed_x_mm"]), float(r["formed_y_mm"])] for r in rows])
    assert flat.min() == pytest.approx(-75.0, abs=1e-5) and flat.max() == pytest.approx(75.0, abs=1e-5)
    on_axis = np.argmin(np.abs(flat[:, 1]) + np.abs(flat[:, 0] - 75.0))
    assert 75.0 - formed[on_axis, 0] == pytest.approx(dome.summary["draw_in_mm"]["edge_x"], abs=1e-5)


def test_the_resolved_study_repeats_the_run(domes, tmp_path):
    first = domes["hemisphere-0-90"]
    again = run(first.folder / "study.toml", tmp_path / "again")
    for key in ("steps", "punch_force_N", "shear_angle_deg", "draw_in_mm", "energy"):
        assert again.summary[key] == first.summary[key]


def test_dome_has_the_symmetry_of_its_yarns(dome):
    """Warp and weft are alike, so the edges on x and y draw in alike; rounding and a millimetre-thin contact apart."""
    s = dome.summary["draw_in_mm"]
    assert s["edge_x"] == pytest.approx(s["edge_y"], abs=0.02)


# -- probes ----------------------------------------------------------------------------------------


def test_probe_at_cell_centres_equals_the_field(dome):
    fields, grid = dome.fields(), dome.grid
    for j, i in np.argwhere(grid.cells == 1)[::17]:
        u = (i + 0.5 - grid.centre[0]) * grid.warp_pitch
        v = (j + 0.5 - grid.centre[1]) * grid.weft_pitch
        (found,) = dome.probe([(u, v)])
        assert found.shear_angle_deg == pytest.approx(math.degrees(fields.shear_angle[j, i]), abs=1e-9)
        assert found.warp_strain == pytest.approx(fields.warp_strain[j, i], abs=1e-12)
        assert found.weft_force_N_per_mm == pytest.approx(fields.weft_force[j, i], abs=1e-9)
        corners = fields.positions[j : j + 2, i : i + 2].reshape(4, 3)
        np.testing.assert_allclose(found.position_mm, corners.mean(axis=0), atol=1e-9)
        np.testing.assert_allclose(found.warp_direction, fields.directions[0][j, i], atol=1e-9)


def test_probe_at_crossings_has_their_positions(dome):
    grid, positions = dome.grid, dome.fields().positions
    for j, i in np.argwhere(grid.active)[::13]:
        (found,) = dome.probe([tuple(grid.material[j, i])])
        np.testing.assert_allclose(found.position_mm, positions[j, i], atol=1e-9)


def test_probe_at_0_degrees_flips_the_shear_sign_across_a_plane(domes):
    dome = domes["hemisphere-0-90"]
    one, x, y, both = dome.probe([(17.0, 12.0), (-17.0, 12.0), (17.0, -12.0), (-17.0, -12.0)])
    assert abs(one.shear_angle_deg) > 5.0
    for other, sign, mirror in ((x, -1, (-1, 1, 1)), (y, -1, (1, -1, 1)), (both, 1, (-1, -1, 1))):
        assert other.shear_angle_deg == pytest.approx(sign * one.shear_angle_deg, abs=1e-9)
        np.testing.assert_allclose(other.position_mm, np.array(one.position_mm) * mirror, atol=1e-9)
        assert (other.warp_strain, other.weft_strain) == pytest.approx((one.warp_strain, one.weft_strain), abs=1e-12)
    # the mirrored warp still points along +x
    np.testing.assert_allclose(x.warp_direction, np.array(one.warp_direction) * [1, -1, -1], atol=1e-9)
    np.testing.assert_allclose(x.weft_direction, np.array(one.weft_direction) * [-1, 1, 1], atol=1e-9)


def test_probe_at_45_degrees_swaps_warp_and_weft_across_a_plane(domes):
    """(U, V) mirrored in y is (V, U): x = (U - V) / sqrt 2, y = (U + V) / sqrt 2 for the warp at +45 degrees."""
    dome = domes["hemisphere-45"]
    one, mirrored = dome.probe([(20.0, -9.0), (-9.0, 20.0)])
    x, y, z = one.position_mm
    np.testing.assert_allclose(mirrored.position_mm, [-x, y, z], atol=1e-9)
    assert mirrored.shear_angle_deg == pytest.approx(one.shear_angle_deg, abs=1e-9)
    assert mirrored.warp_strain == pytest.approx(one.weft_strain, abs=1e-12)
    assert mirrored.weft_force_N_per_mm == pytest.approx(one.warp_force_N_per_mm, abs=1e-12)
    assert one.warp_strain != pytest.approx(one.weft_strain, rel=1e-3)


def test_probe_outside_the_blank_is_refused_with_the_point(dome):
    with pytest.raises(ResultError, match="outside the blank") as caught:
        dome.probe([(0.0, 0.0), (300.0, 2.0)])
    assert "300,2" in caught.value.key


def test_probe_at_a_stroke_that_was_not_computed_is_refused(dome):
    with pytest.raises(ResultError, match="not computed"):
        dome.probe([(0.0, 0.0)], stroke=31.0)
    flat, formed = dome.probe([(10.0, 3.0)], stroke=0.0) + dome.probe([(10.0, 3.0)])
    assert formed.position_mm[2] > flat.position_mm[2] + 20.0


# -- interruption ----------------------------------------------------------------------------------


def test_interrupted_run_keeps_its_outputs_and_resumes_to_the_same_numbers(domes, tmp_path):
    """Ctrl-C halfway, then --resume: the final numbers are those of the run that went through, bit for bit."""

    def interrupt(progress):
        if progress.share > 0.4:
            raise KeyboardInterrupt

    through, out = domes["hemisphere-0-90"], tmp_path / "out"
    study = Study.load("hemisphere-0-90", SMALL)
    with pytest.raises(KeyboardInterrupt):
        run(study, out, watch=interrupt)
    halfway = Result.open(out)
    assert "interrupted" in halfway.summary["status"] and not halfway.summary["ok"]
    assert 5.0 < halfway.summary["stroke_mm"] < 25.0
    assert (out / "outline.csv").exists() and (out / "checkpoint.npz").exists()
    kept = len(halfway.history["time_s"])
    assert 10 < kept < 35
    assert halfway.strokes[-1] == pytest.approx(halfway.summary["stroke_mm"])
    resumed = run(study, out, resume=True)
    assert not (out / "checkpoint.npz").exists()
    for key in ("steps", "shear_angle_deg", "draw_in_mm", "stroke_mm", "punch_force_N"):
        assert resumed.summary[key] == through.summary[key]
    np.testing.assert_array_equal(resumed.fields().positions, through.fields().positions)
    assert resumed.summary["energy"]["external_work_mJ"] == through.summary["energy"]["external_work_mJ"]
    times = resumed.history["time_s"]
    assert (np.diff(times) > 0).all()
    # all rows of the run that went through, and one of the interruption unless it came just at one of them
    assert np.isin(through.history["time_s"], times).all()
    assert len(times) <= 41 + 1


def test_interrupted_while_compiling_leaves_nothing_half_written(tmp_path, monkeypatch):
    def interrupt(simulation):
        raise KeyboardInterrupt

    monkeypatch.setattr(Simulation, "compile", interrupt)
    out = tmp_path / "out"
    said = CliRunner().invoke(app, ["run", "hemisphere-0-90", "--out", str(out)])
    assert said.exit_code == 130
    assert "before there was anything to keep" in said.output and "--resume" not in said.output
    assert list(out.iterdir()) == []


@pytest.fixture
def interrupted(tmp_path):
    """Folder of a run that was interrupted early."""

    def interrupt(progress):
        if progress.share > 0.1:
            raise KeyboardInterrupt

    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        run(Study.load("hemisphere-0-90", SMALL), out, watch=interrupt)
    return out


@pytest.mark.parametrize(
    ("key", "value"),
    [("blank.cell_length_mm", 6.0), ("contact.punch.friction", 0.5), ("loading.stroke_mm", 25.0), ("output.rows", 40)],
)
def test_resuming_another_study_is_refused_by_key(interrupted, key, value):
    kept = {file.name: file.read_bytes() for file in interrupted.iterdir() if file.is_file()}
    with pytest.raises(ResultError, match="began with another value") as caught:
        run(Study.load("hemisphere-0-90", {**SMALL, key: value}), interrupted, resume=True)
    assert caught.value.key == key and caught.value.got == str(value)
    assert {file.name: file.read_bytes() for file in interrupted.iterdir() if file.is_file()} == kept


def test_resuming_with_another_card_is_refused(tmp_path):
    card = tmp_path / "card.toml"
    card.write_text(shipped_cards()["hexforce-48600-c1300"].read_text())
    study = {**SMALL, "fabric.card": str(card)}

    def interrupt(progress):
        if progress.share > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(Study.load("hemisphere-0-90", study), tmp_path / "out", watch=interrupt)
    card.write_text(card.read_text().replace("thickness_mm = 0.62", "thickness_mm = 0.6"))
    with pytest.raises(ResultError, match="the fabric card has changed"):
        run(Study.load("hemisphere-0-90", study), tmp_path / "out", resume=True)


@pytest.mark.parametrize("content", [lambda old: old[:20000], lambda old: b"garbage", lambda old: b""])
def test_a_damaged_checkpoint_is_called_so(interrupted, content):
    checkpoint = interrupted / "checkpoint.npz"
    checkpoint.write_bytes(content(checkpoint.read_bytes()))
    with pytest.raises(ResultError, match="checkpoint is damaged"):
        run(Study.load("hemisphere-0-90", SMALL), interrupted, resume=True)


def test_an_interrupted_run_goes_on_from_the_study_in_its_folder(interrupted):
    """As the command line says after an interrupt; and what is not known yet is no warning."""
    assert Result.open(interrupted).summary["warnings"] == []
    assert run(interrupted / "study.toml", interrupted, resume=True).summary["status"] == "done"


def test_nothing_to_resume_is_refused(tmp_path):
    with pytest.raises(ResultError, match="nothing to resume"):
        run(Study.load("hemisphere-0-90", SMALL), tmp_path / "out", resume=True)
    assert not (tmp_path / "out").exists()


def test_run_that_blows_up_stops_and_keeps_the_last_good_output(tmp_path, monkeypatch):
    """Half-way the steps become twice as long as the stable one; what came before is kept."""
    study = Study.load("hemisphere-0-90", {**SMALL, "loading.stroke_mm": 4.0, "loading.duration_s": 0.01})
    half = 0.5 * case_of(study).end
    chosen = Simulation._choose_step

    def too_long(simulation):
        chosen(simulation)
        simulation.clock[loop.C_STEP] *= 1.0 if simulation.time < half else 2.0

    monkeypatch.setattr(Simulation, "_choose_step", too_long)
    out = tmp_path / "out"
    with pytest.raises(UnstableRun, match="blew up at step"):
        run(study, out)
    result = Result.open(out)
    assert "blew up" in result.summary["status"] and not result.summary["ok"]
    assert len(result.history["time_s"]) > 20
    assert all(np.isfinite(values).all() for values in result.history.values())
    assert np.abs(result.fields().positions).max() < 200.0
    assert not (out / "checkpoint.npz").exists()
    json.loads((out / "summary.json").read_text(), parse_constant=lambda name: pytest.fail(name))


# -- refusals --------------------------------------------------------------------------------------


def test_foreign_folder_is_refused_and_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("work")
    with pytest.raises(ResultError, match="holds other files"):
        run(Study.load("hemisphere-0-90", SMALL), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]


def test_folder_with_the_users_own_study_is_refused(tmp_path):
    """A study that someone wrote, named study.toml, is no former result to be cleared."""
    from weftform.study.study import shipped_studies

    text = shipped_studies()["hemisphere-0-90"].read_text()
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(ResultError, match="holds other files"):
        run(tmp_path / "study.toml", tmp_path)
    assert (tmp_path / "study.toml").read_text() == text


def test_former_result_is_replaced(tmp_path):
    study = Study.load("hemisphere-0-90", {**SMALL, "loading.stroke_mm": 0.5, "loading.duration_s": 0.01})
    run(study, tmp_path / "out")
    (tmp_path / "out" / "notes.txt").write_text("mine")
    again = run(study, tmp_path / "out")
    assert len(again.history["time_s"]) == 41
    assert (tmp_path / "out" / "notes.txt").read_text() == "mine"


def test_folder_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ResultError, match="cannot be written"):
        run(Study.load("hemisphere-0-90", SMALL), tmp_path / "file" / "out")


@pytest.mark.parametrize(("study", "error"), [("no-such-study", StudyError), ("missing.toml", StudyError)])
def test_nothing_is_written_for_a_bad_study(tmp_path, study, error):
    with pytest.raises(error):
        run(study, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_written_for_a_bad_card_or_number_of_threads(tmp_path):
    from weftform.study.study import shipped_studies

    file = tmp_path / "bad.toml"
    text = shipped_studies()["hemisphere-0-90"].read_text()
    file.write_text(text.replace("[blank]", 'tension_variant = "printed"\n[blank]'))
    with pytest.raises(CardError, match="not monotone"):
        run(file, tmp_path / "out")
    with pytest.raises(StudyError, match="threads"):
        run(Study.load("hemisphere-0-90", SMALL), tmp_path / "out", threads=0)
    assert [p.name for p in tmp_path.iterdir()] == ["bad.toml"]


def test_no_result_is_refused(tmp_path):
    with pytest.raises(ResultError, match="no such folder"):
        Result.open(tmp_path / "nowhere")
    with pytest.raises(ResultError, match="missing"):
        Result.open(tmp_path)


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), RuntimeError("unable to extend file")])
def test_full_disk_is_one_message_and_leaves_a_checkpoint(tmp_path, monkeypatch, failure):
    """Frames are written beside the run: what fails there surfaces here, h5py's own kind of error included."""
    append, calls = Series.append, []

    def full(self, *arguments, **keywords):
        calls.append(1)
        if len(calls) > 2:
            raise failure
        append(self, *arguments, **keywords)

    monkeypatch.setattr(Series, "append", full)
    with pytest.raises(ResultError, match="could not be written"):
        run(Study.load("hemisphere-0-90", SMALL), tmp_path / "out")
    assert (tmp_path / "out" / "checkpoint.npz").exists()
    monkeypatch.undo()
    assert run(Study.load("hemisphere-0-90", SMALL), tmp_path / "out", resume=True).summary["status"] == "done"


def test_a_last_frame_that_fails_is_not_called_done(tmp_path, monkeypatch):
    append, frames = Series.append, 3

    def full(self, time, *arguments, **keywords):
        if time > 0.0 and len(written) == frames - 1:
            raise OSError(28, "No space left on device")
        written.append(time)
        append(self, time, *arguments, **keywords)

    written: list[float] = []
    monkeypatch.setattr(Series, "append", full)
    with pytest.raises(ResultError, match="could not be written"):
        run(Study.load("hemisphere-0-90", SMALL | {"output.frames": frames}), tmp_path / "out")
    assert len(written) == frames - 1
    assert not (tmp_path / "out" / "summary.json").exists()
