"""Units found in measurement files, and their factors to mm, N, seconds, degrees and plain ratios."""

from __future__ import annotations

import re
from enum import Enum


class Dimension(Enum):
    """Kind of a measured quantity; the value is the unit the laboratory works in."""

    LENGTH = "mm"
    FORCE = "N"
    TIME = "s"
    ANGLE = "deg"
    RATIO = "1"
    FORCE_PER_LENGTH = "N/mm"
    NONE = ""


_PI = 3.141592653589793
_FACTORS: dict[Dimension, dict[str, float]] = {
    Dimension.LENGTH: {"mm": 1.0, "cm": 10.0, "m": 1000.0, "µm": 1e-3, "um": 1e-3, "in": 25.4, "inch": 25.4},
    Dimension.FORCE: {
        "N": 1.0,
        "mN": 1e-3,
        "cN": 1e-2,
        "daN": 10.0,
        "kN": 1e3,
        "MN": 1e6,
        "gf": 9.80665e-3,
        "kgf": 9.80665,
        "lbf": 4.4482216152605,
        "lb": 4.4482216152605,
    },
    Dimension.TIME: {"s": 1.0, "sec": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    Dimension.ANGLE: {
        "deg": 1.0,
        "°": 1.0,
        "degree": 1.0,
        "degrees": 1.0,
        "rad": 180.0 / _PI,
        "radians": 180.0 / _PI,
    },
    Dimension.RATIO: {
        "1": 1.0,
        "-": 1.0,
        "mm/mm": 1.0,
        "m/m": 1.0,
        "%": 1e-2,
        "pct": 1e-2,
        "µm/m": 1e-6,
        "µε": 1e-6,
    },
    Dimension.FORCE_PER_LENGTH: {"N/mm": 1.0, "N/m": 1e-3, "kN/m": 1.0, "N/cm": 0.1, "mN/mm": 1e-3},
    Dimension.NONE: {"": 1.0},
}


def _normal(unit: str) -> str:
    """One spelling: both micro signs and underscores of column names such as ``force_N_per_mm``."""
    return unit.strip().replace("μ", "µ").replace("_per_", "/").replace(" ", "")


def unit_factor(unit: str, dimension: Dimension) -> float | None:
    """Factor from ``unit`` to the laboratory's unit of ``dimension``; None where the unit is not one of
    that kind.

    The capitals matter only where they change the meaning: ``mN`` and ``MN`` differ, ``MM`` and ``mm`` do
    not.
    """
    known = _FACTORS[dimension]
    name = _normal(unit)
    if name in known:
        return known[name]
    lower = [factor for key, factor in known.items() if key.lower() == name.lower()]
    return lower[0] if len(set(lower)) == 1 else None


def known_units(dimension: Dimension) -> str:
    """The units accepted for a kind of quantity, for messages."""
    return ", ".join(_FACTORS[dimension])


def is_unit(text: str) -> bool:
    """Whether a piece of text is a unit of any kind (``(mm)``, ``[%]``, ``kN``)."""
    bare = text.strip().strip("()[]").strip()
    return bare != "" and any(unit_factor(bare, d) is not None for d in Dimension if d is not Dimension.NONE)


_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\(\[](?P<unit>[^\)\]]*)[\)\]]\s*$")
_SLASH = re.compile(r"^(?P<name>.*\S)\s+/\s+(?P<unit>\S+)\s*$")


def split_unit(header: str) -> tuple[str, str | None]:
    """Name and unit of a column header; the unit is None where the header has none.

    What stands in brackets is returned as it is: the reader says so where it is not a unit.

    Examples
    --------
    >>> split_unit("Extension (mm)"), split_unit("force_kN"), split_unit("Load")
    (('Extension', 'mm'), ('force', 'kN'), ('Load', None))
    >>> split_unit("normalised_shear_force_N_per_mm")
    ('normalised_shear_force', 'N/mm')
    """
    text = header.strip().strip('"').strip()
    found = _BRACKETS.match(text)
    if found and found["name"]:
        return found["name"].strip(), found["unit"].strip()
    found = _SLASH.match(text)
    if found and is_unit(found["unit"]):
        return found["name"].strip(), found["unit"].strip()
    pieces = text.split("_")
    for keep in range(max(1, len(pieces) - 3), len(pieces)):
        unit = _normal("_".join(pieces[keep:]).replace("_per_", "/"))
        if is_unit(unit) and unit not in ("1", "-"):
            return "_".join(pieces[:keep]), unit
    return text, None
