"""Bias-extension test: from specimens to the shear law (Secs. 2.3, 2.4.2, 2.4.3; Eqs. 1, 2, 5 to 10)."""

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
from weftform.laboratory.kinematics import (
    bias_design,
    check_bias_specimen,
    kinematic_angle,
    kinematic_displacement,
    kinematic_limit,
)
from weftform.laboratory.markers import MarkerTracking
from weftform.laboratory.measured_angle import MeasuredAngle, measured_angles, slip_in_bias
from weftform.laboratory.monotone import power_basis
from weftform.laboratory.presets import Quantity
from weftform.laboratory.shear import ShearCurve
from weftform.laboratory.slip import SlipOnset
from weftform.laboratory.specimen import Reading, Specimen, read_specimens
from weftform.laboratory.stages import LockingCriterion, shear_stages
from weftform.laboratory.tabulating import TableFit, fit_table
from weftform.laboratory.tensile import LawKind, fit_warnings

AngleSource = Literal["auto", "kinematic", "measured"]
LEAST_TRAVEL_DEG = 1.0
"""Kinematic angle that a bias-extension test reaches at least; one that ends before was read in wrong units."""
ANGLE_DRAWS = 30
"""Times that a measured angle is drawn again from its noise, to see what it does to the law."""
LARGEST_KINEMATIC_DEG = 60.0
"""Kinematic angle beyond which nothing is fitted unless asked for: yarns slip or the cloth folds long
before."""


@dataclass(frozen=True, eq=False)
class BiasExtensionCharacterisation:
    """What the bias-extension tests say.

    Attributes
    ----------
    height, width
        Free height between the clamps and width of the specimens [mm].
    specimens, mean
        The curves of force [N] against displacement [mm], and their mean with its scatter.
    tracking
        Marker measurements, if any.
    measured
        Displacements [mm] and measured angles of zone B [deg], two arrays of one shape; None without
        measurement.
    slip
        Onset of slip; None without measured angles.
    angle_curve
        The smooth measured angle that the law uses; None for the kinematic angle.
    angle_source
        ``kinematic`` or ``measured``: the angle of the law.
    interval_deg
        Shear angles used for the law.
    shear
        The law with tau, G12, stages and bands.
    warnings
        What was done to the measurements and the fit.
    """

    height: float
    width: float
    specimens: tuple[Specimen, ...]
    mean: MeanCurve
    tracking: tuple[MarkerTracking, ...]
    measured: tuple[Floats, Floats] | None
    slip: SlipOnset | None
    angle_curve: MeasuredAngle | None
    angle_source: Literal["kinematic", "measured"]
    interval_deg: tuple[float, float]
    shear: ShearCurve
    warnings: tuple[str, ...]

    def force(self, angle: Floats) -> Floats:
        """Force of the test [N] that the law gives at shear angles of zone B [rad] (Eq. 5)."""
        law = self.shear.law
        return bias_design(np.asarray(angle, float), self.height, self.width, lambda g: law.value(g)[:, None])[:, 0]

    def card_table(self) -> dict[str, Any]:
        """The table ``shear`` of a fabric card."""
        n = len(self.specimens)
        return self.shear.card_table(
            f"Bias-extension tests of {n} specimen{'s' if n > 1 else ''} {self.height:g} x {self.width:g} "
            f"mm, "
            f"{self.angle_source} angle, Eq. 5; see provenance"
        )


def characterise_bias_extension(
    files: Sequence[Path | str],
    *,
    height: float,
    width: float,
    thickness: float,
    tracking: Sequence[MarkerTracking] = (),
    angle: AngleSource = "auto",
    law: LawKind = "polynomial",
    degree: int = 5,
    interval_deg: tuple[float, float] | None = None,
    monotone: bool = True,
    weighting: Weighting = "uniform",
    knots: int = 24,
    locking: LockingCriterion = LockingCriterion.BROKEN_LINE,
    reading: Reading = Reading(),  # noqa: B008 (frozen)
) -> BiasExtensionCharacterisation:
    """From the files of the machine, and of the cameras where there are some, to a shear law.

    Parameters
    ----------
    files
        Force against displacement, one or several specimens each; a column ``shear_angle_deg`` counts as
        measured angle.
    height, width
        Of the specimens [mm]; the height is the free length between the clamps.
    thickness
        Of the fabric [mm].
    tracking
        Marker measurements; the mean of zone B is the measured angle.
    angle
        ``kinematic`` (Eqs. 1-2), ``measured``, or ``auto``: measured where slip is found, kinematic
        otherwise.
    law, degree, knots
        Polynomial of that degree (Eq. 8 has 5), or a table.
    interval_deg
        Shear angles on which the law is fitted. By default from zero to the peak of the force; with the
        kinematic angle no further than the onset of slip, nor than 60 degrees.
    monotone
        Impose a rising F_sh, that is G12 >= 0.
    weighting
        Errors of one size, or in proportion to the force.
    locking
        Criterion of the locking angle.

    Raises
    ------
    MeasurementError
        Height / width < 2, a file or curve cannot be used, ``measured`` without measured angles, or no fit.

    Examples
    --------
    >>> from weftform.laboratory import characterise_bias_extension, sample
    >>> found = characterise_bias_extension(sample("bias-extension"), height=150, width=50, thickness=0.62)
    >>> found.shear.modulus_positive
    True
    """
    check_bias_specimen(height, width)
    if not (np.isfinite(thickness) and thickness > 0.0):
        raise MeasurementError("the thickness must be positive", expected="mm > 0", got=f"{thickness:g}")
    if law == "polynomial" and not 1 <= degree <= 12:
        raise MeasurementError("no such degree", expected="1 to 12", got=str(degree))
    specimens = read_specimens(files, Quantity.DISPLACEMENT, Quantity.FORCE, reading, angle=True)
    warnings = [w for s in specimens for w in s.warnings] + [w for t in tracking for w in t.warnings]
    _check_travel(specimens, height, width)
    mean = average(specimens)
    measured = measured_angles(specimens, tracking)
    slip = None if measured is None else slip_in_bias(*measured, height, width)
    source: Literal["kinematic", "measured"]
    if angle == "auto":
        source = "measured" if slip is not None and slip.found else "kinematic"
    else:
        source = angle
    if source == "measured" and measured is None:
        raise MeasurementError(
            "no measured angle",
            expected="marker files, or a column shear_angle_deg",
            hint="use the kinematic angle",
        )
    curve = None
    if source == "measured" and measured is not None and slip is not None:
        curve = MeasuredAngle.of(*measured, height, width, slip)
    limit = kinematic_limit(height, width)
    beyond = [s.name for s in specimens if s.x[-1] >= limit]
    if curve is None and beyond:
        warnings.append(
            f"{', '.join(beyond)}: displacements beyond {limit:.4g} mm, where yarns without slip would be "
            f"parallel, have no "
            "kinematic angle and are left out"
        )
    start, end = interval_deg or (0.0, _end_of_interval(mean, curve, slip, height, width, warnings))
    if not 0.0 <= start < end < 90.0:
        raise MeasurementError(
            "the interval is empty or too wide",
            expected="0 <= start < end < 90 deg",
            got=f"{start:g}-{end:g}",
        )

    def angles(s: Specimen) -> Floats:
        if curve is not None:
            return curve.at(s.x)
        return np.where(s.x < limit, kinematic_angle(s.x, height, width), np.nan)

    used: list[np.ndarray] = []
    xs: list[Floats] = []
    ys: list[Floats] = []
    for s in specimens:
        g = angles(s)
        ok = np.isfinite(g) & (g >= np.radians(start)) & (g <= np.radians(end) * (1.0 + 1e-12))
        if ok.sum() > 1:
            used.append(s.x[ok])
            xs.append(g[ok])
            ys.append(s.y[ok])
    if not xs:
        raise MeasurementError("no points in the interval", expected=f"shear angles in {start:.4g}-{end:.4g} deg")
    reached = max(float(g.max()) for g in xs)
    if np.degrees(reached) < end:
        if interval_deg is not None and np.degrees(reached) < 0.98 * end:
            warnings.append(
                f"the interval asked for ends at {end:.4g} deg, the measurements at {np.degrees(reached):.4g}"
            )
        end = float(np.degrees(reached))
    again: list[list[Floats]] = []
    if curve is not None and law == "polynomial":
        rng = np.random.default_rng(0)
        for _ in range(ANGLE_DRAWS):
            drawn = np.nan_to_num(curve.drawn_again(rng).at(np.concatenate(used)))
            again.append(np.split(drawn, np.cumsum([len(d) for d in used])[:-1]))
    fit = _fit(xs, ys, again, height, width, reached, law, degree, monotone, weighting, knots)
    if isinstance(fit, PolynomialFit):
        warnings += fit_warnings(fit, "deg", "N", 180.0 / np.pi)
    stages = shear_stages(fit.law(), fit.valid_to, criterion=locking)
    shear = ShearCurve(fit, float(thickness), stages)
    if not shear.modulus_positive:
        warnings.append("G12 is negative somewhere in the validity")
    return BiasExtensionCharacterisation(
        height=float(height),
        width=float(width),
        specimens=specimens,
        mean=mean,
        tracking=tuple(tracking),
        measured=measured,
        slip=slip,
        angle_curve=curve,
        angle_source=source,
        interval_deg=(float(start), float(end)),
        shear=shear,
        warnings=tuple(warnings),
    )


def _fit(
    xs: list[Floats],
    ys: list[Floats],
    again: list[list[Floats]],
    height: float,
    width: float,
    end: float,
    law: LawKind,
    degree: int,
    monotone: bool,
    weighting: Weighting,
    knots: int,
) -> PolynomialFit | TableFit:
    def design(g: Floats, basis: Callable[[Floats], Floats]) -> Floats:
        return bias_design(g, height, width, basis)

    if law == "tabulated":
        return fit_table(xs, ys, design, end, knots=knots)
    powers = list(range(1, degree + 1))

    def powers_of(angles: list[Floats]) -> list[Floats]:
        return [design(g, lambda v: power_basis(v, powers)) for g in angles]

    return fit_polynomial(
        powers_of(xs),
        ys,
        powers,
        end,
        monotone=monotone,
        weighting=weighting,
        designs_again=[powers_of(angles) for angles in again],
    )


def _check_travel(specimens: Sequence[Specimen], height: float, width: float) -> None:
    """A bias specimen is pulled by more than nothing, and not to twice the length at which its yarns are parallel."""
    most = 2.0 * kinematic_limit(height, width)
    least = float(kinematic_displacement(np.radians(LEAST_TRAVEL_DEG), height, width))
    for s in specimens:
        if s.x[-1] > most:
            raise MeasurementError(
                f"{s.name}: a displacement of {s.x[-1]:.4g} mm is not one of a bias-extension test of "
                f"{height:g} x {width:g} mm",
                file=s.file,
                line=int(s.lines[np.argmax(s.x > most)]),
                expected=f"at most {most:.4g} mm (yarns are parallel at {most / 2:.4g} mm)",
                got=f"{s.x[-1]:.6g} mm",
                hint="are displacement and force swapped, or the units wrong?",
            )
        if s.x[-1] < least:
            raise MeasurementError(
                f"{s.name}: the test ends at {s.x[-1]:.4g} mm, before a bias-extension specimen of {height:g} x {width:g} mm "
                "has sheared at all",
                file=s.file,
                line=int(s.lines[-1]),
                expected=f"at least {least:.3g} mm ({LEAST_TRAVEL_DEG:g} deg)",
                got=f"{s.x[-1]:.6g} mm",
                hint="is the displacement in metres or in inches? --unit displacement=m",
            )


def _end_of_interval(
    mean: MeanCurve,
    curve: MeasuredAngle | None,
    slip: SlipOnset | None,
    height: float,
    width: float,
    warnings: list[str],
) -> float:
    """Shear angle [deg] to which the law is fitted by default; ``curve`` is None for the kinematic angle."""
    peak = int(np.argmax(mean.mean))
    d = float(mean.x[peak])
    if peak < len(mean.x) - 1:
        warnings.append(f"the mean force falls beyond {d:.4g} mm; the law ends there")
    if curve is not None:
        return float(np.degrees(np.nanmax(curve.at(np.linspace(0.0, min(d, float(curve.displacement[-1])), 400)))))
    if slip is not None and slip.displacement is not None and slip.displacement < d:
        d = slip.displacement
        warnings.append(
            f"yarns slip from {d:.4g} mm on ({slip.angle_deg:.3g} deg): the kinematic angle holds no "
            f"further, the law ends "
            "there"
        )
    elif slip is None:
        warnings.append(
            "no measured angle, so slip cannot be seen: the kinematic angle is taken at its word to the end of the law"
        )
    widest = float(kinematic_displacement(np.radians(LARGEST_KINEMATIC_DEG), height, width))
    if d > widest:
        d = widest
        warnings.append(
            f"the law ends at {LARGEST_KINEMATIC_DEG:g} deg of kinematic shear ({d:.4g} mm); --to-deg moves it"
        )
    return float(np.degrees(kinematic_angle(d, height, width)))
