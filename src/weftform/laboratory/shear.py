"""What a shear test says, whichever test it was: F_sh, tau and G12 of the shear angle (Eqs. 8 to 10)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from weftform.fabric.laws import Floats, Law, first_fall
from weftform.laboratory.fitting import Band, PolynomialFit
from weftform.laboratory.stages import ShearStages
from weftform.laboratory.tabulating import TableFit


@dataclass(frozen=True, eq=False)
class ShearCurve:
    """A fitted shear law with its uncertainty; angles in radians.

    Attributes
    ----------
    fit
        Polynomial or table of F_sh [N/mm] against gamma [rad] (Eq. 8).
    thickness
        Of the fabric [mm].
    stages
        Placing, transition, locking.
    """

    fit: PolynomialFit | TableFit
    thickness: float
    stages: ShearStages

    @property
    def law(self) -> Law:
        """F_sh [N/mm] of gamma [rad]."""
        return self.fit.law()

    @property
    def valid_to(self) -> float:
        """End of the validity [rad]."""
        return self.fit.valid_to

    def normalised_force(self, angle: Floats | float) -> Floats:
        """F_sh [N/mm] (Eq. 8)."""
        return self.law.value(angle)

    def stress(self, angle: Floats | float) -> Floats:
        """tau = F_sh / e [MPa] (Eq. 9)."""
        return self.law.value(angle) / self.thickness

    def modulus(self, angle: Floats | float) -> Floats:
        """G12 = dtau / dgamma [MPa] (Eq. 10)."""
        return self.law.slope(angle) / self.thickness

    def force_band(self, angle: Floats, *, level: float = 0.95, simultaneous: bool = True) -> Band | None:
        """Confidence band of F_sh [N/mm]; None for a table."""
        return self._band(angle, "value", 1.0, level, simultaneous)

    def stress_band(self, angle: Floats, *, level: float = 0.95, simultaneous: bool = True) -> Band | None:
        """Confidence band of tau [MPa]; None for a table."""
        return self._band(angle, "value", 1.0 / self.thickness, level, simultaneous)

    def modulus_band(self, angle: Floats, *, level: float = 0.95, simultaneous: bool = True) -> Band | None:
        """Confidence band of G12 [MPa]; None for a table."""
        return self._band(angle, "slope", 1.0 / self.thickness, level, simultaneous)

    def _band(self, angle: Floats, kind: Any, factor: float, level: float, simultaneous: bool) -> Band | None:
        if isinstance(self.fit, TableFit):
            return None
        b = self.fit.band(angle, kind=kind, level=level, simultaneous=simultaneous)
        return Band(factor * b.lower, factor * b.centre, factor * b.upper, b.critical)

    @property
    def stress_coefficients(self) -> tuple[float, ...] | None:
        """Of tau [MPa], powers 1, 2, ... (Eq. 9); None for a table."""
        if isinstance(self.fit, TableFit):
            return None
        return tuple(c / self.thickness for c in self.fit.law_coefficients)

    @property
    def modulus_coefficients(self) -> tuple[float, ...] | None:
        """Of G12 [MPa], powers 0, 1, ... (Eq. 10); None for a table."""
        tau = self.stress_coefficients
        return None if tau is None else tuple(k * c for k, c in enumerate(tau, 1))

    @property
    def modulus_positive(self) -> bool:
        """Whether G12 >= 0 over the whole validity."""
        return first_fall(self.law, self.valid_to) is None

    def card_table(self, source: str) -> dict[str, Any]:
        """The table ``shear`` of a fabric card."""
        end = float(np.degrees(self.valid_to))
        if isinstance(self.fit, TableFit):
            return {
                "law": "tabulated",
                "quantity": "normalised-shear-force",
                "shear_angle_deg": [float(v) for v in np.degrees(self.fit.x)],
                "values": [float(v) for v in self.fit.y],
                "source": source,
            }
        return {
            "law": "polynomial",
            "quantity": "normalised-shear-force",
            "coefficients": list(self.fit.law_coefficients),
            "valid_to_deg": end,
            "source": source,
        }
