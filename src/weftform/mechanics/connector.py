"""The yarn between two crossings: a connector with a non-linear force, slack in compression.

The force is a function of the nominal strain (length / initial length - 1); Eq. 11 of the paper, which turns
the curve of a specimen into that function, belongs to :class:`weftform.fabric.Fabric`.
"""

from __future__ import annotations

from typing import Any

from weftform.mechanics.compiled import scalar
from weftform.mechanics.piecewise import piecewise_integral, piecewise_slope, piecewise_value
from weftform.mechanics.roots import inverse_root


@scalar
def connector_force(
    coefficients: Any,
    degree: int,
    pieces: int,
    width: float,
    end_slope: float,
    slack_slope: float,
    strain: float,
) -> float:
    """Force of a connector [N]; ``slack_slope`` [N] is its tiny stiffness in compression (0: none)."""
    pull = piecewise_value(coefficients, degree, pieces, width, end_slope, max(strain, 0.0))
    return pull + slack_slope * min(strain, 0.0)


@scalar
def connector_tangent(
    coefficients: Any,
    degree: int,
    pieces: int,
    width: float,
    end_slope: float,
    slack_slope: float,
    strain: float,
) -> float:
    """Derivative of :func:`connector_force` with respect to the strain [N]."""
    if strain < 0.0:
        return slack_slope
    return piecewise_slope(coefficients, degree, pieces, width, end_slope, strain)


@scalar
def connector_energy(
    coefficients: Any,
    integrals: Any,
    degree: int,
    pieces: int,
    width: float,
    end_slope: float,
    slack_slope: float,
    strain: float,
) -> float:
    """Stored energy of a connector per unit of initial length [N mm / mm]."""
    pull = piecewise_integral(coefficients, integrals, degree, pieces, width, end_slope, max(strain, 0.0))
    push = min(strain, 0.0)
    return pull + 0.5 * slack_slope * push * push


@scalar
def connector_pull(
    dx: float,
    dy: float,
    dz: float,
    ux: float,
    uy: float,
    uz: float,
    inverse_length: float,
    viscosity: float,
    coefficients: Any,
    degree: int,
    pieces: int,
    width: float,
    end_slope: float,
    slack_slope: float,
) -> tuple[float, float]:
    """Force of a connector with its dashpot, per length of the vector between its ends, and heat of the dashpot.

    ``d`` is the vector between the ends [mm], ``u`` their relative velocity [mm/s]. The force is ``f d`` with the
    first result ``f`` [N/mm]. The dashpot acts on the initial length: force ``c (d . u) d``, heat ``c (d . u)^2``
    [N mm/s] with ``c`` = ``viscosity`` [N s/mm3] (docs/theory/dynamics.md).
    """
    squared = dx * dx + dy * dy + dz * dz
    inverse = inverse_root(squared)
    pull = connector_force(
        coefficients, degree, pieces, width, end_slope, slack_slope, squared * inverse * inverse_length - 1.0
    )
    rate = dx * ux + dy * uy + dz * uz
    drag = viscosity * rate
    return pull * inverse + drag, drag * rate
