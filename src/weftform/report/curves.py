"""Curves of the history: force and energies against the stroke."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

from weftform.report.style import COLOURS, FAINT, INK, headline, new_figure, place, run_words, way_word

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from weftform.result import Result

Floats = NDArray[np.float64]

LIMIT_KINETIC = 0.05
"""Kinetic energy is to stay below this share of the internal energy, once the fabric is loaded."""
LOADED_FROM = 0.01
"""The fabric counts as loaded once its internal energy exceeds this share of its final value."""

ENERGIES = (
    ("external_work_mJ", "external work", "#22262b", (0, (4, 2))),
    ("friction_energy_mJ", "friction", COLOURS["orange"], "solid"),
    ("internal_energy_mJ", "internal", COLOURS["blue"], "solid"),
    ("damping_energy_mJ", "damping", COLOURS["green"], "solid"),
    ("contact_energy_mJ", "contact", COLOURS["violet"], "solid"),
    ("kinetic_energy_mJ", "kinetic", COLOURS["red"], "solid"),
)
"""Columns of the history that the figure of energies shows: name, label, colour, line style."""


def force_figure(result: Result, frame: int, force: str = "Force") -> Figure:
    """Force against displacement over the whole run.

    Parameters
    ----------
    force
        What the force is called.
    """
    history = result.history
    way, newtons = history["displacement_mm"], history["force_N"]
    figure = new_figure(6.2, 4.2)
    axes = place(figure, 0.72, 0.98, 5.2, 2.7)
    axes.grid(True)
    axes.plot(way, newtons, color=COLOURS["blue"], lw=1.9, clip_on=False, zorder=3)
    axes.plot(way[-1:], newtons[-1:], "o", color=COLOURS["blue"], ms=4.5, clip_on=False, zorder=4)
    axes.annotate(
        f"{newtons[-1]:.1f} N",
        (way[-1], newtons[-1]),
        (-4, 7),
        textcoords="offset points",
        ha="right",
        weight="bold",
        color=COLOURS["blue"],
    )
    _stroke_axis(axes, result)
    axes.set_ylim(min(0.0, 1.1 * float(newtons.min())), 1.12 * float(newtons.max()) or 1.0)
    axes.set_ylabel(f"{force}  [N]")
    forming = result.study.model.kind == "forming"
    note = (
        "Whole blank, friction included; mean over each output interval."
        if forming
        else "Value at each output instant."
    )
    headline(figure, f"{force} against {way_word(result)}", run_words(result, frame, note))
    return figure


def shear_law_figure(result: Result, frame: int) -> Figure:
    """Normalised shear force found by a virtual shear test, beside the law of the card that it was run with.

    Of a bias test by Eq. 5 from force and kinematic angle, of a picture frame from its force and angle.
    """
    found = result.summary["normalised_shear_force"]
    angle = np.array(found["shear_angle_deg"])
    frame_test = "from_frame_N_per_mm" in found
    force = np.array(found["from_frame_N_per_mm" if frame_test else "from_eq_5_N_per_mm"])
    figure = new_figure(6.2, 4.2)
    axes = place(figure, 0.85, 0.98, 5.1, 2.7)
    axes.grid(True)
    smooth = np.linspace(angle.min(), angle.max(), 400)
    law = result.fabric.normalised_shear_force(np.radians(smooth))
    axes.plot(smooth, law, color=INK, lw=1.0, label="law of the card")
    way = "force and angle of the frame" if frame_test else "Eq. 5 from force and kinematic angle"
    axes.plot(angle, force, "o", ms=3.2, mfc="none", color=COLOURS["blue"], label=f"virtual test: {way}")
    axes.set_ylim(1.12 * min(0.0, float(law.min())), 1.25 * float(law.max()) or 1.0)
    axes.set_xlabel("shear angle  [deg]", color=INK)
    axes.set_ylabel("normalised shear force  [N/mm]")
    axes.legend(loc="upper left")
    end = float(np.degrees(result.fabric.shear.valid_to))
    if end < angle.max():
        axes.axvline(end, color=FAINT, lw=0.8, ls=(0, (4, 2)))
        axes.annotate(
            "law ends, straight beyond ", (end, 0.02), xycoords=("data", "axes fraction"), ha="right", size=7.5
        )
    headline(figure, "Normalised shear force", run_words(result, frame))
    return figure


def energies_figure(result: Result, frame: int) -> Figure:
    """Energy ledger of the whole blank against displacement, and kinetic over internal energy with its limit."""
    figure = new_figure(6.7, 6.3)
    upper = place(figure, 0.78, 2.72, 4.4, 3.02)
    lower = place(figure, 0.78, 0.98, 4.4, 1.4)
    lower.sharex(upper)
    upper.tick_params(labelbottom=False)
    _ledger(upper, result)
    _kinetic_share(lower, result)
    _stroke_axis(lower, result)
    energy = result.summary.get("energy", {})
    note = "Whole blank."
    if "balance_error" in energy:
        note = f"Whole blank. The ledger closes within {100 * energy['balance_error']:.2g} % of the work."
    headline(figure, "Energies", run_words(result, frame, note))
    return figure


def _ledger(axes: Axes, result: Result) -> None:
    """Energies on a logarithmic axis, named where they end."""
    history = result.history
    way = history["displacement_mm"]
    # while the holder closes all energies stand above one another at no stroke
    moving = np.append(way[1:] > 0.0, True)
    known = [(history[column], *rest) for column, *rest in ENERGIES if column in history]
    most = max((float(np.abs(values).max()) for values, *_ in known), default=0.0) or 1.0
    floor = 1e-5 * most
    axes.grid(True)
    axes.set_yscale("log")
    axes.set_ylim(floor, 3.0 * most)
    axes.yaxis.set_major_locator(LogLocator(10.0, numticks=12))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(_plain))
    axes.set_ylabel("energy  [mJ]")
    names: list[tuple[float, str, str]] = []
    for values, label, colour, dashes in known:
        shown = np.where((values > floor) & moving, values, np.nan)
        axes.plot(way, shown, color=colour, ls=dashes, lw=1.6, label=label, zorder=4 if dashes == "solid" else 5)
        last = values[-1]
        if np.nanmax(values) > floor:
            names.append((max(float(last), floor), f"{label}  {_figures(float(last))}", colour))
    _name_ends(axes, names)


def _kinetic_share(axes: Axes, result: Result) -> None:
    """Kinetic over internal energy in percent, faint where the fabric is not loaded yet."""
    history = result.history
    way, kinetic, internal = (history[k] for k in ("displacement_mm", "kinetic_energy_mJ", "internal_energy_mJ"))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where((kinetic > 0.0) & (internal > 0.0), 100.0 * kinetic / internal, np.nan)
    share[way <= 0.0] = np.nan
    loaded = internal > LOADED_FROM * internal[-1]
    limit = 100.0 * LIMIT_KINETIC
    axes.grid(True)
    axes.set_yscale("log")
    axes.set_ylim(5e-3, 200.0)
    axes.yaxis.set_major_locator(LogLocator(100.0, numticks=8))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(_plain))
    axes.set_ylabel("kinetic / internal  [%]")
    axes.axhline(limit, color=COLOURS["red"], lw=1.0, ls=(0, (4, 2)))
    axes.plot(way, np.where(loaded, np.nan, share), color=COLOURS["blue"], alpha=0.35, lw=1.2)
    axes.plot(way, np.where(loaded, share, np.nan), color=COLOURS["blue"], lw=1.5)
    axes.annotate(
        f"limit {limit:g} %",
        (1.0, limit),
        (6, 0),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        va="center",
        size=8,
        color=COLOURS["red"],
    )
    if (~loaded & np.isfinite(share)).any():
        axes.annotate(
            "faint: before loading\n(internal below 1 %\nof its final value)",
            (1.0, 0.0),
            (6, 0),
            xycoords="axes fraction",
            textcoords="offset points",
            va="bottom",
            size=7,
            color=FAINT,
        )


def _name_ends(axes: Axes, names: list[tuple[float, str, str]]) -> None:
    """Write names to the right of a logarithmic axis at the height of their values, moved apart where they touch."""
    if not names:
        return
    low, high = (float(np.log10(v)) for v in axes.get_ylim())
    names = sorted(names)
    heights = np.array([(np.log10(value) - low) / (high - low) for value, _, _ in names])
    gap = 0.062
    for _ in range(200):
        for k in range(1, len(heights)):
            overlap = gap - (heights[k] - heights[k - 1])
            if overlap > 1e-6:
                heights[k - 1] -= 0.5 * overlap
                heights[k] += 0.5 * overlap
        heights = np.clip(heights, 0.0, 1.0)
    for height, (_, text, colour) in zip(heights, names, strict=True):
        axes.annotate(
            text,
            (1.0, float(height)),
            (6, 0),
            xycoords="axes fraction",
            textcoords="offset points",
            va="center",
            size=8,
            color=colour,
        )


def _stroke_axis(axes: Axes, result: Result) -> None:
    way = result.history["displacement_mm"]
    axes.set_xlim(0.0, float(way.max()) or 1.0)
    axes.set_xlabel(f"{'punch ' if way_word(result) == 'stroke' else ''}{way_word(result)}  [mm]", color=INK)


def _plain(value: float, _: int | None = None) -> str:
    """Powers of ten as people write them."""
    return f"{value:g}" if 1e-4 < value < 1e5 else f"$10^{{{round(float(np.log10(value)))}}}$"


def _figures(value: float) -> str:
    """Three digits with the unit."""
    return f"{value:.3g} mJ" if value < 1000.0 else f"{1e-3 * value:.3g} J"
