"""What is asked for with ``--fit``: a name, a start, bounds and options, from one text."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from weftform.errors import IdentificationError

_SYNTAX = re.compile(
    r"(?P<name>[^=:,]+)(=(?P<start>[^:,]+))?(:(?P<lower>[^,]+?)\.\.(?P<upper>[^,]+))?(,(?P<options>.+))?"
)
FORM = "NAME[=START][:LOW..HIGH][,OPTION=VALUE]"


@dataclass(frozen=True)
class Fit:
    """Something to identify.

    Attributes
    ----------
    name
        ``shear.G12``, ``shear.polynomial``, ``shear.table``, ``shear.scale``, ``tension.scale``,
        ``tension.warp.scale``, ``tension.weft.scale``, or the dotted key of a number of the card or the study
        (``contact.punch.friction``, ``shear.coefficients[1]``).
    start
        Value to start from, in the unit of what is fitted; that of the card or study without.
    bounds
        Lowest and highest value; relative to the start without.
    options
        ``degree`` and ``to`` of ``shear.polynomial``, ``intervals`` and ``to`` of ``shear.table``; ``to`` in degrees.
    """

    name: str
    start: float | None = None
    bounds: tuple[float, float] | None = None
    options: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for value in (self.start, *(self.bounds or ())):
            if value is not None and not math.isfinite(value):
                raise IdentificationError("a start or bound is not finite", key=self.name, got=f"{value:g}")
        if self.bounds is None:
            return
        lower, upper = self.bounds
        if not lower < upper:
            raise IdentificationError(
                "the bounds are reversed or equal",
                key=self.name,
                expected="LOW..HIGH with LOW below HIGH",
                got=f"{lower:g}..{upper:g}",
                hint=f"--fit {self.name}:{upper:g}..{lower:g}" if upper < lower else None,
            )
        if self.start is not None and not lower <= self.start <= upper:
            raise IdentificationError(
                "the start lies outside of the bounds",
                key=self.name,
                expected=f"{lower:g} to {upper:g}",
                got=f"{self.start:g}",
            )

    @classmethod
    def parse(cls, text: str) -> Fit:
        """Read ``NAME[=START][:LOW..HIGH][,OPTION=VALUE]``.

        Raises
        ------
        IdentificationError
            The text has another form, a number is none, bounds are reversed, or the start lies outside.

        Examples
        --------
        >>> Fit.parse("shear.G12=0.05:0.01..0.5").bounds
        (0.01, 0.5)
        """
        found = _SYNTAX.fullmatch(text.strip())
        if found is None:
            raise IdentificationError(
                "what to fit cannot be read",
                key="--fit",
                expected=FORM,
                got=text,
                hint="for example shear.G12, shear.G12=0.05:0.01..0.5 or shear.polynomial,degree=4",
            )
        options = {}
        for pair in (found["options"] or "").split(","):
            if pair:
                key, _, value = pair.partition("=")
                options[key.strip()] = _number(value, text)
        return cls(
            found["name"].strip(),
            None if found["start"] is None else _number(found["start"], text),
            None if found["lower"] is None else (_number(found["lower"], text), _number(found["upper"], text)),
            options,
        )


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise IdentificationError(
            "not a number in what to fit", key="--fit", expected=FORM, got=f"{text!r} in {whole}"
        ) from None


@dataclass(frozen=True)
class Parameter:
    """One number that the optimiser changes; in its own coordinate all parameters are of one size.

    Attributes
    ----------
    name, unit
        As the user reads it.
    start, lower, upper
        In ``unit``.
    """

    name: str
    unit: str
    start: float
    lower: float
    upper: float

    @property
    def logarithmic(self) -> bool:
        """Whether the optimiser sees the logarithm: a stiffness is known to a factor, not to an amount."""
        return self.lower > 0.0

    @property
    def size(self) -> float:
        """Amount that counts as one for a parameter without logarithm."""
        return max(abs(self.start), (self.upper - self.lower) / 20.0)

    def normalised(self, value: float) -> float:
        """Coordinate of a value; the start is at zero."""
        return math.log(value / self.start) if self.logarithmic else (value - self.start) / self.size

    def value(self, normalised: float) -> float:
        """Value at a coordinate, kept within the bounds."""
        value = self.start * math.exp(normalised) if self.logarithmic else self.start + self.size * normalised
        return min(max(value, self.lower), self.upper)

    def slope(self, value: float) -> float:
        """Change of the value per change of the coordinate."""
        return value if self.logarithmic else self.size
