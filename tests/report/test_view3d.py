"""Without a display the view becomes a picture, with pyvista or without."""

from __future__ import annotations

import numpy as np
import pytest
import typer
from matplotlib.image import imread
from typer.testing import CliRunner

from weftform.cli.view import view
from weftform.errors import ResultError
from weftform.report import view3d


@pytest.fixture
def headless(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr("sys.platform", "linux")


@pytest.fixture
def without_pyvista(monkeypatch):
    monkeypatch.setattr(view3d, "render_window", lambda: "")


def assert_shows_something(path):
    picture = imread(path)[..., :3]
    assert min(picture.shape[:2]) > 500
    assert picture.std() > 0.05


def test_no_display_no_window(headless):
    assert not view3d.has_display()
    assert not view3d.can_open_window()


def test_a_display_that_vtk_does_not_reach_is_none(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":77")
    monkeypatch.setattr(view3d, "render_window", lambda: "vtkEGLRenderWindow")
    assert not view3d.can_open_window()


def test_picture_without_pyvista(along_yarns, headless, without_pyvista, tmp_path):
    shown = view3d.show(along_yarns, -1, tmp_path / "view.png")
    assert shown.by == "matplotlib" and shown.file == tmp_path / "view.png"
    assert_shows_something(shown.file)


def test_picture_with_pyvista(along_bias, headless, tmp_path):
    if not view3d.render_window():
        pytest.skip("pyvista cannot draw here")
    shown = view3d.show(along_bias, 1, tmp_path / "view.png", field="weft-force")
    assert shown.by == "pyvista"
    assert_shows_something(shown.file)


def test_tools_are_where_they_were(along_yarns):
    """The top of the punch starts half a thickness below the middle of the flat fabric, and makes the stroke."""
    punch = next(t for t in along_yarns.study.tools if t.motion == "stroke")
    x, y, z = view3d.tool_surface(punch, 75.0, 20.0)
    assert z.max() == pytest.approx(-0.5 * along_yarns.fabric.thickness)
    assert np.hypot(x, y).max() == pytest.approx(25.0)
    last = len(along_yarns.strokes) - 1
    assert [view3d.tool_way(along_yarns, punch, k) for k in (0, last)] == pytest.approx([0.0, 30.0])
    die = next(t for t in along_yarns.study.tools if t.motion == "fixed")
    assert view3d.tool_way(along_yarns, die, last) == 0.0


def test_command_says_where_the_picture_is(along_yarns, headless, without_pyvista):
    app = typer.Typer()
    app.command()(view)
    outcome = CliRunner().invoke(app, [str(along_yarns.folder), "--stroke", "30"])
    assert outcome.exit_code == 0, outcome.output
    assert str(along_yarns.folder / "figures" / "view.png") in outcome.output.replace("\n", "")
    assert "no display" in outcome.output


def test_unknown_field_and_file_type_are_refused(along_yarns, tmp_path):
    with pytest.raises(ResultError, match="no field named"):
        view3d.show(along_yarns, -1, tmp_path / "view.png", field="colour")
    with pytest.raises(ResultError, match="PNG"):
        view3d.show(along_yarns, -1, tmp_path / "view.svg")
