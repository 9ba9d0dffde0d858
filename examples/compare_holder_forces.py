"""What the blank-holder does: the same hemisphere with three holder forces.

Without bending and wrinkling the holder's force enters through friction only, so the punch force rises with it in a
straight line while the shear angles hardly change. Run it with: python examples/compare_holder_forces.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from weftform import Study, run

FORCES = (100.0, 238.45, 500.0)
"""Holder forces on the whole blank [N]."""


def main(cell_length: float = 7.5) -> float:
    """Run the three studies and return the newtons of punch force per newton of holder force."""
    punch_forces = []
    with tempfile.TemporaryDirectory() as scratch:
        print(" holder [N]  punch [N]  largest shear [deg]  draw-in on x [mm]")
        for force in FORCES:
            changes = {"blank.cell_length_mm": cell_length, "tools.blank_holder.force_N": force}
            result = run(Study.load("hemisphere-0-90", changes), Path(scratch) / f"holder-{force:g}")
            summary = result.summary
            punch_forces.append(summary["punch_force_N"])
            print(
                f"{force:11.2f}{summary['punch_force_N']:11.2f}{summary['shear_angle_deg']['max']:21.2f}"
                f"{summary['draw_in_mm']['edge_x']:19.2f}"
            )
    slope, _ = np.polyfit(FORCES, punch_forces, 1)
    return float(slope)


if __name__ == "__main__":
    print(f"{main():.3f} N of punch force per newton of holder force")
