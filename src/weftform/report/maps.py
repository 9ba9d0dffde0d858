"""Maps of a field of the cells: on the formed part, obliquely and from above, and on the flat blank."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from weftform.report.projection import Camera, shade
from weftform.report.quantities import QUANTITIES, Quantity
from weftform.report.style import FAINT, MAP, headline, new_figure, place, run_words
from weftform.report.whole import WholePart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from weftform.result import Result

Floats = NDArray[np.float64]

YARN_CONTRAST = 0.26
"""How far the lines of the mesh differ from the cells they bound: darker on light cells, lighter on dark ones."""


def oblique_map(result: Result, frame: int, shown: Quantity = QUANTITIES["shear"]) -> Figure:
    """The whole formed part in perspective, with the flat blank's edge dashed where it was.

    Parameters
    ----------
    frame
        Index of the instant.
    shown
        Field that colours the cells.
    """
    fields = result.fields(frame)
    turned = _dome_down(fields.positions[result.grid.active])
    part = shown.on_whole_part(fields, _upright(fields.positions, turned))
    flat, _ = result.outline(frame)
    edge = _upright(np.column_stack([flat, np.zeros(len(flat))]), turned)
    reach = float(np.abs(flat).max())
    top = float(part.corners[..., 2].max())
    camera = Camera(azimuth=-64.0, elevation=33.0, distance=7.0 * reach, target=(0.0, 0.0, 0.35 * top))
    polygons, near = camera.project(part.corners)
    blank, _ = camera.project(edge)
    norm = colour_range(part.values)
    faces = shade(colormaps[MAP](norm(part.values))[:, :3], part.normals, camera)

    everything = np.vstack([polygons.reshape(-1, 2), blank])
    low, high = everything.min(axis=0), everything.max(axis=0)
    width = 8.0
    scale = (width - 1.3) / (high[0] - low[0])
    drawing = scale * (high[1] - low[1])
    figure = new_figure(width, drawing + 0.98)
    axes = place(figure, 0.16, 0.5, scale * (high[0] - low[0]), drawing)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_axis_off()
    axes.plot(*blank.T, color=FAINT, lw=0.9, ls=(0, (5, 3.5)), zorder=1, clip_on=False)
    draw_cells(axes, polygons, part.triangle, faces, near.mean(axis=1), width=0.34, zorder=2)
    colour_bar(figure, norm, shown, (width - 0.78, 0.5 + 0.17 * drawing, 0.13, 0.66 * drawing))
    note = "Dashed: edge of the flat blank. " + ("Part turned over. " if turned else "") + part.note()
    headline(figure, f"{shown.title} on the formed part", run_words(result, frame, note.strip()))
    return figure


def above_map(result: Result, frame: int, shown: Quantity = QUANTITIES["shear"]) -> Figure:
    """The whole formed part seen along the axis of the press, from the side of its dome."""
    fields = result.fields(frame)
    turned = _dome_down(fields.positions[result.grid.active])
    part = shown.on_whole_part(fields, _upright(fields.positions, turned))
    flat, _ = result.outline(frame)
    figure, axes, drawn = _plan(result, part, shown, float(np.abs(flat).max()))
    axes.plot(flat[:, 0], -flat[:, 1] if turned else flat[:, 1], color=FAINT, lw=0.9, ls=(0, (5, 3.5)), zorder=1)
    side = "Seen from below. " if turned else ""
    note = f"Dashed: edge of the flat blank. {_tool_circles(axes, result)}{side}{drawn}"
    headline(figure, f"{shown.title} on the formed part, from above", run_words(result, frame, note.strip()))
    return figure


def flat_map(result: Result, frame: int, shown: Quantity = QUANTITIES["shear"]) -> Figure:
    """The field at an instant, drawn on the flat blank where the material came from."""
    fields = result.fields(frame)
    part = shown.on_whole_part(fields, result.grid.flat)
    figure, axes, note = _plan(result, part, shown, float(np.abs(part.corners[..., :2]).max()))
    _yarn_arrows(axes, result, float(np.abs(part.corners[..., :2]).max()))
    headline(figure, f"{shown.title} on the flat blank", run_words(result, frame, note))
    return figure


def deformed_map(result: Result, frame: int, shown: Quantity = QUANTITIES["shear"]) -> Figure:
    """The field on the deformed shape of a flat specimen, with the edge that it had dashed."""
    fields = result.fields(frame)
    part = shown.on_whole_part(fields)
    flat, _ = result.outline(frame)
    reach = max(float(np.abs(flat).max()), float(np.abs(part.corners[..., :2]).max()))
    figure, axes, note = _plan(result, part, shown, reach)
    axes.plot(*flat.T, color=FAINT, lw=0.9, ls=(0, (5, 3.5)), zorder=1)
    headline(
        figure,
        f"{shown.title} on the deformed specimen",
        run_words(result, frame, ("Dashed: edge at the start. " + note).strip()),
    )
    return figure


def draw_cells(
    axes: Axes,
    polygons: Floats,
    triangle: NDArray[np.bool_],
    faces: Floats,
    near: Floats,
    *,
    width: float,
    zorder: float,
) -> None:
    """Draw cells from far to near, with the lines of the mesh a shade darker than the cells.

    Parameters
    ----------
    polygons
        Corners on the picture, shape [polygons, 4, 2]; half cells as in :class:`weftform.report.whole.Patches`.
    triangle
        Whether each is a half cell, shape [polygons].
    faces
        RGB, shape [polygons, 3].
    near
        Nearness to the eye, shape [polygons].
    width
        Of the lines [points].
    """
    if len(polygons) > 12_000:
        width *= math.sqrt(12_000 / len(polygons))
    lines = _line_colours(faces)
    # a half cell has no yarn along its long side: its outline takes its own colour and its yarns come just above it
    yarns = polygons[triangle][:, [0, 1, 2, 1]]
    order = np.argsort(np.concatenate([near, near[triangle] + 1e-6]), kind="stable")
    shapes = np.concatenate([polygons, yarns])[order]
    edges = np.concatenate([np.where(triangle[:, None], faces, lines), lines[triangle]])[order]
    fills = np.concatenate(
        [np.column_stack([faces, np.ones(len(faces))]), np.zeros((int(triangle.sum()), 4))],
    )[order]
    axes.add_collection(
        PolyCollection(
            list(shapes), facecolors=fills, edgecolors=edges, linewidths=width, joinstyle="round", zorder=zorder
        ),
        autolim=False,
    )


def _line_colours(faces: Floats) -> Floats:
    """Colours of the lines, shape [polygons, 3]: seen on dark cells as well as on light ones."""
    lightness = faces @ np.array([0.299, 0.587, 0.114])
    darker = np.clip((lightness - 0.16) / 0.16, 0.0, 1.0)[:, None]
    return np.asarray(faces * (1.0 - darker * YARN_CONTRAST) + (1.0 - darker) * 0.55 * YARN_CONTRAST * (1.0 - faces))


def colour_range(values: Floats) -> Normalize:
    """Range of the colours: round numbers around the values, from 0 where none is negative."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if low >= -1e-9 * max(abs(high), 1.0):
        low = 0.0
    if high - low < 1e-9:
        high = low + 1.0
    ticks = MaxNLocator(nbins=10, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    return Normalize(max(low, float(ticks[0])) if low == 0.0 else float(ticks[0]), float(ticks[-1]))


def colour_bar(figure: Figure, norm: Normalize, shown: Quantity, box: tuple[float, float, float, float]) -> None:
    """Colour bar at a place in inches."""
    axes = place(figure, *box)
    bar = figure.colorbar(ScalarMappable(norm, MAP), cax=axes)
    bar.outline.set_visible(False)  # type: ignore[operator]
    bar.ax.tick_params(length=2.5, pad=2.0, labelsize=8.0)
    bar.locator = MaxNLocator(nbins=6, steps=[1, 2, 5, 10])
    bar.update_ticks()
    bar.set_label(shown.label, size=8.5, labelpad=5.0)


def _plan(result: Result, part: WholePart, shown: Quantity, reach: float) -> tuple[Figure, Axes, str]:
    """A square picture in plan view, cells drawn, in mm."""
    side, left, bottom = 4.9, 0.68, 0.98
    figure = new_figure(left + side + 1.05, bottom + side + 0.5)
    axes = place(figure, left, bottom, side, side)
    norm = colour_range(part.values)
    faces = colormaps[MAP](norm(part.values))[:, :3]
    # from above a steep wall lies under what is higher
    draw_cells(
        axes, part.corners[..., :2], part.triangle, faces, part.corners[..., 2].mean(axis=1), width=0.3, zorder=2
    )
    axes.set_aspect("equal")
    axes.set_xlim(-1.06 * reach, 1.06 * reach)
    axes.set_ylim(-1.06 * reach, 1.06 * reach)
    axes.set_xlabel("x  [mm]")
    axes.set_ylabel("y  [mm]")
    colour_bar(figure, norm, shown, (left + side + 0.18, bottom + 0.12 * side, 0.13, 0.76 * side))
    return figure, axes, part.note()


def _tool_circles(axes: Axes, result: Result) -> str:
    """Draw where the punch and the hole of the fixed tool are in plan view, and say so."""
    words = {"stroke": "dotted", "fixed": "white circle"}
    said = []
    for tool in result.study.tools:
        if tool.motion not in words:
            continue
        radius = tool.s0 + tool.side_s * tool.radius
        turn = np.linspace(0.0, 2.0 * math.pi, 181)
        dotted = tool.motion == "stroke"
        axes.add_collection(
            LineCollection(
                [radius * np.column_stack([np.cos(turn), np.sin(turn)])],
                colors="white",
                linewidths=1.0 if dotted else 0.8,
                linestyles=[(0, (1, 1.6)) if dotted else "solid"],
                alpha=0.85,
                zorder=4,
            )
        )
        said.append(f"{words[tool.motion]}: {tool.name.replace('_', ' ')} Ø {2 * radius:g} mm")
    words_said = "; ".join(said)
    return f"{words_said[0].upper()}{words_said[1:]}. " if said else ""


def _yarn_arrows(axes: Axes, result: Result, reach: float) -> None:
    """Warp and weft directions, from the centre of the blank."""
    c, s = result.grid.axes
    length = 0.2 * reach
    for (x, y), name in (((c, s), "warp"), ((-s, c), "weft")):
        axes.annotate(
            "",
            (length * x, length * y),
            (0.0, 0.0),
            arrowprops={"arrowstyle": "-|>", "color": "white", "lw": 1.3, "shrinkA": 0, "shrinkB": 0},
            zorder=5,
        )
        axes.text(1.4 * length * x, 1.4 * length * y, name, color="white", size=8, ha="center", va="center", zorder=5)


def _dome_down(positions: Floats) -> bool:
    """Whether the part was formed downwards."""
    return bool(-positions[..., 2].min() > positions[..., 2].max())


def _upright(positions: Floats, turned: bool) -> Floats:
    """The part with its dome up: turned about the x axis if it was formed downwards."""
    return positions * np.array([1.0, -1.0, -1.0]) if turned else positions
