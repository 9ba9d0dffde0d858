"""Figures of an identification: the curves, the law, the correlation of the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from weftform.fabric.laws import Floats
from weftform.identification.optimising import Objective
from weftform.identification.record import shear_band
from weftform.identification.targets import Curve, interpolated
from weftform.identification.worker import Outcome
from weftform.report.style import COLOURS, FAINT, INK, headline, house_style, new_figure, place, save
from weftform.study.study import Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from weftform.identification.inverse import Identification

PANEL, GAP, LEFT = 4.3, 0.85, 0.75
"""Width of the column of one study, the gap between two, and the left margin [inches]."""
POINTS = 60
"""Measured points drawn of a curve with more."""


def draw_current(objective: Objective, studies: Sequence[Study], path: Path) -> Path:
    """The curves at the last accepted point, beside those of the first."""
    last = objective.iterates[-1]
    words = ", ".join(
        f"{p.name} = {v:.4g} {p.unit}".strip() for p, v in zip(objective.parameters, last.values, strict=True)
    )
    with house_style():
        figure = _curves_figure(
            studies,
            objective.curves,
            objective.iterates[0].outcomes,
            last.outcomes,
            f"Step {last.number} of an identification",
            f"Misfit {100 * last.misfit:.3g} % ({100 * objective.iterates[0].misfit:.3g} % at the start).\n"
            + _short(words),
        )
        return save(figure, path)


def draw_identification(found: Identification) -> list[Path]:
    """All figures of a finished identification; returns the files."""
    with house_style():
        figure = _curves_figure(
            found.studies,
            found.curves,
            found.iterates[0].outcomes,
            found.solution.outcomes,
            "Measured and identified",
            f"Misfit {100 * found.misfit:.3g} % ({100 * found.iterates[0].misfit:.3g} % at the start) after "
            f"{len(found.iterates) - 1} steps; {found.solution.message}.\n"
            "Faint points lie outside of the range that is compared.",
        )
        files = [save(figure, found.folder / "curves.png")]
        law = _law_figure(found)
        if law is not None:
            files.append(save(law, found.folder / "shear-law.png"))
        if len(found.parameters) > 1:
            files.append(save(_correlation_figure(found), found.folder / "correlation.png"))
    return files


def _short(words: str, most: int = 240) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(textwrap.shorten(words, most, placeholder=" ..."), 84))


def _curves_figure(
    studies: Sequence[Study],
    curves: Sequence[Curve],
    first: Sequence[Outcome],
    last: Sequence[Outcome],
    title: str,
    caption: str,
) -> Figure:
    """Force against displacement for each study, and below it the errors."""
    width = LEFT + len(studies) * (PANEL + GAP) - GAP + 0.25
    figure = new_figure(width, 5.9)
    for k, study in enumerate(studies):
        left = LEFT + k * (PANEL + GAP)
        upper = place(figure, left, 2.5, PANEL, 2.75)
        lower = place(figure, left, 1.15, PANEL, 1.1)
        lower.sharex(upper)
        upper.tick_params(labelbottom=False)
        own = [c for c in curves if c.study == k]
        end = 1.02 * max(float(c.displacement[-1]) for c in own)
        _forces(upper, own, first[k], last[k], end)
        _errors(lower, own, first[k], last[k])
        upper.set_xlim(0.0, end)
        upper.set_title(study.name, size=9, loc="left", color=FAINT)
        lower.set_xlabel("displacement  [mm]")
        if k == 0:
            upper.set_ylabel("force  [N]")
            lower.set_ylabel("error  [%]")
            upper.legend(loc="upper left", fontsize=8)
    headline(figure, title, caption, left=0.2)
    return figure


def _forces(axes: Axes, curves: Sequence[Curve], first: Outcome, last: Outcome, end: float) -> None:
    axes.grid(True)
    largest = 0.0
    for k, curve in enumerate(curves):
        s = curve.specimen
        shown = s.x <= end
        axes.plot(s.x[shown], s.y[shown], color=FAINT, lw=0.6, alpha=0.5)
        some = np.unique(np.linspace(0, len(curve.force) - 1, min(POINTS, len(curve.force))).astype(int))
        axes.plot(
            curve.displacement[some],
            curve.force[some],
            "o",
            ms=3.2,
            mfc="white",
            mec=INK,
            mew=0.7,
            ls="none",
            label="measured" if k == 0 else None,
            zorder=3,
        )
        largest = max(largest, float(curve.force.max()))
    at = np.linspace(0.0, end, 300)
    for outcome, name, style in (
        (first, "start", {"color": COLOURS["orange"], "ls": (0, (4, 2)), "lw": 1.3}),
        (last, "simulated", {"color": COLOURS["blue"], "lw": 1.8}),
    ):
        if not outcome.failure:
            force = _simulated(outcome, at)
            axes.plot(at, force, label=name, zorder=4, **style)  # type: ignore[arg-type]
            largest = max(largest, min(float(np.nanmax(force)), 2.0 * largest))
    axes.set_ylim(0.0, 1.08 * largest)


def _errors(axes: Axes, curves: Sequence[Curve], first: Outcome, last: Outcome) -> None:
    """Errors as they count, in percent of the force that each is weighed against."""
    axes.grid(True)
    axes.axhline(0.0, color=INK, lw=0.8)
    most = 0.0
    for curve in curves:
        for outcome, colour, width in ((first, COLOURS["orange"], 0.9), (last, COLOURS["blue"], 1.5)):
            if outcome.failure:
                continue
            error = 100.0 * (_simulated(outcome, curve.displacement) - curve.force) / curve.size
            axes.plot(curve.displacement, error, color=colour, lw=width, ls="solid" if outcome is last else (0, (4, 2)))
            if outcome is last:
                most = max(most, float(np.abs(error).max()))
    limit = max(1.3 * most, 1.0)
    axes.set_ylim(-limit, limit)


def _simulated(outcome: Outcome, at: Floats) -> Floats:
    return interpolated(np.array(outcome.displacement_mm), np.array(outcome.force_N), at)


def _law_figure(found: Identification) -> Figure | None:
    """G12 against the shear angle with its 95 % interval; None where the shear law was not fitted."""
    band = shear_band(found, 200)
    if band is None:
        return None
    degrees, modulus, lower, upper = band
    figure = new_figure(6.0, 4.4)
    axes = place(figure, 0.8, 1.0, 4.95, 2.9)
    axes.grid(True)
    span = next((f.span_deg for f in found.families if f.span_deg is not None), float(degrees[-1]))
    beyond = np.linspace(0.0, max(span, float(degrees[-1])), 300)
    radians = np.radians(beyond)
    from weftform.identification.laws import changed, changes_of

    start = changed(found.study, changes_of(found.families, [p.start for p in found.parameters])).fabric
    axes.plot(beyond, start.shear.modulus(radians), color=COLOURS["orange"], ls=(0, (4, 2)), lw=1.3, label="start")
    axes.plot(beyond, found.fabric.shear.modulus(radians), color=COLOURS["blue"], lw=1.0, alpha=0.5)
    axes.plot(degrees, modulus, color=COLOURS["blue"], lw=1.9, label="identified")
    if np.isfinite(upper).all():
        axes.fill_between(degrees, lower, upper, color=COLOURS["blue"], alpha=0.2, lw=0, label="95 % interval")
    if found.covered_deg is not None:
        axes.axvline(found.covered_deg, color=FAINT, lw=0.9, ls=":")
        axes.annotate(
            "curves end ",
            (found.covered_deg, 0.03),
            xycoords=("data", "axes fraction"),
            rotation=90,
            ha="right",
            va="bottom",
            size=7.5,
            color=FAINT,
        )
    axes.set_xlim(0.0, float(beyond[-1]))
    axes.set_ylim(0.0, 1.1 * float(max(modulus.max(), start.shear.modulus(np.radians(degrees)).max())))
    axes.set_xlabel("shear angle  [deg]")
    axes.set_ylabel("G12  [MPa]")
    axes.legend(loc="upper left", fontsize=8)
    caption = (
        "Dotted: kinematic shear angle at the end of the curves. The interval is that of the linear model at the\n"
        "solution; it knows the scatter of the curves, not the errors of the model."
    )
    headline(figure, "Shear modulus by inverse identification", caption, left=0.2)
    return figure


def _correlation_figure(found: Identification) -> Figure:
    """Correlation of the parameters as a coloured table."""
    matrix = found.uncertainty.correlation
    size = len(matrix)
    cell = 0.52
    figure = new_figure(2.2 + size * cell + 0.4, 1.5 + size * cell + 0.6)
    axes = place(figure, 2.0, 1.4, size * cell, size * cell)
    axes.imshow(np.nan_to_num(matrix), vmin=-1.0, vmax=1.0, cmap="RdBu_r")
    for a in range(size):
        for b in range(size):
            value = matrix[a, b]
            axes.text(
                b,
                a,
                f"{value:.2f}" if np.isfinite(value) else "-",
                ha="center",
                va="center",
                size=7,
                color="white" if abs(value) > 0.6 else INK,
            )
    names = [p.name for p in found.parameters]
    axes.set_xticks(range(size), names, rotation=45, ha="right", size=7.5)
    axes.set_yticks(range(size), names, size=7.5)
    axes.tick_params(length=0)
    condition = found.uncertainty.condition
    words = f"Condition number {condition:.3g}." if np.isfinite(condition) else "Not all can be told apart."
    headline(figure, "Correlation", words, left=0.2)
    return figure
