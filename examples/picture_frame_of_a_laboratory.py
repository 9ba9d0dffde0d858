"""From a measured table to a card, to the same test made by simulation, to a picture of both.

The table is that of the laboratory UML in the benchmark of Cao et al. (2008, Composites Part A 39:1037-1053), a shipped
sample. Run it with: python examples/picture_frame_of_a_laboratory.py, and look at twintex-uml/frame.png.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from weftform import Study, run
from weftform.laboratory import Reading, characterise_picture_frame, sample
from weftform.laboratory.card_file import provenance, write_card

LABORATORY = "UML"
YARN = {"law": "linear", "stiffness_N_per_mm": 5000.0, "specimen_length_mm": 100.0, "specimen_width_mm": 100.0}
"""A shear test tells nothing of the tension, so it is assumed: N per mm of width and unit strain (100 x 100 mm)."""


def main(folder: Path) -> float:
    """Write card, result and picture into ``folder``; return the rms distance from the table over its largest force."""
    folder.mkdir(parents=True, exist_ok=True)
    found = characterise_picture_frame(
        sample("cao2008-picture-frame"),
        frame_side=100.0,  # the table is normalised already, so the sides do not matter
        fabric_side=100.0,
        thickness=1.2,
        reading=Reading(only=(LABORATORY,)),
    )
    print(f"locking angle {found.shear.stages.locking_deg:.1f} deg, law to {found.interval_deg[1]:.1f} deg")

    card = folder / "twintex-uml.toml"
    origin = provenance(
        "picture-frame", found.specimens, found.shear.fit, found.interval_deg, "deg", "N_per_mm", found.warnings
    )
    values = {
        ("fabric", "areal_weight_g_m2"): 743.0,
        ("fabric", "thickness_mm"): 1.2,
        ("tension", "warp"): YARN,
        ("tension", "weft"): {"same_as": "warp"},
    }
    write_card(card, {("shear",): found.card_table()}, {"shear": origin}, defaults=values)

    table = found.curves[0]  # shear angle [deg], normalised shear force [N/mm]
    changes = {
        "fabric.card": str(card),
        "loading.shear_angles_deg": [float(table.x[-1])],
        "specimen.cell_length_mm": 50.0,
    }
    history = run(Study.load("picture-frame", changes), folder / "result").history
    angle, force = history["shear_angle_frame_deg"], history["normalised_shear_force_N_per_mm"]
    picture(folder / "frame.png", table.x, table.y, angle, force)
    misfit = np.interp(table.x, angle, force) - table.y
    return float(np.sqrt(np.mean(misfit**2)) / table.y.max())


def picture(file: Path, x: np.ndarray, y: np.ndarray, angle: np.ndarray, force: np.ndarray) -> None:
    """The table and the virtual test on the same axes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(x, y, "o", mfc="none", color="0.4", label=f"measured, {LABORATORY}")
    axes.plot(angle, force, color="#0057b8", label="virtual picture frame")
    axes.set_xlabel("Shear angle [deg]")
    axes.set_ylabel("Normalised shear force [N/mm]")
    axes.grid(alpha=0.25)
    axes.legend()
    figure.savefig(file, dpi=150)


if __name__ == "__main__":
    print(f"rms distance from the table {100 * main(Path('twintex-uml')):.2f} % of its largest force")
