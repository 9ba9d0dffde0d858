"""The yarn between two crossings: a connector with a non-linear force, slack in compression.

The force is a function of the nominal strain (length / initial length - 1); Eq. 11 of the paper, which turns
the curve of a specimen into that function, belongs to :class:`weftform.fabric.Fabric`.
"""

from __future__ import annotations

from typing import Any

from weftform.mechanics.compiled import scalar
from weftform.mechanics.piecewise import piecewise_integral, piecewise_slope, piecewise_value


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
    length: float,
    rate: float,
    inverse_length: float,
    viscosity: float,
    coefficients: Any,
    degree: int,
    pieces: int,
    width: float,
    end_slope: float,
    slack_slope: float,
) -> tuple[float, float, float]:
    """Force of a connector, and of its dashpot: pull [N], drag per length [N/mm] and heat [N mm/s].

    With ``d`` the vector between the ends [mm] and ``u`` their relative velocity [mm/s], ``rate`` is ``d . u`` [mm2/s]; the force
    is ``(pull / length + drag) d``. The dashpot acts on the initial length: force ``c (d . u) d``, heat ``c (d . u)^2``
    with ``c`` = ``viscosity`` [N s/mm3] (docs/theory/dynamics.md).
    """
    strain = length * inverse_length - 1.0
    drag = viscosity * rate
    return connector_force(coefficients, degree, pieces, width, end_slope, slack_slope, strain), drag, drag * rate
