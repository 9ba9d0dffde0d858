"""The edge of the blank before and after forming, with its draw-in."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from shapely.geometry import LineString

from weftform.blank.outline import diagonal_angle
from weftform.report.style import COLOURS, FAINT, INK, headline, new_figure, place, run_words
from weftform.result.outline import draw_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from weftform.result import Result

Floats = NDArray[np.float64]


def outline_figure(result: Result, frame: int) -> Figure:
    """Edge of the whole blank, flat and formed, in plan view; draw-in of mid-edges and corner in mm."""
    flat, formed = result.outline(frame)
    reach = float(np.abs(flat).max())
    side, left, bottom = 4.9, 0.68, 0.98
    figure = new_figure(left + side + 0.4, bottom + side + 0.5)
    axes = place(figure, left, bottom, side, side)
    axes.set_aspect("equal")
    axes.set_xlim(-1.12 * reach, 1.12 * reach)
    axes.set_ylim(-1.12 * reach, 1.12 * reach)
    axes.set_xlabel("x  [mm]")
    axes.set_ylabel("y  [mm]")
    axes.fill(formed[:, 0], formed[:, 1], color=COLOURS["blue"], alpha=0.12, lw=0)
    axes.plot(*flat.T, color=FAINT, lw=1.0, ls=(0, (5, 3.5)), label="flat blank")
    axes.plot(formed[:, 0], formed[:, 1], color=COLOURS["blue"], lw=1.8, label="formed")
    for plane, x, y in (("x", (0, 0), (-1, 1)), ("y", (-1, 1), (0, 0))):
        if plane in result.grid.planes:
            axes.plot(1.12 * reach * np.array(x), 1.12 * reach * np.array(y), color=FAINT, lw=0.6, ls=(0, (8, 3, 1, 3)))
    corner = diagonal_angle(result.study.outline)
    found = draw_in(flat, formed, corner)
    for name, angle in (("edge_x", 0.0), ("edge_y", 0.5 * math.pi), ("corner", corner)):
        _arrow(axes, flat, angle, f"{name.replace('_', ' ')}\n{found[name]:.2f} mm", found[name], reach)
    axes.legend(loc="center", bbox_to_anchor=(0.36, 0.36), handlelength=2.6)
    note = "Dash-dotted: planes of symmetry of the model." if result.grid.planes else ""
    headline(figure, "Draw-in of the blank's edge", run_words(result, frame, note))
    return figure


def _arrow(axes: Axes, flat: Floats, angle: float, words: str, inward: float, reach: float) -> None:
    """Arrow from the flat edge inwards along a direction, with words at its head."""
    direction = np.array([math.cos(angle), math.sin(angle)])
    ray = LineString([(0.0, 0.0), tuple(4.0 * reach * direction)])
    met = ray.intersection(LineString(flat))
    if met.is_empty:
        return
    distance = max(math.hypot(x, y) for x, y in _points(met))
    start, end = distance * direction, (distance - inward) * direction
    axes.annotate(
        "",
        tuple(end),
        tuple(start),
        arrowprops={
            "arrowstyle": "-|>",
            "color": COLOURS["orange"],
            "lw": 1.6,
            "shrinkA": 0,
            "shrinkB": 0,
            "mutation_scale": 10 if abs(inward) > 0.06 * reach else 6,
        },
        zorder=5,
    )
    inner = (min(distance, distance - inward) - 0.04 * reach) * direction
    axes.text(
        float(inner[0]),
        float(inner[1]),
        words,
        color=INK,
        size=9,
        weight="bold",
        ha="right" if direction[0] > 0.3 else "center",
        va="center" if direction[1] < 0.3 else "top",
        linespacing=1.25,
        bbox={"boxstyle": "square,pad=0.1", "facecolor": "#e4ecf5", "edgecolor": "none"},
        zorder=6,
    )


def _points(met: object) -> list[tuple[float, float]]:
    """Vertices of whatever an intersection is made of."""
    parts = getattr(met, "geoms", [met])
    return [(float(x), float(y)) for part in parts for x, y in part.coords]
