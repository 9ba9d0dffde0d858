"""Tolerances that a user gives, and the verdict on each."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from weftform.errors import MeasurementError
from weftform.laboratory.units import Dimension, known_units, unit_factor


@dataclass(frozen=True)
class Limited:
    """A number of the comparison that can be limited.

    Attributes
    ----------
    item
        What has to be compared for it: ``outline``, ``angles``, ``curve`` or ``markers``.
    what
        In words.
    dimension
        Of a limit without a unit.
    path
        Where the number stands in the item's part of ``comparison.json``.
    percent_path
        Where it stands in per cent of the peak; empty where it does not.
    """

    item: str
    what: str
    dimension: Dimension
    path: tuple[str, ...]
    percent_path: tuple[str, ...] = ()


LIMITED: dict[str, Limited] = {
    "outline": Limited("outline", "largest gap along the normal", Dimension.LENGTH, ("gap_mm", "normal", "max")),
    "outline-mean": Limited("outline", "mean gap along the normal", Dimension.LENGTH, ("gap_mm", "normal", "mean")),
    "outline-x": Limited("outline", "largest gap along X", Dimension.LENGTH, ("gap_mm", "x", "max")),
    "outline-y": Limited("outline", "largest gap along Y", Dimension.LENGTH, ("gap_mm", "y", "max")),
    "hausdorff": Limited("outline", "Hausdorff distance", Dimension.LENGTH, ("hausdorff_mm",)),
    "angle": Limited("angles", "largest difference of shear angle", Dimension.ANGLE, ("difference_deg", "max")),
    "angle-mean": Limited("angles", "mean difference of shear angle", Dimension.ANGLE, ("difference_deg", "mean")),
    "curve": Limited("curve", "largest difference of force", Dimension.FORCE, ("max_N",), ("max_percent",)),
    "curve-rms": Limited("curve", "RMS difference of force", Dimension.FORCE, ("rms_N",), ("rms_percent",)),
    "marker": Limited("markers", "largest distance of a marker", Dimension.LENGTH, ("distance_mm", "max")),
    "marker-mean": Limited("markers", "mean distance of the markers", Dimension.LENGTH, ("distance_mm", "mean")),
}
"""What can be limited, by the name that a tolerance has."""

_LIMIT = re.compile(r"^\s*(?P<number>[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)\s*(?P<unit>\D*?)\s*$")


@dataclass(frozen=True)
class Tolerance:
    """A limit on one number of the comparison: in the unit of its dimension, or in per cent of the peak."""

    name: str
    limit: float
    percent: bool = False

    @property
    def limited(self) -> Limited:
        return LIMITED[self.name]

    @property
    def unit(self) -> str:
        return "%" if self.percent else self.limited.dimension.value


@dataclass(frozen=True)
class Verdict:
    """Whether a number is within its tolerance.

    Attributes
    ----------
    tolerance
        The limit.
    value
        The number, in the unit of the limit; None where it does not exist, which is no pass.
    """

    tolerance: Tolerance
    value: float | None

    @property
    def ok(self) -> bool:
        return self.value is not None and self.value <= self.tolerance.limit

    def as_dict(self) -> dict[str, Any]:
        """For ``comparison.json``."""
        t = self.tolerance
        return {
            "tolerance": t.name,
            "item": t.limited.item,
            "what": t.limited.what,
            "value": self.value,
            "limit": t.limit,
            "unit": t.unit,
            "ok": self.ok,
        }


def tolerances_from(given: Mapping[str, float | str]) -> tuple[Tolerance, ...]:
    """Tolerances from what a user wrote.

    Parameters
    ----------
    given
        Limit per name: a number (mm, degrees, N), or text with a unit (``"2 mm"``, ``"5 %"``, ``"0.1 kN"``).

    Raises
    ------
    MeasurementError
        No such name, no positive number, or a unit of another kind.
    """
    return tuple(_tolerance(name, limit) for name, limit in given.items())


def _tolerance(name: str, given: float | str) -> Tolerance:
    if name not in LIMITED:
        close = difflib.get_close_matches(name, list(LIMITED), 1)
        raise MeasurementError(
            f'no tolerance "{name}"',
            key="--tolerance",
            expected="one of " + ", ".join(LIMITED),
            got=name,
            hint=f"did you mean {close[0]}?" if close else None,
        )
    limited = LIMITED[name]
    units = known_units(limited.dimension) + (", %" if limited.percent_path else "")
    found = _LIMIT.match(str(given))
    number = float(found["number"]) if found else math.nan
    if not (found and math.isfinite(number) and number > 0.0):
        raise MeasurementError(
            "not a tolerance",
            key=f"--tolerance {name}",
            expected=f"a positive number, with a unit or without ({units}), such as {name}=2",
            got=str(given),
        )
    unit = found["unit"]
    if unit == "%" and limited.percent_path:
        return Tolerance(name, number, percent=True)
    factor = 1.0 if not unit else unit_factor(unit, limited.dimension)
    if factor is None:
        raise MeasurementError(
            f'"{unit}" is no unit of the {limited.what}', key=f"--tolerance {name}", expected=units, got=str(given)
        )
    return Tolerance(name, number * factor)


def verdict(tolerance: Tolerance, items: Mapping[str, Any]) -> Verdict:
    """The verdict on a tolerance.

    Parameters
    ----------
    items
        Parts of ``comparison.json`` by the name of the item.
    """
    value: Any = items[tolerance.limited.item]
    for key in tolerance.limited.percent_path if tolerance.percent else tolerance.limited.path:
        value = value[key]
    return Verdict(tolerance, value)
