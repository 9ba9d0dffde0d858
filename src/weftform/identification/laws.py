"""What a fit changes: laws of the card as a whole, or single numbers of card and study."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from weftform.declared import validated
from weftform.errors import CardError, IdentificationError, StudyError
from weftform.fabric import Fabric
from weftform.fabric.fabric import merge_tables
from weftform.identification.fits import Fit, Parameter
from weftform.study.study import Study

BOUND_FACTOR = 20.0
"""Default bounds of a positive number: the start divided and multiplied by this."""
BOUND_SPAN = 10.0
"""Default bounds of a coefficient of either sign: the start less and plus this many times its size."""
BEYOND_KINEMATIC = 1.15
"""A shear law spans this much more than the kinematic angle: single cells shear up to 11 % more than zone B."""
WIDEST_DEG = 88.0
ANGLE_WITHOUT_KINEMATICS_DEG = 60.0
"""Span of a shear law fitted to a test whose shear angle follows from no formula, unless asked otherwise."""

LAWS = (
    "shear.G12",
    "shear.polynomial",
    "shear.table",
    "shear.scale",
    "tension.scale",
    "tension.warp.scale",
    "tension.weft.scale",
)
"""Names that stand for a law as a whole."""
OPTIONS = {"shear.polynomial": ("degree", "to"), "shear.table": ("intervals", "to")}
CARD_SECTIONS = ("fabric", "tension", "shear", "membrane")


@dataclass
class Changes:
    """Changes that a set of values makes: tables merged over the card's, and dotted keys of studies."""

    card: dict[str, Any] = field(default_factory=dict)
    study: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Family:
    """The parameters of one fit.

    Attributes
    ----------
    fit
        As asked for.
    parameters
        What the optimiser changes.
    sections
        Places of the card, ``("tension", "warp")``, or keys of the study that it changes.
    apply
        Writes a set of values into :class:`Changes`.
    span_deg
        Shear angle up to which a shear law is described [degrees], None for other fits.
    """

    fit: Fit
    parameters: tuple[Parameter, ...]
    sections: tuple[tuple[str, ...], ...]
    apply: Callable[[Sequence[float], Changes], None]
    span_deg: float | None = None


def families_of(fits: Sequence[Fit], study: Study, covered_deg: float | None) -> tuple[Family, ...]:
    """The parameters of all fits, with starts and bounds.

    Parameters
    ----------
    study
        Card and study that are identified.
    covered_deg
        Largest kinematic shear angle of the curves [degrees]; None where no test has one.

    Raises
    ------
    IdentificationError
        A name is unknown, a start lies outside of its bounds, or two fits change the same.
    """
    if not fits:
        raise IdentificationError(
            "nothing to fit", key="--fit", expected="one name at least", hint="--fit shear.G12, for example"
        )
    made: list[Family] = []
    for fit in fits:
        unknown = sorted(set(fit.options) - set(OPTIONS.get(fit.name, ())))
        if unknown:
            raise IdentificationError(
                f"unknown option {unknown[0]}",
                key=fit.name,
                expected=", ".join(OPTIONS.get(fit.name, ())) or "no options",
            )
        family = _family(fit, study, covered_deg)
        for other in made:
            for a in family.sections:
                for b in other.sections:
                    shorter = min(len(a), len(b))
                    if a[:shorter] == b[:shorter]:
                        raise IdentificationError(
                            f"{other.fit.name} and {fit.name} change the same numbers",
                            key=fit.name,
                            hint="leave one of them out",
                        )
        made.append(family)
    return tuple(made)


def changes_of(families: Sequence[Family], values: Sequence[float]) -> Changes:
    """What the values of all parameters, in their order, change."""
    changes = Changes()
    left = iter(values)
    for family in families:
        family.apply([next(left) for _ in family.parameters], changes)
    return changes


def changed(study: Study, changes: Changes) -> Study:
    """The study with changes merged over its card, and over those of its own keys that it has.

    Raises
    ------
    StudyError, CardError
        The changes are not allowed there.
    """
    values = study.model.model_dump(mode="python")
    values["fabric"]["override"] = merge_tables(values["fabric"]["override"], changes.card)
    for key, value in changes.study.items():
        place = _place(key)
        if _found(values, place) is not None:
            _write(values, place, value)
    model = validated(type(study.model), values, StudyError)
    return replace(study, model=model)


def _family(fit: Fit, study: Study, covered_deg: float | None) -> Family:
    fabric = study.fabric
    name = fit.name
    if name == "shear.G12":
        return _constant(fit, fabric, covered_deg)
    if name in ("shear.polynomial", "shear.table"):
        return _shear_curve(fit, fabric, covered_deg)
    if name in LAWS:
        return _scale(fit, fabric)
    return _number(fit, study)


# -- shear laws -----------------------------------------------------------------------------------------------------


def _constant(fit: Fit, fabric: Fabric, covered_deg: float | None) -> Family:
    """A constant G12: the first variant of Sec. 3.6. It starts from the secant of the card's law."""
    angle = np.radians(covered_deg or ANGLE_WITHOUT_KINEMATICS_DEG)
    parameter = _positive(fit, fit.name, "MPa", float(fabric.shear.shear_stress(angle)) / angle)

    def apply(values: Sequence[float], changes: Changes) -> None:
        changes.card["shear"] = {"law": "constant", "modulus_MPa": float(values[0])}

    return Family(fit, (parameter,), (("shear",),), apply)


def _shear_curve(fit: Fit, fabric: Fabric, covered_deg: float | None) -> Family:
    """G12 as a polynomial through its values at a few angles (second variant of Sec. 3.6), or piece by piece.

    The parameters are stiffnesses [MPa], not coefficients: they are of one size, positive, and far less correlated.
    A polynomial has them at the extrema of the Chebyshev polynomial over its span, where interpolation is best
    conditioned; a table has the secant modulus of each of its intervals, so that it cannot fall.
    """
    polynomial = fit.name == "shear.polynomial"
    size = _count(fit, "degree", 4, 1, 8) if polynomial else _count(fit, "intervals", 8, 2, 30)
    span = fit.options.get("to") or min(BEYOND_KINEMATIC * (covered_deg or ANGLE_WITHOUT_KINEMATICS_DEG), WIDEST_DEG)
    if not 1.0 <= span <= 90.0:
        raise IdentificationError(
            "the shear law would end there", key=f"{fit.name},to", expected="1 to 90 degrees", got=f"{span:g}"
        )
    if polynomial:
        degrees = 0.5 * span * (1.0 - np.cos(np.pi * np.arange(size + 1) / size))
        starts = fabric.shear.modulus(np.radians(degrees))
        names = [f"G12 at {angle:.3g} deg" for angle in degrees]
    else:
        degrees = np.linspace(0.0, span, size + 1)
        starts = np.diff(fabric.shear.shear_stress(np.radians(degrees))) / np.diff(np.radians(degrees))
        names = [f"G12 over {a:.3g}-{b:.3g} deg" for a, b in pairwise(degrees)]
    parameters = tuple(
        _positive(fit, name, "MPa", float(start)) for name, start in zip(names, np.atleast_1d(starts), strict=True)
    )

    def apply(values: Sequence[float], changes: Changes) -> None:
        if polynomial:
            exact = np.polynomial.Polynomial.fit(np.radians(degrees), np.asarray(values), size).convert().coef
            coefficients = [float(c) for c in np.pad(exact, (0, size + 1 - len(exact)))]
            changes.card["shear"] = {
                "law": "polynomial",
                "quantity": "shear-modulus",
                "coefficients": coefficients,
                "valid_to_deg": float(span),
            }
            return
        stress = np.append(0.0, np.cumsum(np.asarray(values) * np.diff(np.radians(degrees))))
        changes.card["shear"] = {
            "law": "tabulated",
            "quantity": "shear-stress",
            "shear_angle_deg": [float(a) for a in degrees],
            "values": [float(v) for v in stress],
        }

    return Family(fit, parameters, (("shear",),), apply, float(span))


def _count(fit: Fit, option: str, default: int, least: int, most: int) -> int:
    value = fit.options.get(option, default)
    if value != int(value) or not least <= value <= most:
        raise IdentificationError(
            f"no such {option}", key=f"{fit.name},{option}", expected=f"{least} to {most}", got=f"{value:g}"
        )
    return int(value)


# -- factors --------------------------------------------------------------------------------------------------------

_SCALED = ("coefficients", "constant_N", "stiffness_N_per_mm", "force_N", "modulus_MPa", "values")
"""Keys of a law that are in proportion to its values."""


def _scale(fit: Fit, fabric: Fabric) -> Family:
    """A factor on a law of the card as it is."""
    if fit.name == "shear.scale":
        places: list[tuple[str, ...]] = [("shear",)]
    else:
        if fabric.variant:
            raise IdentificationError(
                "the factor would not reach the tension variant that the study selects",
                key=fit.name,
                got=f'fabric.tension_variant = "{fabric.variant}"',
                hint="copy the card and make the variant its own law",
            )
        wanted = ("warp", "weft") if fit.name == "tension.scale" else (fit.name.split(".")[1],)
        # a direction that copies the other is changed with it
        pair = fabric.card.tension
        owners = {getattr(pair, direction).same_as or direction for direction in wanted}
        places = [("tension", direction) for direction in sorted(owners)]
    dump = fabric.card.model_dump(mode="python", exclude_unset=True)
    laws = [_found(dump, place) for place in places]
    parameter = _positive(fit, fit.name, "", 1.0)

    def apply(values: Sequence[float], changes: Changes) -> None:
        for place, law in zip(places, laws, strict=True):
            scaled = {key: _times(law[key], values[0]) if key in _SCALED else law[key] for key in law}
            _write(changes.card, place, scaled)

    return Family(fit, (parameter,), tuple(places), apply)


def _times(value: Any, factor: float) -> Any:
    return [float(factor * v) for v in value] if isinstance(value, list) else float(factor * value)


# -- single numbers -------------------------------------------------------------------------------------------------


def _number(fit: Fit, study: Study) -> Family:
    """Any number of the card or of the study, by its dotted key."""
    name = fit.name.removeprefix("fabric.override.")
    place = _place(name)
    card = study.fabric.card.model_dump(mode="python", exclude_none=True)
    of_card = place[0] in CARD_SECTIONS and (place[0] != "fabric" or _found(card, place) is not None)
    tables = card if of_card else study.model.model_dump(mode="python", exclude={"fabric", "name", "description"})
    value = _found(tables, place)
    if not isinstance(value, float):
        names = [*LAWS, *_numbers({s: card[s] for s in CARD_SECTIONS}), *_numbers(tables)]
        by_small = {n.lower(): n for n in names}
        close = difflib.get_close_matches(name.lower(), list(by_small), 1, 0.5)
        raise IdentificationError(
            "there is nothing of that name to fit" if value is None else "this is not a single real number",
            key=fit.name,
            expected=", ".join(LAWS) + ", or the dotted key of a real number of the card or study",
            got=None if value is None else repr(value)[:120],
            hint=f"did you mean {by_small[close[0]]}?" if close else None,
        )

    def apply(values: Sequence[float], changes: Changes) -> None:
        if not of_card:
            changes.study[name] = float(values[0])
            return
        if isinstance(place[-1], int) and _found(changes.card, place) is None:
            _write(changes.card, place[:-1], deepcopy(_found(card, place[:-1])))
        _write(changes.card, place, float(values[0]))

    start = value if fit.start is None else fit.start
    bounds = fit.bounds or _allowed_bounds(fit, start, apply, study, either_sign=isinstance(place[-1], int))
    parameter = _bounded(fit, fit.name, "", start, *bounds)
    return Family(fit, (parameter,), (tuple(map(str, place)),), apply)


def _allowed_bounds(
    fit: Fit, start: float, apply: Callable[[Sequence[float], Changes], None], study: Study, *, either_sign: bool
) -> tuple[float, float]:
    """The widest of a few bounds about a start that card and study allow.

    A coefficient may have either sign; another number keeps the one it has.
    """
    if start == 0.0:
        raise IdentificationError(
            "no bounds follow from a start at zero", key=fit.name, expected=f"--fit {fit.name}:LOW..HIGH"
        )
    for part in (1.0, 0.5, 0.25, 0.1, 0.05, 0.01):
        if either_sign or start < 0.0:
            span = part * BOUND_SPAN * abs(start)
            bounds = (start - span, start + span)
        else:
            factor = BOUND_FACTOR**part
            bounds = (start / factor, start * factor)
        if all(_allowed(apply, value, study) for value in bounds):
            break
    return bounds


def _allowed(apply: Callable[[Sequence[float], Changes], None], value: float, study: Study) -> bool:
    changes = Changes()
    apply([value], changes)
    try:
        changed(study, changes).fabric  # noqa: B018
    except (CardError, StudyError):
        return False
    return True


def _place(key: str) -> tuple[str | int, ...]:
    """``shear.coefficients[1]`` as ``("shear", "coefficients", 1)``."""
    return tuple(int(part) if part.isdigit() else part for part in re.sub(r"\[(\d+)\]", r".\1", key).split("."))


def _found(tables: Any, place: Sequence[str | int]) -> Any:
    for part in place:
        in_list = isinstance(tables, list) and isinstance(part, int) and part < len(tables)
        if not in_list and not (isinstance(tables, Mapping) and part in tables):
            return None
        tables = tables[part]
    return tables


def _write(tables: Any, place: Sequence[str | int], value: Any) -> None:
    for part in place[:-1]:
        tables = tables.setdefault(part, {}) if isinstance(tables, dict) else tables[part]
    tables[place[-1]] = value


def _numbers(tables: Any, prefix: str = "") -> Iterator[str]:
    """Dotted keys of all real numbers."""
    if isinstance(tables, Mapping):
        for key, value in tables.items():
            yield from _numbers(value, f"{prefix}.{key}" if prefix else str(key))
    elif isinstance(tables, list):
        for k, value in enumerate(tables):
            yield from _numbers(value, f"{prefix}[{k}]")
    elif isinstance(tables, float):
        yield prefix


# -- starts and bounds ----------------------------------------------------------------------------------------------


def _positive(fit: Fit, name: str, unit: str, present: float) -> Parameter:
    start = present if fit.start is None else fit.start
    if not start > 0.0:
        raise IdentificationError(
            f"{name} must start above zero",
            key=fit.name,
            got=f"{start:g}",
            hint=f"give a start: --fit {fit.name}=0.05" + (f":LOW..HIGH [{unit}]" if unit else ":LOW..HIGH"),
        )
    lower, upper = fit.bounds or (start / BOUND_FACTOR, start * BOUND_FACTOR)
    if fit.bounds is not None and lower <= 0.0 and fit.name in LAWS:
        raise IdentificationError("the lower bound must be above zero", key=fit.name, got=f"{lower:g}")
    return _bounded(fit, name, unit, start, lower, upper)


def _bounded(fit: Fit, name: str, unit: str, start: float, lower: float, upper: float) -> Parameter:
    if not lower <= start <= upper:
        raise IdentificationError(
            f"{name} starts outside of its bounds",
            key=fit.name,
            expected=f"{lower:g} to {upper:g} {unit}".strip(),
            got=f"{start:g}, the value of the card or study",
            hint="give a start within the bounds: --fit NAME=START:LOW..HIGH",
        )
    return Parameter(name, unit, float(start), float(lower), float(upper))
