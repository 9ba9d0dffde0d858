"""View of a result in three dimensions: a window with a slider where there is a display, a picture where there is none.

Needs the extra ``[view]`` (pyvista); without it, or where it cannot draw, the picture is made by matplotlib.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from weftform.errors import ResultError
from weftform.report.quantities import Quantity, quantity

if TYPE_CHECKING:
    from weftform.report.whole import WholePart
    from weftform.result import Result
    from weftform.tooling import RigidTool

Floats = NDArray[np.float64]

PATIENCE_SECONDS = 90.0
"""How long the trial of off-screen rendering may take; the first start of VTK reads some hundred megabytes."""
TOOL_COLOURS = {"stroke": "#8a929b", "fixed": "#b9c0c7", "force": "#b9c0c7"}

_TRIAL = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(48, 48))
plotter.add_mesh(pyvista.Sphere(), color="red")
picture = plotter.screenshot(return_img=True)
assert picture.std() > 1.0
print("window:" + plotter.render_window.GetClassName())
"""


@dataclass(frozen=True)
class Shown:
    """How a result was shown.

    Attributes
    ----------
    by
        ``window``, or what made the picture.
    file
        The picture, None for a window.
    """

    by: Literal["window", "pyvista", "matplotlib"]
    file: Path | None = None


def has_display() -> bool:
    """Whether a window could be opened, as far as the environment says."""
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


@lru_cache(maxsize=1)
def render_window() -> str:
    """Name of the VTK class that draws on this machine; empty where pyvista is not installed or cannot draw.

    VTK may end the process where it finds no graphics, so it is tried in another one.
    """
    if find_spec("pyvista") is None:
        return ""
    try:
        trial = subprocess.run(
            [sys.executable, "-c", _TRIAL], capture_output=True, text=True, timeout=PATIENCE_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    said = [line for line in trial.stdout.splitlines() if line.startswith("window:")]
    return said[-1].removeprefix("window:") if trial.returncode == 0 and said else ""


def can_open_window() -> bool:
    """Whether there is a display that VTK can use: off-screen classes are chosen where it does not answer."""
    if not has_display():
        return False
    name = render_window()
    return bool(name) and not any(word in name for word in ("EGL", "OSOpenGL", "OSMesa"))


def show(result: Result, frame: int = -1, off_screen: Path | None = None, *, field: str = "shear") -> Shown:
    """Show a result, in a window or as a picture.

    Parameters
    ----------
    frame
        Index of the instant; in a window the slider starts there.
    off_screen
        Write a picture (PNG) to this file and open no window. Without, a window opens if it can, else the picture goes
        to ``figures/view.png`` in the result folder.
    field
        Name of the field, see :data:`weftform.report.quantities.QUANTITIES`.

    Returns
    -------
    What was done.

    Raises
    ------
    ResultError
        There is no such field, or the picture cannot be written.
    """
    shown = quantity(field)
    frame = range(len(result.strokes))[frame]
    if off_screen is None and can_open_window():
        scene = _Scene(result, frame, shown, off_screen=False)
        scene.add_slider()
        scene.plotter.show(title=f"weftform: {result.study.name}")
        return Shown("window")
    file = result.folder / "figures" / "view.png" if off_screen is None else Path(off_screen)
    if file.suffix.lower() != ".png":
        raise ResultError("a view is written as PNG", key="--png", expected="a file ending in .png", got=str(file))
    if not render_window():
        from weftform.report.maps import oblique_map
        from weftform.report.style import house_style, save

        with house_style():
            return Shown("matplotlib", save(oblique_map(result, frame, shown), file))
    scene = _Scene(result, frame, shown, off_screen=True)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        scene.plotter.screenshot(str(file))
    except OSError as problem:
        raise ResultError(f"the picture cannot be written ({problem.strerror})", file=file) from None
    finally:
        scene.plotter.close()
    return Shown("pyvista", file)


def tool_surface(tool: RigidTool, reach: float, depth: float) -> tuple[Floats, Floats, Floats]:
    """Surface of revolution of a tool at its own position 0: x, y, z [mm], shape [points, turns] each.

    Parameters
    ----------
    reach
        Radius of flat faces [mm].
    depth
        How far the shank is drawn [mm].
    """
    profile = tool.profile(reach, depth)
    turn = np.linspace(0.0, 2.0 * np.pi, 91)
    x, y = (profile[:, :1] * f(turn)[None, :] for f in (np.cos, np.sin))
    return x, y, np.broadcast_to(profile[:, 1:], x.shape).copy()


def tool_way(result: Result, tool: RigidTool, frame: int) -> float:
    """Way of a tool along z since the start, at an instant with fields [mm]."""
    if tool.motion == "stroke":
        return tool.up * float(result.strokes[frame])
    if tool.motion == "force" and "holder_displacement_mm" in result.history:
        history = result.history
        return float(np.interp(result.times[frame], history["time_s"], history["holder_displacement_mm"]))
    return 0.0


class _Scene:
    """Blank, lines of its mesh and tools in a pyvista plotter."""

    def __init__(self, result: Result, frame: int, shown: Quantity, *, off_screen: bool) -> None:
        from matplotlib import colormaps
        from vtkmodules.vtkCommonCore import vtkLogger

        from weftform.report.maps import colour_range
        from weftform.report.style import MAP, run_words

        pyvista: Any = import_module("pyvista")
        # VTK warns on the terminal that there is no display, which is known
        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
        self.result, self.shown = result, shown
        part = shown.on_whole_part(result.fields(frame))
        last = shown.on_whole_part(result.fields(-1))
        norm = colour_range(np.concatenate([part.values, last.values]))
        self.plotter: Any = pyvista.Plotter(off_screen=off_screen, window_size=[1600, 1000])
        self.plotter.set_background("white")
        self.plotter.enable_anti_aliasing("ssaa")
        self.cloth: Any = pyvista.PolyData(part.corners.reshape(-1, 3), faces=_faces(part))
        self.cloth.cell_data["shown"] = part.values
        self.plotter.add_mesh(
            self.cloth,
            scalars="shown",
            cmap=colormaps[MAP],
            clim=[float(v) for v in (norm.vmin or 0.0, norm.vmax or 1.0)],
            lighting=True,
            ambient=0.35,
            diffuse=0.7,
            specular=0.08,
            scalar_bar_args={
                "title": f"{shown.title} [{shown.unit}]\n",
                "vertical": True,
                "position_x": 0.9,
                "position_y": 0.22,
                "height": 0.56,
                "width": 0.045,
                "n_labels": 6,
                "fmt": "{:.3g}" if pyvista.vtk_version_info >= (9, 6) else "%.3g",
                "color": "#22262b",
                "title_font_size": 20,
                "label_font_size": 20,
            },
        )
        self.yarns: Any = pyvista.PolyData(part.corners.reshape(-1, 3), lines=_lines(part))
        self.plotter.add_mesh(self.yarns, color="#101418", opacity=0.22, line_width=1.0, lighting=False)
        self.tools = self._add_tools(frame)
        self.caption = run_words
        self._label(frame)
        self._aim()

    def _add_tools(self, frame: int) -> list[tuple[RigidTool, Any]]:
        """Translucent surfaces of the tools."""
        pyvista: Any = import_module("pyvista")
        reach = 0.95 * float(np.abs(self.result.grid.flat[self.result.grid.active]).max())
        depth = 0.25 * reach
        added = []
        for tool in self.result.study.tools:
            surface = pyvista.StructuredGrid(*(a[..., None] for a in tool_surface(tool, reach, depth)))
            actor = self.plotter.add_mesh(
                surface.extract_surface(algorithm="dataset_surface"),
                color=TOOL_COLOURS[tool.motion],
                opacity=0.3 if tool.motion == "stroke" else 0.13,
                smooth_shading=True,
                specular=0.3,
            )
            actor.position = (0.0, 0.0, tool_way(self.result, tool, frame))
            added.append((tool, actor))
        return added

    def _aim(self) -> None:
        """Look from the side of the dome, obliquely."""
        from weftform.report.projection import Camera

        heights = self.result.fields(-1).positions[self.result.grid.active][:, 2]
        down = -heights.min() > heights.max()
        reach = float(np.abs(self.result.grid.flat[self.result.grid.active]).max())
        towards = Camera(-64.0, -33.0 if down else 33.0, 1.0).axes[2]
        target = np.array([0.0, 0.0, 0.08 * reach if down else -0.08 * reach])
        self.plotter.camera_position = [tuple(target + 5.0 * reach * towards), tuple(target), (0.0, 0.0, 1.0)]
        self.plotter.camera.view_angle = 22.0

    def _label(self, frame: int) -> None:
        words = self.caption(self.result, frame)
        self.plotter.add_text(words, position=(24, 20), font_size=9, color="#6f7780", name="caption", font="arial")

    def move_to(self, frame: int) -> None:
        """Show another instant."""
        part = self.shown.on_whole_part(self.result.fields(frame))
        self.cloth.points = part.corners.reshape(-1, 3)
        self.yarns.points = part.corners.reshape(-1, 3)
        self.cloth.cell_data["shown"] = part.values
        for tool, actor in self.tools:
            actor.position = (0.0, 0.0, tool_way(self.result, tool, frame))
        self._label(frame)
        self.plotter.render()

    def add_slider(self) -> None:
        """A slider over the computed instants, by stroke."""
        strokes = self.result.strokes
        if len(strokes) < 2 or not strokes[-1] > strokes[0]:
            return
        self.plotter.add_slider_widget(
            lambda stroke: self.move_to(int(np.abs(strokes - stroke).argmin())),
            (float(strokes[0]), float(strokes[-1])),
            value=float(strokes[-1]),
            title="stroke [mm]",
            pointa=(0.3, 0.92),
            pointb=(0.7, 0.92),
            color="#22262b",
            fmt="%.1f",
            interaction_event="always",
        )


def _faces(part: WholePart) -> NDArray[np.int64]:
    """Cells as VTK wants them: number of corners, then the corners."""
    first = 4 * np.arange(len(part.corners))
    corners = first[:, None] + np.arange(4)
    rows = np.column_stack([np.where(part.triangle, 3, 4), corners])
    keep = np.ones(rows.shape, bool)
    keep[part.triangle, 4] = False
    return np.asarray(rows[keep])


def _lines(part: WholePart) -> NDArray[np.int64]:
    """Yarns along the sides of the cells, without the long sides of half cells."""
    first = 4 * np.arange(len(part.corners))
    pairs = []
    for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)):
        on = first if a < 2 else first[~part.triangle]
        pairs.append(np.column_stack([np.full(len(on), 2), on + a, on + b]))
    return np.concatenate(pairs).ravel()
