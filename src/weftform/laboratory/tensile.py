"""Tensile tests along the yarns: from specimens to the tension law of a direction (Sec. 2.2, 2.4.1, Eqs. 3,
4 and 11)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.fabric import Direction
from weftform.fabric.laws import Floats, Law, first_fall
from weftform.laboratory.averaging import MeanCurve, average
from weftform.laboratory.fitting import Band, PolynomialFit, Weighting, fit_polynomial
from weftform.laboratory.monotone import power_basis
from weftform.laboratory.presets import Quantity
from weftform.laboratory.scatter import point_scatter
from weftform.laboratory.specimen import Reading, Specimen, read_specimens
from weftform.laboratory.stages import TensileStages, tensile_stages
from weftform.laboratory.tabulating import TableFit, fit_table

LawKind = Literal["polynomial", "tabulated"]
LEAST_STRAIN = 1e-4
"""Elongation over gauge length that a tensile test reaches at least; less was read in wrong units."""
LARGEST_STRAIN = 0.5
"""A woven reinforcement pulled along its yarns breaks far below this nominal strain."""


@dataclass(frozen=True, eq=False)
class TensileCharacterisation:
    """What the tensile tests of one direction say.

    Attributes
    ----------
    direction
        ``warp`` or ``weft``: the yarns along the pull.
    length, width
        Specimen [mm], X and Y of Eq. 11.
    specimens, mean
        The curves, and their mean with its scatter.
    stages
        Crimp, linear and damage.
    interval
        Displacements [mm] used for the law.
    fit
        The polynomial (Eq. 3) or the table.
    warnings
        What was done to the measurements and the fit.
    """

    direction: Direction
    length: float
    width: float
    specimens: tuple[Specimen, ...]
    mean: MeanCurve
    stages: TensileStages
    interval: tuple[float, float]
    fit: PolynomialFit | TableFit
    warnings: tuple[str, ...]

    @property
    def law(self) -> Law:
        """Force of the specimen [N] of its elongation [mm]."""
        return self.fit.law()

    def force_band(self, displacement: Floats, *, level: float = 0.95, simultaneous: bool = True) -> Band | None:
        """Confidence band of the force [N] at elongations [mm], shape [m]; None for a tabulated law."""
        if isinstance(self.fit, TableFit):
            return None
        return self.fit.band(displacement, level=level, simultaneous=simultaneous)

    def connector_limits(self, spacing: float) -> tuple[float, float]:
        """Uc_max [mm] and Fc_max [N] at the end of validity for a mesh of l0 = ``spacing`` mm (Eq. 11)."""
        end = self.fit.valid_to
        return end * spacing / self.length, float(self.law.value(end)) / (self.width / spacing + 1.0)

    def card_table(self) -> dict[str, Any]:
        """The table ``tension.<direction>`` of a fabric card."""
        n = len(self.specimens)
        size = {"specimen_length_mm": float(self.length), "specimen_width_mm": float(self.width)}
        source = f"Tensile tests of {n} specimen{'s' if n > 1 else ''}, see provenance"
        if isinstance(self.fit, TableFit):
            return {
                "law": "tabulated",
                "displacement_mm": [float(v) for v in self.fit.x],
                "force_N": [float(v) for v in self.fit.y],
                **size,
                "source": source,
            }
        table: dict[str, Any] = {"law": "polynomial", "coefficients": list(self.fit.law_coefficients)}
        if self.fit.constant != 0.0:
            table["constant_N"] = self.fit.constant
        return {**table, **size, "valid_to_mm": float(self.fit.valid_to), "source": source}


def characterise_tensile(
    files: Sequence[Path | str],
    *,
    direction: Direction,
    length: float,
    width: float,
    law: LawKind = "polynomial",
    degree: int = 4,
    interval: tuple[float, float] | None = None,
    monotone: bool = True,
    through_origin: bool = True,
    weighting: Weighting = "uniform",
    knots: int = 24,
    reading: Reading = Reading(),  # noqa: B008 (frozen)
) -> TensileCharacterisation:
    """From the files of the machine to a tension law.

    Parameters
    ----------
    files
        One or several specimens each.
    direction
        The yarns along the pull.
    length, width
        Gauge length and width of the specimens [mm].
    law
        ``polynomial`` (Eq. 3) or ``tabulated``.
    degree
        Of the polynomial.
    interval
        Displacements [mm] on which the law is fitted; by default from zero to the end of the linear stage.
    monotone, through_origin
        Impose a rising force and F(0) = 0.
    weighting
        Errors of one size, or in proportion to the force.
    knots
        Of the table.
    reading
        Preset, columns and units of the files.

    Raises
    ------
    MeasurementError
        A file or curve cannot be used, or the law cannot be fitted.

    Examples
    --------
    >>> from weftform.laboratory import characterise_tensile, sample
    >>> found = characterise_tensile(sample("tensile-warp"), direction="warp", length=150.0, width=50.0)
    >>> found.direction, len(found.specimens)
    ('warp', 5)
    """
    if not (length > 0.0 and width > 0.0 and np.isfinite(length * width)):
        raise MeasurementError("specimen sizes must be positive", expected="mm > 0", got=f"{length:g} x {width:g}")
    if law == "polynomial" and not 1 <= degree <= 12:
        raise MeasurementError("no such degree", expected="1 to 12", got=str(degree))
    specimens = read_specimens(files, Quantity.DISPLACEMENT, Quantity.FORCE, reading)
    for s in specimens:
        if s.x[-1] > LARGEST_STRAIN * length:
            raise MeasurementError(
                f"{s.name}: an elongation of {s.x[-1]:.4g} mm is not one of a {length:g} mm specimen along its yarns",
                file=s.file,
                line=int(s.lines[np.argmax(s.x > LARGEST_STRAIN * length)]),
                expected=f"at most {LARGEST_STRAIN * length:g} mm",
                got=f"{s.x[-1]:.6g} mm",
                hint="are displacement and force swapped, or the units wrong? --column displacement=..., --unit ...",
            )
        if s.x[-1] < LEAST_STRAIN * length:
            raise MeasurementError(
                f"{s.name}: the test ends at an elongation of {s.x[-1]:.4g} mm",
                file=s.file,
                line=int(s.lines[-1]),
                expected=f"at least {LEAST_STRAIN * length:g} mm on {length:g} mm",
                got=f"{s.x[-1]:.6g} mm",
                hint="is the displacement in metres or in inches? --unit displacement=m",
            )
    warnings = [w for s in specimens for w in s.warnings]
    mean = average(specimens)
    stages = tensile_stages(mean.x, mean.mean, point_scatter(mean.x, mean.mean))
    start, end = interval if interval is not None else (0.0, stages.linear_end)
    if not 0.0 <= start < end:
        raise MeasurementError("the interval is empty", expected="0 <= start < end", got=f"{start:g} to {end:g} mm")
    short = [s.name for s in specimens if s.x[-1] < 0.999 * end]
    if short:
        warnings.append(f"{', '.join(short)}: ends before {end:.4g} mm, the end of the interval")
    used = [s.part((s.x >= start) & (s.x <= end)) for s in specimens]
    used = [s for s in used if len(s.x) > 1]
    if not used:
        raise MeasurementError(
            "no points in the interval",
            expected=f"displacements in {start:g} to {end:g} mm",
            got=f"up to {mean.x[-1]:.4g} mm",
        )
    reached = max(float(s.x[-1]) for s in specimens)
    if interval is None:
        end = min(end, reached)
    elif end > 1.001 * reached:
        warnings.append(
            f"the interval asked for ends at {end:.4g} mm, the measurements at {reached:.4g} mm; validity ends there"
        )
        end = reached
    fit: PolynomialFit | TableFit
    if law == "tabulated":
        fit = fit_table([s.x for s in used], [s.y for s in used], lambda x, b: b(x), end, knots=knots)
    else:
        powers = list(range(0 if not through_origin else 1, degree + 1))
        fit = fit_polynomial(
            [power_basis(s.x, powers) for s in used],
            [s.y for s in used],
            powers,
            end,
            monotone=monotone,
            weighting=weighting,
        )
        warnings += fit_warnings(fit, "mm", "N")
    return TensileCharacterisation(
        direction,
        float(length),
        float(width),
        specimens,
        mean,
        stages,
        (float(start), float(end)),
        fit,
        tuple(warnings),
    )


def fit_warnings(fit: PolynomialFit, x_unit: str, y_unit: str, x_factor: float = 1.0) -> list[str]:
    """What the user must know of a fit: an acting constraint, a fall, an offset, a single specimen."""
    warnings = []
    if fit.constrained:
        warnings.append(
            f"the best polynomial of degree {fit.powers[-1]} falls somewhere in its validity; the best "
            f"rising one is used "
            f"(rms {fit.rms:.4g} {y_unit})"
        )
    fall = first_fall(fit.law(), fit.valid_to)
    if fall is not None:
        warnings.append(
            f"the fit is not monotone: it falls between {fall.start * x_factor:.3g} and "
            f"{fall.end * x_factor:.3g} {x_unit}; "
            "a card with it is refused"
        )
    if fit.constant != 0.0:
        warnings.append(f"the fit does not pass the origin ({fit.constant:.4g} {y_unit}); a card with it is refused")
    if fit.specimens == 1:
        warnings.append("one specimen only: the band tells the noise of its curve, not the scatter of the fabric")
    return warnings
