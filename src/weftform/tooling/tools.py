"""Rigid tools as rounded edges of revolution (:mod:`weftform.mechanics.contact`), placed against a flat fabric at
z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RigidTool:
    """A rigid tool of revolution about z that touches the flat fabric at the start.

    Attributes
    ----------
    name
        As in the study.
    side_s, s0, side_z, z0, radius
        Rounded edge; z0 is relative to the tool's own position, which is 0 at the start [mm].
    up
        +1 where the tool is below the fabric and closes upwards, -1 above.
    motion
        ``fixed``, ``stroke`` or ``force``.
    friction, stiffness, tangential_ratio
        Contact with the fabric: Coulomb coefficient, penalty [N/mm3], tangential share of it.
    force
        On the whole blank [N], for ``force``.
    mass
        Of the tool [tonne], for ``force``; None lets the solver choose.
    """

    name: str
    side_s: float
    s0: float
    side_z: float
    z0: float
    radius: float
    up: float
    motion: Literal["fixed", "stroke", "force"]
    friction: float
    stiffness: float
    tangential_ratio: float
    force: float = 0.0
    mass: float | None = None

    def profile(self, reach: float, depth: float) -> Floats:
        """Outline of the tool in the half plane (s, z) for drawing, shape [points, 2] [mm]."""
        turn = np.linspace(0.0, 0.5 * np.pi, 25)
        edge_s = self.s0 + self.side_s * self.radius * np.sin(turn)
        edge_z = self.z0 + self.side_z * self.radius * np.cos(turn)
        flat_s = 0.0 if self.side_s > 0 else max(reach, self.s0)
        start = [flat_s, self.z0 + self.side_z * self.radius]
        end = [self.s0 + self.side_s * self.radius, self.z0 - self.side_z * depth]
        return np.vstack([start, np.column_stack([edge_s, edge_z]), end])


def hemisphere(diameter: float, thickness: float, up: float) -> tuple[float, float, float, float, float]:
    """Hemisphere with its shank, tip on the fabric's surface: rounded edge on the axis."""
    return flat_punch(diameter, 0.5 * diameter, thickness, up)


def flat_punch(
    diameter: float, edge_radius: float, thickness: float, up: float
) -> tuple[float, float, float, float, float]:
    """Cylinder with a rounded edge, its face on the fabric's surface."""
    return 1.0, 0.5 * diameter - edge_radius, up, -up * (0.5 * thickness + edge_radius), edge_radius


def opening(
    hole_diameter: float, edge_radius: float, thickness: float, up: float
) -> tuple[float, float, float, float, float]:
    """Flat face with a round hole and a fillet, its face on the fabric's surface."""
    return -1.0, 0.5 * hole_diameter + edge_radius, up, -up * (0.5 * thickness + edge_radius), edge_radius
