"""The laws of a fabric as the compiled loops take them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from weftform.blank import YarnGrid
from weftform.fabric import Fabric
from weftform.fabric.piecewise import PiecewiseLaw, pack_law, pack_shear
from weftform.solver import survey

Floats = NDArray[np.float64]

LOG_RANGE = 2.6
"""Largest stretch (and inverse of the smallest) for which the series of the logarithm is fitted."""
LOG_TERMS = 10
"""Terms of that series: relative error below 1e-8 over the range, as for the law of shear."""
LARGEST_ELONGATION = 1.5
"""Where the pieces of a tension law without a limit of validity end."""


class Material:
    """Packed laws of a fabric on a grid.

    Attributes
    ----------
    warp, weft, shear
        Packed laws: force [N] of a connector by nominal strain, and ``tau / t`` [MPa] by ``t = tan(gamma / 2)``.
    laws
        Of each: coefficients, integrals, width, slope beyond the end, slope in compression, and for a law of one piece the
        coefficients of its integral over the strain.
    shapes
        Degree and pieces of each.
    membrane
        Scalars of the cells, see :func:`weftform.solver.fabric_rows.measure_row`.
    series
        Of the logarithm.
    """

    def __init__(self, fabric: Fabric, grid: YarnGrid, hourglass: float) -> None:
        self.warp = pack_law(fabric.warp.line_law(grid.weft_pitch), LARGEST_ELONGATION)
        self.weft = pack_law(fabric.weft.line_law(grid.warp_pitch), LARGEST_ELONGATION)
        self.shear = pack_shear(fabric.shear.stress)
        packed = self.warp, self.weft, self.shear
        self.laws = tuple(
            _arguments(law, slack)
            for law, slack in zip(packed, (fabric.warp.slack_ratio, fabric.weft.slack_ratio, 0.0), strict=True)
        )
        self.shapes = tuple(number for law in packed for number in (law.degree, law.pieces))
        self.series = log_series()
        # polynomials go to the time loop as tuples: values, not memory, so they cannot overlap what the loop writes
        self.loop_laws: tuple[Any, ...] = tuple(
            tuple(arguments[0]) if law.pieces == 1 else arguments[0]
            for arguments, law in zip(self.laws, packed, strict=True)
        )
        self.ends = np.array([arguments[2:5] for arguments in self.laws])
        self.warp_inverse, self.weft_inverse = 1.0 / grid.warp_pitch, 1.0 / grid.weft_pitch
        card = fabric.card.membrane
        stabilise = hourglass * 0.5 * (card.warp_modulus_MPa + card.weft_modulus_MPa)
        edges = 1.0 if grid.has_half_cells else 2.0
        warp_edge, weft_edge = self.warp_inverse / edges, self.weft_inverse / edges
        self.moduli = card.warp_modulus_MPa, card.weft_modulus_MPa
        self.membrane = np.array(
            [
                warp_edge**2,
                weft_edge**2,
                warp_edge * weft_edge,
                *self.moduli,
                stabilise / grid.cell_area,
                *_mirror_signs(grid),
            ]
        )


def largest(law: PiecewiseLaw, x: float) -> tuple[float, float]:
    """Largest value and largest slope of a packed law on 0..x, sampled."""
    found: tuple[float, float] = survey.largest_on(
        law.coefficients, law.degree, law.pieces, law.width, law.end_slope, max(x, 0.0)
    )
    return found


def log_series() -> Floats:
    """Coefficients of ``ln(l) / y`` in powers of ``y^2``, ``y = (l^2 - 1)/(l^2 + 1)``, highest power first.

    ``ln l = artanh y``; the fit is at Chebyshev nodes of ``y^2`` up to :data:`LOG_RANGE`.
    """
    end = (LOG_RANGE**2 - 1.0) / (LOG_RANGE**2 + 1.0)
    nodes = 0.5 * end**2 * (1.0 - np.cos(np.pi * (np.arange(200) + 0.5) / 200))
    ratio = np.arctanh(np.sqrt(nodes)) / np.sqrt(nodes)
    fit = np.polynomial.Chebyshev.fit(nodes, ratio, LOG_TERMS - 1, domain=[0.0, end**2])
    powers = fit.convert(kind=np.polynomial.Polynomial, domain=[-1, 1], window=[-1, 1]).coef
    return np.ascontiguousarray(powers[::-1])


def _arguments(law: PiecewiseLaw, slack_ratio: float) -> tuple[Floats, Floats, float, float, float, Floats]:
    initial = float(law.coefficients[law.degree - 1]) if law.degree else 0.0
    integral = law.coefficients[: law.degree + 1] / np.arange(law.degree + 1, 0, -1)
    return law.coefficients, law.integrals, law.width, law.end_slope, slack_ratio * initial, integral


def _mirror_signs(grid: YarnGrid) -> tuple[float, float]:
    """Signs along x and y of the mirror images of half cells, the same on both planes of symmetry (1, 1 without)."""
    share, signs = grid.mirrors
    found = signs[share > 0.0]
    return (float(found[0, 0]), float(found[0, 1])) if len(found) else (1.0, 1.0)
