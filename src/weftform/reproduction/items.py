"""One line of the comparison with the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Item:
    """A value of the paper beside the computed one.

    Attributes
    ----------
    section
        Where it belongs in the report.
    what
        The quantity, with its unit.
    source
        Where the reference value comes from: a table or equation of the paper, or a closed form.
    reference
        The value there; None where the paper gives none that survived.
    computed
        What weftform computes.
    tolerance
        Largest relative difference (or absolute, where ``absolute``) for the item to agree; None where it need not agree: a
        misprint, a measurement with slip, or a value that the paper does not give.
    remark
        Why, for items that need not agree; how, for others.
    """

    section: str
    what: str
    source: str
    reference: float | None
    computed: float
    tolerance: float | None = None
    absolute: bool = False
    remark: str = ""

    @property
    def difference(self) -> float | None:
        """Computed minus reference, relative unless ``absolute`` or the reference is zero."""
        if self.reference is None:
            return None
        change = self.computed - self.reference
        return change if self.absolute or self.reference == 0.0 else change / self.reference

    @property
    def agrees(self) -> bool | None:
        """Whether it agrees; None where it need not."""
        if self.tolerance is None or self.difference is None:
            return None
        return abs(self.difference) <= self.tolerance

    def as_dict(self) -> dict[str, Any]:
        return {**self.__dict__, "difference": self.difference, "agrees": self.agrees}

    def cells(self) -> tuple[str, str, str, str, str]:
        """Item, reference, computed, difference and remark as text."""
        if self.difference is None:
            difference = ""
        elif self.absolute or self.reference == 0.0:
            difference = f"{self.difference:+.3g}"
        else:
            difference = f"{100 * self.difference:+.2f} %"
        verdict = {True: "agrees", False: "DISAGREES", None: ""}[self.agrees]
        if self.tolerance is not None and self.agrees is not None:
            limit = f"{self.tolerance:g}" if self.absolute or self.reference == 0.0 else f"{100 * self.tolerance:g} %"
            verdict += f" (within {limit})"
        remark = "; ".join(part for part in (verdict, self.remark) if part)
        reference = "not given" if self.reference is None else f"{self.reference:.6g}"
        return f"{self.what} [{self.source}]", reference, f"{self.computed:.6g}", difference, remark
