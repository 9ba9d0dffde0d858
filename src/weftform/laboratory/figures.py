"""Figures of the characterisation, after Figs. 4 to 9 of the paper."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from weftform.fabric.laws import Floats
from weftform.laboratory.bias_extension import BiasExtensionCharacterisation
from weftform.laboratory.fitting import Band
from weftform.laboratory.full_field import ShearField
from weftform.laboratory.kinematics import kinematic_angle, kinematic_limit
from weftform.laboratory.picture_frame import PictureFrameCharacterisation
from weftform.laboratory.shear import ShearCurve
from weftform.laboratory.specimen import Specimen
from weftform.laboratory.tensile import TensileCharacterisation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED, MEAN, LAW, SECOND, THIRD = "0.6", "0.15", "#0057b8", "#c8102e", "#1b7f3b"


def draw_shear_field(field: ShearField, file: Path, source: str) -> Path:
    """Map of the shear angle on the undeformed specimen, from a full-field measurement; returns the file."""
    from matplotlib.collections import PolyCollection

    size = np.ptp(field.corners.reshape(-1, 2), axis=0)
    figure, axes = _page(
        "x (mm)",
        "y (mm)",
        f"Shear angle from the displacements of {source}, drawn on the undeformed cloth: {len(field.angle)} triangles, mean "
        f"{field.angle.mean():.2f} deg, standard deviation {field.angle.std():.2f} deg.",
    )
    low, high = np.percentile(field.angle, [1.0, 99.0])
    if high - low < 1.0:  # a uniform field: noise is not blown up to all colours
        low, high = 0.5 * (low + high) - 0.5, 0.5 * (low + high) + 0.5
    cells = PolyCollection(list(field.corners), array=field.angle, cmap="viridis", edgecolors="face", linewidths=0.2)
    cells.set_clim(low, high)
    axes.add_collection(cells)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.grid(False)
    bar = figure.colorbar(cells, ax=axes, extend="both", shrink=0.9 if size[1] >= size[0] else 0.6)
    bar.set_label("Shear angle (deg)")
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file)
    return file


def draw_tensile(found: TensileCharacterisation, folder: Path) -> list[Path]:
    """Force against elongation with the stages and the law (Fig. 4); returns the files."""
    figure, axes = _page(
        "Elongation (mm)",
        "Force (N)",
        f"Tensile test along the {found.direction}, {_count(found.specimens)}, {found.length:g} x "
        f"{found.width:g} mm. "
        f"Stages: crimp to {found.stages.crimp_end:.2f} mm, linear to {found.stages.linear_end:.2f} mm "
        f"(straight within "
        f"{found.stages.tolerance:.0f} N){', then damage' if found.stages.damage else ''}. "
        f"Law over {found.interval[0]:.2f}-{found.interval[1]:.2f} mm, rms {found.fit.rms:.0f} N.",
    )
    _specimens(axes, found.specimens)
    _mean(axes, found.mean.x, found.mean.mean, found.mean.deviation)
    u = np.linspace(0.0, found.interval[1], 200)
    axes.plot(u, found.law.value(u), color=LAW, lw=2, label="law")
    _shade(axes, u, found.force_band(u))
    for place, name in ((found.stages.crimp_end, "crimp"), (found.stages.linear_end, "linear")):
        axes.axvline(place, color=SECOND, lw=0.9, ls=":")
        axes.text(
            place,
            0.02,
            f"{name} ends ",
            rotation=90,
            ha="right",
            va="bottom",
            color=SECOND,
            fontsize=8,
            transform=axes.get_xaxis_transform(),
        )
    return [_save(figure, axes, folder / f"tensile-{found.direction}.png")]


def draw_bias_extension(found: BiasExtensionCharacterisation, folder: Path) -> list[Path]:
    """Force, angles, zones, normalised shear force and moduli (Figs. 5 to 9); returns the files."""
    size = f"{found.height:g} x {found.width:g} mm"
    files = []
    figure, axes = _page(
        "Displacement (mm)",
        "Force (N)",
        f"Bias-extension test, {_count(found.specimens)}, {size}. The law is Eq. 8 put back through Eq. 5 "
        f"at the "
        f"{found.angle_source} shear angle, fitted over "
        f"{found.interval_deg[0]:.3g}-{found.interval_deg[1]:.3g} degrees.",
    )
    _specimens(axes, found.specimens)
    _mean(axes, found.mean.x, found.mean.mean, found.mean.deviation)
    d, angle = _path(found)
    axes.plot(d, found.force(angle), color=LAW, lw=2, label="law")
    files.append(_save(figure, axes, folder / "bias-extension-force.png"))
    files.append(_angles(found, folder))
    if found.tracking:
        files.append(_zones(found, folder))
    caption = f"bias-extension test, {_count(found.specimens)}, {size}, {found.angle_source} angle"
    return [*files, *_shear(found.shear, caption, folder, "bias-extension")]


def draw_picture_frame(found: PictureFrameCharacterisation, folder: Path) -> list[Path]:
    """Normalised shear force with the measured points, and the moduli (Figs. 8 and 9); returns the files."""
    caption = (
        f"picture-frame test, {_count(found.specimens)}, frame side {found.frame_side:g} mm, "
        f"fabric side {found.fabric_side:g} mm"
    )

    def measured(axes: Axes) -> None:
        for k, curve in enumerate(found.curves):
            axes.plot(curve.x, curve.y, "o", ms=3, mfc="none", color="0.45", label="measured" if k == 0 else None)
        if len(found.curves) > 1:
            _mean(axes, found.mean.x, found.mean.mean, found.mean.deviation)

    return _shear(found.shear, caption, folder, "picture-frame", measured)


def _angles(found: BiasExtensionCharacterisation, folder: Path) -> Path:
    words = "No angle was measured, so slip cannot be seen."
    if found.slip is not None:
        words = "No slip found: the measured angle follows the kinematic one."
        if found.slip.displacement is not None and found.slip.interval is not None:
            words = (
                f"Slip from {found.slip.displacement:.2f} mm (95 % interval {found.slip.interval[0]:.2f}-"
                f"{found.slip.interval[1]:.2f} mm, {found.slip.angle_deg:.3g} degrees)."
            )
    figure, axes = _page(
        "Displacement (mm)",
        "Shear angle of zone B (deg)",
        f"Kinematic (Eqs. 1-2) and measured shear angle. {words}",
    )
    end = min(kinematic_limit(found.height, found.width), 1.02 * float(found.mean.x[-1]))
    d = np.linspace(0.0, end, 300)
    axes.plot(d, np.degrees(kinematic_angle(d, found.height, found.width)), color=LAW, lw=2, label="kinematic")
    if found.measured is not None:
        axes.plot(*found.measured, "o", ms=3.5, color=SECOND, label="measured")
    if found.angle_curve is not None:
        d = np.linspace(0.0, float(found.angle_curve.displacement[-1]), 400)
        axes.plot(d, np.degrees(found.angle_curve.at(d)), color=THIRD, lw=1.4, label="used for the law")
    if found.slip is not None and found.slip.displacement is not None and found.slip.interval is not None:
        axes.axvspan(*found.slip.interval, color="0.85", label="onset of slip, 95 %")
        axes.axvline(found.slip.displacement, color=MEAN, lw=0.9, ls=":")
    return _save(figure, axes, folder / "bias-extension-angles.png")


def _zones(found: BiasExtensionCharacterisation, folder: Path) -> Path:
    figure, axes = _page(
        "Displacement (mm)",
        "Shear angle (deg)",
        "Shear angles of marker quadruples: mean of each zone with one standard deviation between "
        "quadruples; "
        "triangles up and down are the upper and lower half of the specimen.",
    )
    tracking = found.tracking[0]
    for zone, colour in zip(tracking.zones(), (LAW, SECOND, THIRD), strict=False):
        whole = tracking.zone(zone)
        axes.plot(tracking.displacement, whole.mean, color=colour, lw=1.6, label=f"zone {zone}")
        low, high = whole.mean - whole.deviation, whole.mean + whole.deviation
        axes.fill_between(tracking.displacement, low, high, color=colour, alpha=0.18, lw=0)
        for half, mark in (("upper", "^"), ("lower", "v")):
            if any(q.zone == zone and q.half == half for q in tracking.quadruples):
                values = tracking.zone(zone, half).mean  # type: ignore[arg-type]
                axes.plot(tracking.displacement, values, mark, ms=3, mfc="none", color=colour, lw=0)
    return _save(figure, axes, folder / "bias-extension-zones.png")


def _shear(
    shear: ShearCurve, caption: str, folder: Path, stem: str, measured: Callable[[Axes], None] | None = None
) -> list[Path]:
    angle = np.linspace(0.0, shear.valid_to, 300)
    degrees = np.degrees(angle)
    stages = shear.stages
    locking = f"locking at {stages.locking_deg:.3g} degrees" if stages.locking_deg is not None else "no locking reached"
    figure, axes = _page(
        "Shear angle (deg)",
        "Normalised shear force (N/mm)",
        f"Normalised shear force from a {caption}. Placing to {stages.placing_end_deg:.3g} degrees, "
        f"{locking} "
        f"({stages.criterion}).",
    )
    if measured is not None:
        measured(axes)
    axes.plot(degrees, shear.normalised_force(angle), color=LAW, lw=2, label="law")
    _shade(axes, degrees, shear.force_band(angle))
    axes.axvline(stages.placing_end_deg, color=SECOND, lw=0.9, ls=":", label="end of placing")
    if stages.locking_deg is not None:
        axes.axvline(stages.locking_deg, color=SECOND, lw=0.9, ls="--", label="locking angle")
    files = [_save(figure, axes, folder / f"{stem}-shear-force.png")]
    figure, axes = _page(
        "Shear angle (rad)",
        "Shear stress, shear modulus (MPa)",
        f"Shear stress (Eq. 9), shear modulus (Eq. 10) and normalised shear force (Eq. 8, right axis) from "
        f"a {caption}, "
        f"thickness {shear.thickness:g} mm.",
    )
    axes.plot(angle, shear.stress(angle), color=LAW, lw=2, label="shear stress (left)")
    axes.plot(angle, shear.modulus(angle), color=SECOND, lw=2, label="shear modulus (left)")
    _shade(axes, angle, shear.modulus_band(angle), SECOND, "modulus")
    right = axes.twinx()
    right.plot(
        angle,
        shear.normalised_force(angle),
        color=THIRD,
        lw=2,
        ls="--",
        label="normalised shear force (right)",
    )
    right.set_ylabel("Normalised shear force (N/mm)")
    right.set_ylim(bottom=0.0)
    files.append(_save(figure, axes, folder / f"{stem}-moduli.png", right))
    return files


def _path(found: BiasExtensionCharacterisation) -> tuple[Floats, Floats]:
    """Displacements [mm] and the angles [rad] of the law there."""
    end = np.radians(found.interval_deg[1])
    if found.angle_curve is None or found.measured is None:
        d = np.linspace(0.0, min(float(found.mean.x[-1]), kinematic_limit(found.height, found.width)), 400)
        angle = kinematic_angle(d, found.height, found.width)
    else:
        d = np.linspace(0.0, min(float(found.mean.x[-1]), float(found.measured[0][-1])), 400)
        angle = found.angle_curve.at(d)
    used = angle <= end
    return d[used], angle[used]


def _count(specimens: Sequence[Specimen]) -> str:
    return f"{len(specimens)} specimen" + ("s" if len(specimens) > 1 else "")


def _page(x: str, y: str, caption: str) -> tuple[Figure, Axes]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 5.0), dpi=130)
    FigureCanvasAgg(figure)
    lines = textwrap.wrap(caption, 98)
    axes = figure.add_axes((0.125, 0.16 + 0.034 * len(lines), 0.75, 0.81 - 0.034 * len(lines)))
    figure.text(0.5, 0.02, "\n".join(lines), ha="center", va="bottom", fontsize=8, color="0.25")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(alpha=0.25)
    return figure, axes


def _specimens(axes: Axes, specimens: Sequence[Specimen]) -> None:
    for k, s in enumerate(specimens):
        axes.plot(s.x, s.y, color=MEASURED, lw=0.8, label="specimens" if k == 0 else None)


def _mean(axes: Axes, x: Floats, mean: Floats, deviation: Floats) -> None:
    axes.plot(x, mean, color=MEAN, lw=1.2, ls="--", label="mean")
    if np.isfinite(deviation).all():
        axes.fill_between(
            x, mean - deviation, mean + deviation, color="0.5", alpha=0.25, lw=0, label="one std. deviation"
        )


def _shade(axes: Axes, x: Floats, band: Band | None, colour: str = LAW, what: str = "law") -> None:
    if band is not None:
        axes.fill_between(x, band.lower, band.upper, color=colour, alpha=0.2, lw=0, label="95 % band of the law")


def _save(figure: Figure, axes: Axes, path: Path, right: Any = None) -> Path:
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]) if axes.get_ylim()[0] < -0.05 * axes.get_ylim()[1] else 0.0)
    handles, labels = axes.get_legend_handles_labels()
    if right is not None:
        more = right.get_legend_handles_labels()
        handles, labels = handles + more[0], labels + more[1]
    axes.legend(handles, labels, fontsize=8, loc="upper left", framealpha=0.9)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    return path
