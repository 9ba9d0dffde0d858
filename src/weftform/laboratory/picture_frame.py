"""Picture-frame test: from forces or normalised tables to the shear law."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats
from weftform.laboratory.averaging import MeanCurve, average
from weftform.laboratory.fitting import PolynomialFit, Weighting, fit_polynomial
from weftform.laboratory.kinematics import frame_angle, frame_lever, frame_limit
from weftform.laboratory.monotone import power_basis
from weftform.laboratory.presets import Quantity
from weftform.laboratory.shear import ShearCurve
from weftform.laboratory.specimen import Reading, Specimen, read_specimens
from weftform.laboratory.stages import LockingCriterion, shear_stages
from weftform.laboratory.tabulating import TableFit, fit_table
from weftform.laboratory.tensile import LawKind, fit_warnings

Measured = Literal["force-displacement", "force-angle", "normalised"]
_COLUMNS = {
    "force-displacement": (Quantity.DISPLACEMENT, Quantity.FORCE),
    "force-angle": (Quantity.SHEAR_ANGLE, Quantity.FORCE),
    "normalised": (Quantity.SHEAR_ANGLE, Quantity.NORMALISED_SHEAR_FORCE),
}


@dataclass(frozen=True, eq=False)
class PictureFrameCharacterisation:
    """What the picture-frame tests say.

    Attributes
    ----------
    frame_side, fabric_side
        Between the hinges, and of the sheared cloth [mm].
    measured
        What the files held.
    specimens, curves
        The curves as measured, and normalised: F_sh [N/mm] against shear angle [deg].
    mean
        Mean of F_sh [N/mm] against shear angle [deg], with its scatter.
    interval_deg
        Shear angles used for the law.
    shear
        The law with tau, G12, stages and bands.
    warnings
        What was done to the measurements and the fit.
    """

    frame_side: float
    fabric_side: float
    measured: Measured
    specimens: tuple[Specimen, ...]
    curves: tuple[Specimen, ...]
    mean: MeanCurve
    interval_deg: tuple[float, float]
    shear: ShearCurve
    warnings: tuple[str, ...]

    def force(self, angle: Floats) -> Floats:
        """Force at the crosshead [N] that the law gives at shear angles [rad]."""
        g = np.asarray(angle, float)
        return frame_lever(g, self.frame_side, self.fabric_side) * self.shear.law.value(g)

    def card_table(self) -> dict[str, Any]:
        """The table ``shear`` of a fabric card."""
        n = len(self.specimens)
        return self.shear.card_table(
            f"Picture-frame tests of {n} specimen{'s' if n > 1 else ''} "
            f"({', '.join(s.name for s in self.specimens)}), "
            "constant-thickness normalisation; see provenance"
        )


def characterise_picture_frame(
    files: Sequence[Path | str],
    *,
    frame_side: float,
    fabric_side: float,
    thickness: float,
    measured: Measured | Literal["auto"] = "auto",
    law: LawKind = "tabulated",
    degree: int = 5,
    interval_deg: tuple[float, float] | None = None,
    monotone: bool = True,
    weighting: Weighting = "uniform",
    knots: int = 24,
    locking: LockingCriterion = LockingCriterion.BROKEN_LINE,
    reading: Reading = Reading(),  # noqa: B008 (frozen)
) -> PictureFrameCharacterisation:
    """From force against displacement or angle, or from an already normalised table, to a shear law.

    Parameters
    ----------
    files
        One or several specimens each.
    frame_side, fabric_side
        Side of the frame between its hinges and side of the sheared cloth [mm].
    thickness
        Of the fabric [mm].
    measured
        What the files hold; ``auto`` takes normalised forces where there are some, else the angle where
        there is one.
    law, degree, knots
        A table (the default: friction of the frame makes no polynomial), or a polynomial.
    interval_deg
        Shear angles on which the law is fitted; by default all that every specimen covers, to the largest
        force.
    monotone, weighting, locking, reading
        As in :func:`weftform.laboratory.bias_extension.characterise_bias_extension`.

    Raises
    ------
    MeasurementError
        Sizes that make no frame, a file or curve that cannot be used, or no fit.

    References
    ----------
    Cao et al. (2008), Composites Part A 39:1037-1053: F_sh = F / (2 cos(pi/4 - gamma/2)) * L_frame /
    L_fabric^2.
    """
    if not (np.isfinite(frame_side) and np.isfinite(fabric_side) and 0.0 < fabric_side <= frame_side):
        raise MeasurementError(
            "these sizes make no picture frame",
            expected="0 < fabric side <= frame side [mm]",
            got=f"frame {frame_side:g}, fabric {fabric_side:g}",
        )
    if not (np.isfinite(thickness) and thickness > 0.0):
        raise MeasurementError("the thickness must be positive", expected="mm > 0", got=f"{thickness:g}")
    if law == "polynomial" and not 1 <= degree <= 12:
        raise MeasurementError("no such degree", expected="1 to 12", got=str(degree))
    kind, specimens = _read(files, measured, reading)
    warnings = [w for s in specimens for w in s.warnings]
    curves = [_normalised(s, kind, frame_side, fabric_side) for s in specimens]
    mean = average(curves)
    peak = int(np.argmax(mean.mean))
    if interval_deg is None:
        # the mean is known on a grid, and its peak may lie anywhere up to the next place
        start, end = 0.0, float(mean.x[min(peak + 1, len(mean.x) - 1)])
        falls = peak < len(mean.x) - 2
        if not falls and max(float(s.x[-1]) for s in curves) > 1.02 * end:
            warnings.append(f"not every specimen goes beyond {end:.4g} deg; the law ends there (--to-deg moves it)")
    else:
        falls = False
        start, end = interval_deg
    if not 0.0 <= start < end < 90.0:
        raise MeasurementError(
            "the interval is empty or too wide",
            expected="0 <= start < end < 90 deg",
            got=f"{start:g}-{end:g}",
        )
    xs: list[Floats] = []
    ys: list[Floats] = []
    for s, curve in zip(specimens, curves, strict=True):
        used = (curve.x >= start) & (curve.x <= end * (1.0 + 1e-12))
        if used.sum() > 1:
            xs.append(np.radians(curve.x[used]))
            ys.append(curve.y[used] if kind == "normalised" else s.y[used])
    if not xs:
        raise MeasurementError("no points in the interval", expected=f"shear angles in {start:.4g}-{end:.4g} deg")
    reached = max(float(g.max()) for g in xs)
    end = min(end, float(np.degrees(reached)))
    if falls:
        warnings.append(f"the mean force falls beyond {end:.4g} deg; the law ends there")

    def design(g: Floats, basis: Callable[[Floats], Floats]) -> Floats:
        factor = np.ones(len(g)) if kind == "normalised" else frame_lever(g, frame_side, fabric_side)
        return factor[:, None] * basis(g)

    fit: PolynomialFit | TableFit
    if law == "tabulated":
        fit = fit_table(xs, ys, design, reached, knots=knots)
    else:
        powers = list(range(1, degree + 1))
        designs = [design(g, lambda v: power_basis(v, powers)) for g in xs]
        fit = fit_polynomial(designs, ys, powers, reached, monotone=monotone, weighting=weighting)
        warnings += fit_warnings(fit, "deg", "N/mm" if kind == "normalised" else "N", 180.0 / np.pi)
    shear = ShearCurve(fit, float(thickness), shear_stages(fit.law(), fit.valid_to, criterion=locking))
    return PictureFrameCharacterisation(
        float(frame_side),
        float(fabric_side),
        kind,
        specimens,
        tuple(curves),
        mean,
        (float(start), float(end)),
        shear,
        tuple(warnings),
    )


def _read(
    files: Sequence[Path | str], measured: Measured | Literal["auto"], reading: Reading
) -> tuple[Measured, tuple[Specimen, ...]]:
    if measured != "auto":
        return measured, read_specimens(files, *_COLUMNS[measured], reading)
    kinds: tuple[Measured, ...] = ("normalised", "force-angle", "force-displacement")
    for kind in kinds[:-1]:
        try:
            return kind, read_specimens(files, *_COLUMNS[kind], reading)
        except MeasurementError as problem:
            if not problem.message.startswith("no column for"):
                raise
    return kinds[-1], read_specimens(files, *_COLUMNS[kinds[-1]], reading)


def _normalised(s: Specimen, kind: Measured, frame_side: float, fabric_side: float) -> Specimen:
    """The specimen as F_sh [N/mm] against shear angle [deg]."""
    if kind == "normalised":
        angle, force = s.x, s.y
    elif kind == "force-angle":
        angle = s.x
        force = s.y / frame_lever(np.radians(angle), frame_side, fabric_side)
    else:
        limit = frame_limit(frame_side)
        if s.x[-1] >= limit:
            raise MeasurementError(
                f"{s.name}: a frame with sides of {frame_side:g} mm is closed at {limit:.4g} mm",
                file=s.file,
                line=int(s.lines[np.argmax(s.x >= limit)]),
                expected=f"less than {limit:.4g} mm",
                got=f"{s.x[-1]:.6g} mm",
                hint="is the frame side right, are displacement and force swapped?",
            )
        radians = frame_angle(s.x, frame_side)
        angle, force = np.degrees(radians), s.y / frame_lever(radians, frame_side, fabric_side)
    if angle[-1] >= 90.0:
        raise MeasurementError(
            f"{s.name}: a shear angle of {angle[-1]:.4g} degrees",
            file=s.file,
            line=int(s.lines[np.argmax(angle >= 90.0)]),
            expected="less than 90 degrees",
            hint="are angle and force swapped, or the angles in other units?",
        )
    return Specimen(s.name, s.file, s.sha256, angle, force, s.lines, None, s.warnings)
