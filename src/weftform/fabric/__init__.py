"""What the cloth is: tension and shear laws, the fabric card, shipped cards."""

from weftform.fabric.fabric import Fabric, ShearLaw, TensionLaw, shipped_cards
from weftform.fabric.laws import (
    Law,
    LinearLaw,
    LogStrainLaw,
    PolynomialLaw,
    Scaled,
    Sum,
    TabulatedLaw,
)

__all__ = [
    "Fabric",
    "Law",
    "LinearLaw",
    "LogStrainLaw",
    "PolynomialLaw",
    "Scaled",
    "ShearLaw",
    "Sum",
    "TabulatedLaw",
    "TensionLaw",
    "shipped_cards",
]
