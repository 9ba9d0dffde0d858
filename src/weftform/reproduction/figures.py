"""The paper's figures redrawn from the computation."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from weftform.laboratory.kinematics import bias_force, kinematic_angle
from weftform.reproduction.laws import EQ_4_PRINTED, HEIGHT, WIDTH
from weftform.reproduction.picture_frames import frame_tables, virtual_curve
from weftform.result import Result

Results = dict[str, Result]


def draw_paper_figures(results: Results, folder: Path) -> list[Path]:
    """Figs. 4, 6, 8, 9, 11, 13 and 14, the real picture frames, and the formed hemispheres of Figs. 15 and 16; returns the
    files in that order.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, figure in _figures(results):
        path = folder / f"{name}.png"
        figure.savefig(path, dpi=130)
        written.append(path)
    for name, run in (("fig-15-hemisphere-0-90", "hemisphere-0-90"), ("fig-16-hemisphere-45", "hemisphere-45")):
        from weftform.report import write_figures

        drawn = write_figures(results[run])
        path = folder / f"{name}.png"
        shutil.copyfile(drawn[0], path)
        written.append(path)
    return written


def _axes(x: str, y: str, title: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title, fontsize=10, loc="left")
    axes.grid(alpha=0.25)
    return figure, axes


def _figures(results: Results) -> Iterator[tuple[str, Figure]]:
    yield "fig-04-tensile-law", _tensile_law(results)
    yield "fig-06-kinematic-angle", _angles(results)
    yield "fig-08-normalised-shear-force", _shear_force(results)
    yield "fig-09-shear-stress-and-modulus", _modulus(results)
    yield "fig-11-tensile-strip", _strip(results)
    yield "fig-13-bias-extension", _bias(results)
    yield "fig-14-thickness", _thickness(results)
    yield "real-picture-frames", real_frames(results)


def _tensile_law(results: Results) -> Figure:
    figure, axes = _axes("Displacement [mm]", "Force [N]", "Fig. 4: tensile law of a 150 x 50 mm specimen (Eq. 4)")
    u = np.linspace(0.0, 4.4, 300)
    law = results["tensile-warp"].fabric.warp
    axes.plot(u, law.force(u), label="repaired, a4 = -91.645, straight beyond 3.9 mm")
    inside = u <= 3.9
    axes.plot(u[inside], np.polynomial.Polynomial(EQ_4_PRINTED)(u[inside]), "--", label="as printed, a4 = -170.85")
    axes.plot(3.9, 215.47 * 51, "o", color="black", label="Sec. 3.2: 215.47 N x 51 lines")
    axes.set_ylim(-8000, 14000)
    axes.legend()
    return figure


def _angles(results: Results) -> Figure:
    figure, axes = _axes(
        "Displacement [mm]", "Shear angle [deg]", "Figs. 6 and 7: shear angles of the bias test, 150 x 50 mm"
    )
    history = results["bias"].history
    d = history["displacement_mm"]
    axes.plot(d, np.degrees(kinematic_angle(d, HEIGHT, WIDTH)), "k--", label="kinematic angle, Eq. 2")
    for zone in "bca":
        axes.plot(d, history[f"shear_angle_zone_{zone}_deg"], label=f"computed, mean of zone {zone.upper()}")
    axes.plot(d, history["shear_angle_centre_deg"], ":", label="computed, centre")
    axes.plot([15, 15], [20, 8], "o", color="black", label="measured at 15 mm, zones B and C (Sec. 2.4.2)")
    axes.legend()
    return figure


def _shear_force(results: Results) -> Figure:
    figure, axes = _axes("Shear angle [deg]", "Normalised shear force [N/mm]", "Fig. 8: normalised shear force (Eq. 8)")
    angle = np.linspace(0.0, 45.0, 300)
    axes.plot(angle, results["bias"].fabric.normalised_shear_force(np.radians(angle)), label="Eq. 8")
    frame = results["picture-frame"].history
    axes.plot(
        frame["shear_angle_frame_deg"][::6],
        frame["normalised_shear_force_N_per_mm"][::6],
        "o",
        ms=4,
        label="computed picture frame",
    )
    axes.axvline(38.0, color="grey", lw=0.8, ls=":", label="locking angle of the paper, 38 deg")
    axes.legend()
    return figure


def _modulus(results: Results) -> Figure:
    figure, axes = _axes(
        "Shear angle [rad]", "Stress, modulus [MPa]", "Fig. 9: shear stress, modulus and normalised force"
    )
    angle = np.linspace(0.0, 0.75, 300)
    fabric = results["bias"].fabric
    lines = axes.plot(angle, fabric.shear.shear_stress(angle), label="shear stress tau (Eq. 9)")
    lines += axes.plot(angle, fabric.shear.modulus(angle), label="shear modulus G12 (Eq. 10)")
    right = axes.twinx()
    right.set_ylabel("Normalised shear force [N/mm]")
    lines += right.plot(
        angle, fabric.normalised_shear_force(angle), "--", color="black", label="F_sh (Eq. 8), right scale"
    )
    axes.legend(handles=lines)
    return figure


def _strip(results: Results) -> Figure:
    figure, axes = _axes("Displacement [mm]", "Force [N]", "Fig. 11: tensile strip 150 x 50 mm along the warp")
    law = results["tensile-warp"].fabric.warp
    u = np.linspace(0.0, 3.9, 200)
    axes.plot(u, law.force(u), color="black", lw=1, label="repaired Eq. 4")
    for run, marker in (("tensile-1", "o"), ("tensile-2.5", "s"), ("tensile-5", "^")):
        history = results[run].history
        every = max(len(history["force_N"]) // 14, 1)
        axes.plot(
            history["displacement_mm"][::every],
            history["force_N"][::every],
            marker,
            ms=5,
            mfc="none",
            label=f"computed, cells of {results[run].grid.warp_pitch:.3g} mm",
        )
    axes.legend()
    return figure


def _bias(results: Results) -> Figure:
    figure, axes = _axes("Displacement [mm]", "Force [N]", "Fig. 13: bias-extension test 150 x 50 mm")
    bias, constant = results["bias"], results["bias-constant"]
    d = np.linspace(0.1, 38.0, 200)
    closed = bias_force(kinematic_angle(d, HEIGHT, WIDTH), bias.fabric.card.shear.coefficients or [], HEIGHT, WIDTH)
    axes.plot(d, closed, "k--", lw=1, label="three uniform zones, Eq. 8")
    axes.plot(bias.history["displacement_mm"], bias.history["force_N"], label="computed, non-linear G12 (Eq. 10)")
    axes.plot(
        constant.history["displacement_mm"], constant.history["force_N"], label="computed, constant G12 (Table 4)"
    )
    axes.axvline(21.0, color="grey", lw=0.8, ls=":", label="slip begins in the experiment, 21 mm")
    axes.set_xlim(0, 40)
    axes.set_ylim(0, 12)
    axes.legend()
    return figure


def _thickness(results: Results) -> Figure:
    figure, axes = _axes(
        "Kinematic shear angle [deg]", "Normalised shear force [N/mm]", "Fig. 14: F_sh by Eq. 5 from computed forces"
    )
    angle = np.linspace(0.0, 26.0, 200)
    axes.plot(angle, results["bias"].fabric.normalised_shear_force(np.radians(angle)), color="black", label="Eq. 8")
    for run, marker in (("bias-middle", "o"), ("bias-e0.01", "s"), ("bias-e0.1", "^"), ("bias-e1", "x")):
        found = results[run].summary["normalised_shear_force"]
        axes.plot(
            found["shear_angle_deg"][4::6],
            found["from_eq_5_N_per_mm"][4::6],
            marker,
            ms=5,
            mfc="none",
            label=f"e = {results[run].fabric.thickness:g} mm",
        )
    axes.legend()
    return figure


def real_frames(results: Results) -> Figure:
    """Measured tables of Cao et al. (2008) and the virtual frames run with their cards, one panel per laboratory."""
    tables = frame_tables()
    figure = Figure(figsize=(9.6, 5.4), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, (len(tables) + 1) // 2, sharex=True, sharey=True).ravel()
    for axes, table in zip(panels, tables, strict=False):
        axes.plot(table.angle, table.force, "o", ms=3.5, mfc="none", color="0.45", label="measured")
        axes.plot(*virtual_curve(results[f"frame-{table.laboratory}"]), color="#0057b8", lw=1.6, label="virtual test")
        axes.set_title(table.laboratory, fontsize=10, loc="left")
        axes.grid(alpha=0.25)
    handles, labels = panels[0].get_legend_handles_labels()
    for axes in panels[len(tables) :]:
        axes.axis("off")
        panels[len(panels) // 2 - 1].tick_params(labelbottom=True)  # the axis of the panel above
        axes.legend(handles, labels, loc="center", frameon=False)
    figure.supxlabel("Shear angle [deg]", fontsize=10)
    figure.supylabel("Normalised shear force [N/mm]", fontsize=10)
    figure.suptitle(
        "Picture frames of Cao et al. (2008): the tables, and virtual frames with cards made from them", fontsize=10
    )
    return figure
