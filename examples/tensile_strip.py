"""A tensile strip along the warp, beside the curve of the card.

Lines of connectors side by side share the specimen's force, the connectors of a line share its elongation (Eq. 11).
A strip made of them therefore returns the card's curve whatever the cell length. Run it with:
python examples/tensile_strip.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from weftform import Fabric, Study, run

ELONGATIONS = (1.0, 2.0, 3.0, 3.9)
"""Where the two curves are compared [mm]."""


def main(cell_length: float = 5.0) -> float:
    """Pull the strip and return the largest relative difference from the card's curve."""
    law = Fabric.load("hexforce-48600-c1300").warp
    with tempfile.TemporaryDirectory() as scratch:
        # many rows: the force of a row is the mean since the row before, its displacement that at the end
        changes = {"specimen.cell_length_mm": cell_length, "output.rows": 1001}
        study = Study.load("tensile-warp", changes)
        history = run(study, Path(scratch) / "strip").history
        computed = np.interp(ELONGATIONS, history["displacement_mm"], history["force_N"])
    expected = law.force(np.array(ELONGATIONS))
    print("  elongation [mm]  strip [N]   card [N]")
    for u, f, wanted in zip(ELONGATIONS, computed, expected, strict=True):
        print(f"{u:17.1f}{f:11.1f}{wanted:11.1f}")
    return float(np.max(np.abs(computed / expected - 1.0)))


if __name__ == "__main__":
    print(f"largest difference {100 * main():.2f} %")
