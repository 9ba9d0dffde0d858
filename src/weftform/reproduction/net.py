"""The exact kinematic net on a sphere: inextensible yarns draped from the pole."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

LARGEST = 1.5
"""Largest ``u v / R^2`` that is integrated; the yarns are parallel before."""


@cache
def _solution() -> Any:
    from scipy.integrate import solve_ivp

    start = 1.0e-6

    def slope(z: float, y: list[float]) -> list[float]:
        return [y[1], -(y[1] + np.sin(y[0])) / z]

    # series at the pole: f = pi/2 - z + O(z^3)
    return solve_ivp(
        slope, (start, LARGEST), [0.5 * np.pi - start, -1.0], rtol=1e-10, atol=1e-12, dense_output=True
    ).sol


def sphere_net_angle(u: float, v: float, radius: float) -> float:
    """Shear angle [rad] of the net at the yarn coordinates (u, v) [mm] on a sphere of ``radius`` [mm].

    ``gamma = pi/2 - f(u v / R^2)`` with ``z f'' + f' + sin f = 0`` and ``f(0) = pi/2``: the net of Chebyshev draped from two
    great circles through the pole.
    """
    z = abs(u * v) / radius**2
    if z < 1e-6:
        return 0.0
    if z > LARGEST:
        raise ValueError(f"u v / R^2 = {z:.3g} is beyond the net")
    return float((0.5 * np.pi - _solution()(z)[0]) * np.sign(u * v))
