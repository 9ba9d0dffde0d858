"""What an identification leaves: the card with its provenance and the summary."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from weftform import __version__
from weftform.fabric.fabric import shipped_cards
from weftform.identification.laws import changed, changes_of
from weftform.identification.preparing import SUMMARY
from weftform.laboratory.card_file import write_card
from weftform.result.writer import write_whole

if TYPE_CHECKING:
    from weftform.fabric.laws import Floats
    from weftform.identification.inverse import Identification

BAND_ANGLES = 25


def write_identified_card(found: Identification, *, own: bool) -> None:
    """Write the card, or put what was found into one that exists.

    Parameters
    ----------
    own
        The card is that of the folder, made anew from the card of the study; otherwise a card that exists is updated.
    """
    assert found.card is not None
    choice = found.study.model.fabric
    base: str | None = choice.card
    if choice.card not in shipped_cards() and found.study.file is not None:
        base = str((found.study.file.parent / choice.card).resolve())
    if found.card.exists() and not own:
        base = None
    final = found.fabric.card.model_dump(mode="json", exclude_unset=True)
    tables: dict[tuple[str, ...], Any] = {}
    for place in _tables(found.study.model.fabric.override):
        table = final
        for part in place:
            table = table[part]
        tables[place] = table
    for place in _tables(changes_of(found.families, found.values).card):
        if isinstance(tables[place], dict) and "law" in tables[place]:
            tables[place]["source"] = (
                f"Identified by inverse method from {len(found.curves)} curve{'s' if len(found.curves) > 1 else ''}; "
                "see provenance.identification"
            )
    write_card(found.card, tables, {"identification": provenance(found)}, base=base)


def _tables(override: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Places of a card that an override reaches: whole laws, and single values of the other tables."""
    places: list[tuple[str, ...]] = []
    for section, values in override.items():
        if section == "shear":
            places.append((section,))
        elif isinstance(values, Mapping):
            places += [(section, key) for key in values]
        else:
            places.append((section,))
    return places


def provenance(found: Identification) -> dict[str, Any]:
    """Files and their hashes, ranges, studies, values with their intervals, quality, warnings."""
    return {
        "test": "inverse identification (Sec. 3.6)",
        "written_by": f"weftform {__version__}",
        "studies": [s.name for s in found.studies],
        "files": [
            {
                "name": c.specimen.file.name,
                "sha256": c.specimen.sha256,
                "study": found.studies[c.study].name,
                "interval_mm": [float(c.displacement[0]), float(c.displacement[-1])],
                "weight": c.weight,
            }
            for c in found.curves
        ],
        "parameters": [_plain(p) for p in _parameters(found)],
        "points": len(found.solution.residuals),
        "misfit": found.misfit,
        "covered_deg": found.covered_deg,
        "converged": found.solution.converged,
        "warnings": [*found.notes, *found.warnings],
    }


def _parameters(found: Identification) -> list[dict[str, Any]]:
    sure = found.uncertainty
    return [
        {
            "name": p.name,
            "unit": p.unit,
            "value": value,
            "low_95": float(low),
            "high_95": float(high),
            "start": p.start,
            "bounds": [p.lower, p.upper],
            "sensitivity": float(sensitivity),
        }
        for p, value, low, high, sensitivity in zip(
            found.parameters, found.values, sure.lower, sure.upper, sure.sensitivity, strict=True
        )
    ]


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """Without what has no number: TOML knows no null."""
    return {k: v for k, v in values.items() if not (isinstance(v, float) and not math.isfinite(v))}


def summary(found: Identification) -> dict[str, Any]:
    """The contents of ``identification.json``."""
    sure = found.uncertainty
    values = {
        "study": found.study.name,
        "ok": found.ok,
        "converged": found.solution.converged,
        "status": found.solution.message,
        "misfit": found.misfit,
        "misfit_start": found.iterates[0].misfit,
        "parameters": _parameters(found),
        "correlation": sure.correlation.tolist(),
        "condition_number": sure.condition,
        "degrees_of_freedom": sure.freedom,
        "student_t": sure.quantile,
        "residual_correlation": sure.residual_correlation,
        "covered_deg": found.covered_deg,
        "curves": [
            {
                "file": str(c.specimen.file),
                "specimen": c.specimen.name,
                "sha256": c.specimen.sha256,
                "study": found.studies[c.study].name,
                "weight": c.weight,
                "range_mm": [float(c.displacement[0]), float(c.displacement[-1])],
                "points": len(c.force),
                "slip_mm": c.slip_mm,
                "misfit": float(np.sqrt(r @ r / c.weight)),
                "rms_N": float(np.sqrt(np.mean((r * c.size) ** 2) * len(r) / c.weight)),
            }
            for c, r in zip(found.curves, residuals_by_curve(found), strict=True)
        ],
        "iterations": [{"values": list(i.values), "misfit": i.misfit} for i in found.iterates],
        "card": None if found.card is None else str(found.card),
        "card_changes": changes_of(found.families, found.values).card,
        "study_changes": changes_of(found.families, found.values).study,
        "evaluations": found.evaluations,
        "reused": found.reused,
        "seconds": found.seconds,
        "warnings": list(found.warnings),
        "notes": list(found.notes),
    }
    band = shear_band(found, BAND_ANGLES)
    if band is not None:
        angle, modulus, lower, upper = band
        values["shear_modulus"] = {
            "shear_angle_deg": angle.tolist(),
            "G12_MPa": modulus.tolist(),
            "low_95_MPa": lower.tolist(),
            "high_95_MPa": upper.tolist(),
        }
    return values


def write_summary(found: Identification) -> None:
    """Write ``identification.json``."""
    write_whole(found.folder / SUMMARY, json.dumps(_without_nan(summary(found)), indent=2) + "\n")


def _without_nan(value: Any) -> Any:
    """The same with null where a number is not finite: JSON has no other word for it."""
    if isinstance(value, dict):
        return {k: _without_nan(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def residuals_by_curve(found: Identification) -> list[Floats]:
    """Weighted residuals of each curve."""
    return np.split(found.solution.residuals, np.cumsum([len(c.force) for c in found.curves])[:-1])


def shear_band(found: Identification, count: int) -> tuple[Floats, Floats, Floats, Floats] | None:
    """Angles [degrees], G12 [MPa] and its 95 % interval at each; None where the shear law was not fitted.

    The interval is that of the linear model: ``G +- t sqrt(g' C g)`` with the gradient ``g`` of G12 by the coordinates
    of the parameters and their covariance ``C``.
    """
    if not any(place[0] == "shear" for family in found.families for place in family.sections):
        return None
    end = found.covered_deg
    if end is None:
        end = next((f.span_deg for f in found.families if f.span_deg is not None), 60.0)
    degrees = np.linspace(0.0, end, count)

    def modulus(values: list[float]) -> Floats:
        return np.asarray(
            changed(found.study, changes_of(found.families, values)).fabric.shear.modulus(np.radians(degrees))
        )

    values = list(found.values)
    centre = modulus(values)
    gradient = np.empty((count, len(values)))
    for k, parameter in enumerate(found.parameters):
        step = 1e-5 * parameter.slope(values[k])
        gradient[:, k] = (modulus([*values[:k], values[k] + step, *values[k + 1 :]]) - centre) / 1e-5
    half = found.uncertainty.quantile * np.sqrt(
        np.einsum("ak,kl,al->a", gradient, found.uncertainty.covariance, gradient)
    )
    if not np.isfinite(found.uncertainty.standard_errors[~np.isnan(found.uncertainty.standard_errors)]).all():
        half = np.full(count, np.inf)
    return degrees, centre, centre - half, centre + half
