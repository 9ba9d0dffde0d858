"""Figures are written, show something, and say what was run."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest
from matplotlib.image import imread

from weftform import Study, run
from weftform.errors import ResultError
from weftform.report import figure_set, register_figures, write_figures
from weftform.report.edges import outline_figure
from weftform.report.figures import _SETS, generic_figures
from weftform.report.style import house_style, run_words

FORMING = [
    "shear-angle-formed",
    "shear-angle-above",
    "shear-angle-flat",
    "outline",
    "punch-force",
    "energies",
]


def assert_shows_something(path):
    picture = imread(path)[..., :3]
    assert min(picture.shape[:2]) > 500
    # White paper, and ink on more than a hundredth of it.
    inked = (picture < 0.95).any(axis=2).mean()
    assert 0.01 < inked < 0.95
    assert len(np.unique(picture[::7, ::7].reshape(-1, 3), axis=0)) > 20


@pytest.mark.parametrize("which", ["along_yarns", "along_bias"])
def test_forming_figures(which, request, tmp_path):
    result = request.getfixturevalue(which)
    files = write_figures(result, tmp_path / "new" / "folder")
    assert [f.stem for f in files] == FORMING
    for file in files:
        assert_shows_something(file)


@pytest.mark.slow
def test_forming_figures_of_a_run(tmp_path):
    small = ["blank.cell_length_mm=10", "loading.duration_s=0.02", "output.frames=3", "output.rows=11"]
    result = run(Study.load("hemisphere-0-90", small), tmp_path / "result")
    assert [f.stem for f in write_figures(result)] == FORMING


def test_default_folder_and_earlier_instant(along_yarns):
    files = write_figures(along_yarns, stroke=15.0)
    assert {f.parent for f in files} == {along_yarns.folder / "figures"}
    with pytest.raises(ResultError, match="not computed"):
        write_figures(along_yarns, stroke=300.0)


def test_unknown_kinds_get_the_generic_figures(along_yarns, tmp_path):
    assert figure_set("no such kind") is generic_figures
    with house_style():
        named = dict(generic_figures(along_yarns, len(along_yarns.strokes) - 1))
    assert list(named) == ["shear-angle-deformed", "force", "energies"]


def test_another_kind_can_bring_its_own(monkeypatch):
    monkeypatch.setattr("weftform.report.figures._SETS", dict(_SETS))
    register_figures("tensile", generic_figures)
    assert figure_set("tensile") is generic_figures


def test_captions_say_what_was_run(along_bias):
    words = run_words(along_bias, 1)
    for part in ("hemisphere-45", "hexforce-48600-c1300", f"{along_bias.grid.cell_count} cells", "quarter", "stroke"):
        assert part in words


def test_draw_in_of_the_figure_is_that_of_the_summary(along_yarns):
    with house_style():
        figure = outline_figure(along_yarns, len(along_yarns.strokes) - 1)
    texts = [t.get_text() for t in figure.axes[0].texts]
    for name, value in along_yarns.summary["draw_in_mm"].items():
        assert f"{name.replace('_', ' ')}\n{value:.2f} mm" in texts


def test_settings_of_the_caller_come_back(along_yarns, tmp_path):
    before = dict(matplotlib.rcParams)
    write_figures(along_yarns, tmp_path)
    assert dict(matplotlib.rcParams) == before


def test_a_folder_that_cannot_be_written_is_named(along_yarns, tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ResultError, match="cannot be written"):
        write_figures(along_yarns, tmp_path / "file")


def test_shear_tests_show_the_law_that_comes_back(tmp_path):
    """Also beyond the range of the law, and through negative angles."""
    changes = {
        "specimen.cell_length_mm": 50.0,
        "output.frames": 2,
        "loading.shear_angles_deg": [20.0, -20.0],
        "fabric.override.shear.valid_to_deg": 15.0,
    }
    files = write_figures(run(Study.load("picture-frame", changes), tmp_path / "result"))
    assert [f.stem for f in files] == ["shear-angle-deformed", "force", "energies", "shear-force"]
    assert_shows_something(files[-1])
