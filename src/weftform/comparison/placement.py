"""Where the axes of a measurement lie in the axes of the press."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Placement:
    """A turn about the axis of the press, a shift and a scale: ``press = scale * turn(measured) + shift``.

    Attributes
    ----------
    turn_deg
        About z, from x to y.
    shift_mm
        Of the origin of the measured axes, (x, y, z).
    scale
        1 unless it was asked for.
    by
        What it was found from: ``outline``, ``markers`` or ``none``.
    rms_mm
        What is left: root mean square distance between what was laid over each other; NaN where nothing was.
    as_good_deg
        Turns that fit as well, because the shape is (nearly) symmetric.
    turn_known
        False where the shape is round, so that no turn can be found.
    """

    turn_deg: float = 0.0
    shift_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale: float = 1.0
    by: str = "none"
    rms_mm: float = float("nan")
    as_good_deg: tuple[float, ...] = ()
    turn_known: bool = True

    def apply(self, points: Floats) -> Floats:
        """Measured points in the axes of the press [mm], shape [n, 2] or [n, 3]."""
        turn = np.radians(self.turn_deg)
        c, s = np.cos(turn), np.sin(turn)
        placed = self.scale * np.array(points, float)
        x, y = placed[..., 0].copy(), placed[..., 1].copy()
        placed[..., 0], placed[..., 1] = c * x - s * y, s * x + c * y
        return np.asarray(placed + np.array(self.shift_mm)[: placed.shape[-1]])

    def words(self) -> str:
        """How the measured axes were placed."""
        if self.by == "none":
            return "Measured positions as they are."
        x, y, _ = self.shift_mm
        scale = f", scaled by {self.scale:.5g}" if self.scale != 1.0 else ""
        return (
            f"Measured axes placed by the {self.by}: turned by {self.turn_deg:.2f}°, "
            f"shifted by ({x:.2f}, {y:.2f}) mm{scale}."
        )

    def as_dict(self) -> dict[str, Any]:
        """For ``comparison.json``."""
        return {
            "by": self.by,
            "turn_deg": self.turn_deg,
            "shift_mm": list(self.shift_mm),
            "scale": self.scale,
            "rms_mm": self.rms_mm if np.isfinite(self.rms_mm) else None,
            "as_good_deg": list(self.as_good_deg),
            "turn_known": self.turn_known,
        }


def wrapped(degrees: float) -> float:
    """A turn between -180 and 180 degrees."""
    return float(180.0 - (180.0 - degrees) % 360.0)
