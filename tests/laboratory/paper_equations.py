"""The paper's equations as the tests use them."""

from __future__ import annotations

import numpy as np

from weftform.laboratory.kinematics import bias_force, kinematic_angle
from weftform.laboratory.samples import SHEAR, TENSILE


def eq4(u: np.ndarray) -> np.ndarray:
    """Eq. 4 with the repaired coefficient [N]."""
    return np.asarray(u)[:, None] ** np.arange(1, 5) @ np.array(TENSILE)


def eq8(gamma: np.ndarray) -> np.ndarray:
    """Eq. 8 [N/mm]."""
    return np.asarray(gamma)[:, None] ** np.arange(1, 6) @ np.array(SHEAR)


def bias_curve(end_mm: float = 29.0, rows: int = 150) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [mm] and force [N] of the paper's bias test for Eq. 8 without slip."""
    d = np.linspace(0.0, end_mm, rows)
    return d, bias_force(kinematic_angle(d, 150.0, 50.0), SHEAR, 150.0, 50.0)
