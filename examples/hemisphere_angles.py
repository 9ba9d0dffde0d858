"""Shear angles on the dome of the hemisphere, beside the exact kinematic net.

A blank of stiff yarns that lies on a sphere can only follow the net of Chebyshev: the shear angle at the material
point (u, v) is a function of u v / R^2 alone. The mechanical answer has to come close to it where the fabric lies on
the punch. Run it with: python examples/hemisphere_angles.py
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from weftform import Study, run

POINTS = [(5.0, 5.0), (7.5, 7.5), (10.0, 10.0), (12.5, 12.5), (5.0, 15.0), (15.0, 5.0)]
"""Material points on the dome [mm along warp, mm along weft]."""


def kinematic_angle(u: float, v: float, radius: float) -> float:
    """Shear angle [degrees] of the net on a sphere: ``z f'' + f' + sin f = 0``, ``f(0) = pi / 2``, ``z = u v / R^2``."""
    z_end = u * v / radius**2
    start = 1e-6  # near zero f = pi/2 - z
    found = solve_ivp(
        lambda z, y: (y[1], -(y[1] + math.sin(y[0])) / z),
        (start, z_end),
        (0.5 * math.pi - start, -1.0),
        rtol=1e-9,
        atol=1e-12,
    )
    return math.degrees(0.5 * math.pi - found.y[0, -1])


def main(folder: str | Path | None = None, cell_length: float = 5.0) -> float:
    """Form the hemisphere and return the largest difference from the kinematic net [degrees]."""
    with tempfile.TemporaryDirectory() as scratch:
        study = Study.load("hemisphere-0-90", {"blank.cell_length_mm": cell_length})
        result = run(study, folder or Path(scratch) / "hemisphere")
        tool_radius = 0.5 * study.model.tools["punch"].diameter_mm
        radius = tool_radius + 0.5 * study.fabric.thickness  # the mid-surface lies half a thickness above the punch
        differences = []
        print("    u [mm]    v [mm]  computed [deg]  kinematic [deg]")
        for (u, v), point in zip(POINTS, result.probe(POINTS), strict=True):
            net = kinematic_angle(u, v, radius)
            print(f"{u:10.1f}{v:10.1f}{point.shear_angle_deg:16.2f}{net:17.2f}")
            differences.append(abs(point.shear_angle_deg - net))
    return float(np.max(differences))


if __name__ == "__main__":
    print(f"largest difference {main():.2f} degrees")
