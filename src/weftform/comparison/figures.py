"""Simulation laid over experiment: outlines with their gap, shear angles, force curves, markers (Figs. 15, 16)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from weftform.report.style import (
    COLOURS,
    FAINT,
    INK,
    MAP,
    headline,
    house_style,
    new_figure,
    place,
    run_words,
    save,
    way_word,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from weftform.comparison.comparison import Comparison
    from weftform.comparison.gaps import OutlineGap

Floats = NDArray[np.float64]

SIMULATED = COLOURS["blue"]
MEASURED = COLOURS["orange"]
BAND = "#eef1f4"
"""Shade of a tolerance."""
SIDES = "PuOr_r"
"""Colour map of gaps: violet inside, orange outside, told apart by colour-blind readers."""


def write_figures(comparison: Comparison, folder: Path) -> list[Path]:
    """Draw what was compared.

    Raises
    ------
    ResultError
        The folder cannot be written.
    """
    figures = {
        "outline": (comparison.outline, outline_figure),
        "angles": (comparison.angles, angles_figure),
        "curve": (comparison.curve, curve_figure),
        "markers": (comparison.markers, markers_figure),
    }
    with house_style():
        return [
            save(draw(comparison), folder / f"{name}.png")
            for name, (found, draw) in figures.items()
            if found is not None
        ]


def outline_figure(comparison: Comparison) -> Figure:
    """Measured over simulated outline in plan view, coloured by the gap along the normal, and the gap around the part."""
    gap = comparison.outline
    assert gap is not None
    figure = new_figure(6.4, 8.45)
    axes = place(figure, 0.72, 3.2, 4.6, 4.6)
    _plan(axes, np.vstack([gap.measured.points, gap.simulated.points]))
    ring = np.vstack([gap.simulated.points, gap.simulated.points[:1]])
    axes.fill(*ring.T, color=SIMULATED, alpha=0.07, lw=0)
    axes.plot(*ring.T, color=INK, lw=1.0, label="simulated", zorder=4)
    # a gap of less than a thousandth of the size is drawn pale: its colours would say nothing
    reach = max(float(np.abs(gap.normal).max()), 1e-3 * gap.simulated.size)
    scale = Normalize(-reach, reach)
    half = 0.5 * gap.pieces.lengths[:, None] * np.stack([-gap.pieces.normals[:, 1], gap.pieces.normals[:, 0]], axis=1)
    middles = gap.pieces.middles
    lines = list(np.stack([middles - half, middles + half], axis=1))
    # a casing keeps the curve visible where the gap vanishes and its colour with it
    axes.add_collection(LineCollection(lines, color="#8d959d", lw=4.2, capstyle="round", zorder=2.5))
    drawn = axes.add_collection(
        LineCollection(lines, cmap=SIDES, norm=scale, array=gap.normal, lw=3.0, capstyle="round", zorder=3)
    )
    axes.plot([], [], color=MEASURED, lw=3.0, label="measured, coloured by its gap")
    worst = int(np.abs(gap.normal).argmax())
    centre = gap.simulated.centre
    inward = (centre - middles[worst]) / max(float(np.linalg.norm(centre - middles[worst])), 1e-9)
    axes.annotate(
        f"{abs(gap.normal[worst]):.2f} mm",
        tuple(middles[worst]),
        tuple(middles[worst] + 0.3 * gap.simulated.size * inward),
        ha="center",
        va="center",
        weight="bold",
        bbox={"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.7},
        arrowprops={"arrowstyle": "-", "color": FAINT, "lw": 0.8, "shrinkA": 2, "shrinkB": 3},
        zorder=5,
    )
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, columnspacing=2.2)
    bar = figure.colorbar(drawn, cax=place(figure, 5.5, 3.2, 0.14, 4.6))
    bar.outline.set_visible(False)
    bar.set_label("gap along the normal  [mm]    (+ measured outside)")
    lower = place(figure, 0.72, 1.15, 4.6, 1.35)
    around = np.degrees(np.arctan2(*(middles - centre).T[::-1]))
    order = np.argsort(around)
    _tolerance_band(lower, comparison, "outline")
    lower.axhline(0.0, color=INK, lw=0.8)
    lower.plot(around[order], gap.normal[order], ".", ms=2.2, color=MEASURED)
    lower.update_datalim([(0.0, -0.5 * reach), (0.0, 0.5 * reach)])
    lower.autoscale_view()
    lower.grid(True)
    lower.set_xlim(-180, 180)
    lower.set_xticks(range(-180, 181, 45))
    lower.set_xlabel("direction from the middle of the outline  [deg]")
    lower.set_ylabel("gap  [mm]")
    headline(figure, "Measured and simulated outline", _caption(comparison, _gap_words(gap)))
    return figure


def angles_figure(comparison: Comparison) -> Figure:
    """Shear angles measured and simulated at each point, and their difference."""
    found = comparison.angles
    assert found is not None
    points = found.points
    count = len(points)
    width = min(max(5.1, 0.42 * count), 12.0)
    names = [p.name if len(p.name) < 15 else f"{p.name[:6]}…{p.name[-6:]}" for p in points]
    slanted = max(map(len, names)) * count > 9 * width
    bottom = 1.95 if slanted else 1.1
    figure = new_figure(width + 1.1, bottom + 4.25)
    upper, lower = place(figure, 0.8, bottom + 1.5, width, 2.05), place(figure, 0.8, bottom, width, 1.15)
    at = np.arange(count)
    measured, simulated = (np.array([getattr(p, k) for p in points]) for k in ("measured", "simulated"))
    scatter = np.nan_to_num(np.array([p.scatter for p in points]))
    upper.plot([at - 0.1, at + 0.1], [measured, simulated], color="#b9c0c7", lw=1.0, zorder=1)
    upper.errorbar(
        at - 0.1,
        measured,
        scatter if scatter.any() else None,
        fmt="s",
        ms=5.5,
        color=MEASURED,
        capsize=3,
        lw=1.1,
        label="measured",
    )
    upper.plot(at + 0.1, simulated, "o", ms=6, mfc="white", mew=1.7, color=SIMULATED, label="simulated")
    upper.set_ylabel("shear angle  [deg]" if found.signed else "size of the shear angle  [deg]")
    upper.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, columnspacing=1.6)
    upper.tick_params(labelbottom=False)
    _tolerance_band(lower, comparison, "angle")
    lower.axhline(0.0, color=INK, lw=0.8)
    limit = comparison.tolerance("angle")
    beyond = np.abs(found.differences) > (limit.limit if limit else np.inf)
    lower.bar(at, found.differences, width=0.5, color=np.where(beyond, COLOURS["red"], SIMULATED), zorder=2)
    lower.set_ylabel("simulated −\nmeasured  [deg]")
    for axes in (upper, lower):
        axes.grid(True, axis="y")
        axes.set_axisbelow(True)
        axes.set_xlim(-0.6, count - 0.4)
        axes.set_xticks(at)
    lower.set_xticklabels(
        names, rotation=60 if slanted else 0, ha="right" if slanted else "center", rotation_mode="anchor"
    )
    sizes = np.abs(found.differences)
    note = f"Largest difference {sizes.max():.2f}° ({points[int(sizes.argmax())].name}), mean {sizes.mean():.2f}°."
    headline(figure, "Shear angles at the measured points", _caption(comparison, note))
    return figure


def curve_figure(comparison: Comparison) -> Figure:
    """Measured and simulated force, and their difference over the common range."""
    found = comparison.curve
    assert found is not None
    figure = new_figure(6.2, 5.7)
    upper, lower = place(figure, 0.84, 2.7, 5.05, 2.45), place(figure, 0.84, 1.05, 5.05, 1.3)
    mean = found.mean
    if mean.specimens > 1:
        upper.fill_between(
            mean.x, mean.lowest, mean.highest, color=MEASURED, alpha=0.2, lw=0, label=f"{mean.specimens} specimens"
        )
    upper.plot(mean.x, mean.mean, color=MEASURED, lw=1.8, label="measured" if mean.specimens == 1 else "their mean")
    upper.plot(*found.history, color=SIMULATED, lw=1.8, label="simulated")
    upper.set_ylabel("force  [N]")
    upper.legend(loc="upper left")
    upper.tick_params(labelbottom=False)
    _tolerance_band(lower, comparison, "curve")
    lower.axhline(0.0, color=INK, lw=0.8)
    lower.fill_between(found.way, found.difference, color=SIMULATED, alpha=0.18, lw=0)
    lower.plot(found.way, found.difference, color=SIMULATED, lw=1.3)
    lower.set_ylabel("simulated −\nmeasured  [N]")
    lower.set_xlabel(
        f"{'punch ' if way_word(comparison.result) == 'stroke' else ''}{way_word(comparison.result)}  [mm]"
    )
    for axes in (upper, lower):
        axes.grid(True)
        axes.set_xlim(0.0, max(float(mean.x[-1]), float(found.history[0][-1])))
    note = (
        f"From {found.way[0]:.3g} to {found.way[-1]:.4g} mm: RMS difference {found.rms:.3g} N "
        f"({100 * found.rms / found.peak:.3g} % of the measured peak, {found.peak:.4g} N), "
        f"largest {found.largest:.3g} N ({100 * found.largest / found.peak:.3g} %)."
    )
    headline(figure, "Measured and simulated force", _caption(comparison, note, axes=False))
    return figure


def markers_figure(comparison: Comparison) -> Figure:
    """Markers as measured and as simulated in plan view, coloured by the distance between them."""
    found = comparison.markers
    assert found is not None
    figure = new_figure(6.4, 6.45)
    axes = place(figure, 0.72, 1.2, 4.6, 4.6)
    edge = comparison.result.outline(comparison.frame)[1][:, :2]
    _plan(axes, np.vstack([edge, found.measured[:, :2]]))
    axes.plot(*edge.T, color=FAINT, lw=1.0)
    distances = found.distances
    axes.add_collection(
        LineCollection(
            list(np.stack([found.measured[:, :2], found.simulated[:, :2]], axis=1)), color=INK, lw=0.9, zorder=2
        )
    )
    axes.plot(*found.simulated[:, :2].T, "+", ms=7, mew=1.2, color=INK, label="simulated", zorder=3, ls="none")
    drawn = axes.scatter(
        found.measured[:, 0],
        found.measured[:, 1],
        s=30,
        c=distances,
        cmap=MAP,
        vmin=0.0,
        vmax=float(distances.max()) or 1e-9,
        lw=0,
        label="measured",
        zorder=4,
    )
    worst = int(distances.argmax())
    axes.annotate(
        f"{found.names[worst]}: {distances[worst]:.2f} mm",
        tuple(found.measured[worst, :2]),
        (9, 9),
        textcoords="offset points",
        weight="bold",
        size=8.5,
        bbox={"boxstyle": "square,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.8},
        zorder=6,
    )
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, columnspacing=2.2)
    bar = figure.colorbar(drawn, cax=place(figure, 5.5, 1.2, 0.14, 4.6))
    bar.outline.set_visible(False)
    bar.set_label("distance  [mm]" if found.measured.shape[1] == 3 else "distance in plan view  [mm]")
    note = f"{len(found.names)} markers, mean distance {distances.mean():.2f} mm."
    headline(figure, "Measured markers and simulated material points", _caption(comparison, note))
    return figure


def _plan(axes: Axes, points: Floats) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    middle, reach = 0.5 * (low + high), 0.56 * float((high - low).max())
    axes.set_aspect("equal")
    axes.set_xlim(middle[0] - reach, middle[0] + reach)
    axes.set_ylim(middle[1] - reach, middle[1] + reach)
    axes.set_xlabel("x  [mm]")
    axes.set_ylabel("y  [mm]")


def _tolerance_band(axes: Axes, comparison: Comparison, name: str) -> None:
    """Shade what a tolerance allows."""
    tolerance = comparison.tolerance(name)
    if tolerance is None:
        return
    limit = tolerance.limit
    if tolerance.percent and comparison.curve is not None:
        limit *= 0.01 * comparison.curve.peak
    axes.axhspan(-limit, limit, color=BAND, zorder=0)
    axes.annotate(
        f"shaded: tolerance ±{tolerance.limit:g} {tolerance.unit}",
        (1.0, 1.0),
        (0, 3),
        xycoords="axes fraction",
        textcoords="offset points",
        ha="right",
        va="bottom",
        size=7.2,
        color=FAINT,
    )
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, -1.5 * limit), max(high, 1.5 * limit))
    axes.set_autoscaley_on(True)
    axes.update_datalim([(0.0, -1.5 * limit), (0.0, 1.5 * limit)])


def _gap_words(gap: OutlineGap) -> str:
    words = []
    for name, values in (("along the normal", gap.normal), ("along X", gap.along_x), ("along Y", gap.along_y)):
        found = gap.statistics(values)
        if found["max"] is not None:
            words.append(f"{name} {found['max']:.2f}, {found['mean']:.2f}")
    return f"Gap, largest and mean [mm]: {'; '.join(words)}; Hausdorff distance {gap.hausdorff:.2f}."


def _caption(comparison: Comparison, note: str = "", *, axes: bool = True) -> str:
    words = [run_words(comparison.result, comparison.frame)]
    if axes:
        words.append(comparison.placement.words())
    return "\n".join([*words, note] if note else words)
