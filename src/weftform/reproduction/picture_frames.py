"""Real picture-frame tests: a card from each laboratory of Cao et al. (2008), and the same test made by simulation.

Cao J. et al. (2008), Characterization of mechanical behavior of woven fabrics: experimental methods and benchmark
results, Composites Part A 39:1037-1053; plain weave Twintex TPEET22, 743 g/m2, 1.2 mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from weftform.laboratory import Quantity, Reading, characterise_picture_frame, read_table, sample
from weftform.laboratory.card_file import provenance, write_card
from weftform.laboratory.kinematics import bias_design, kinematic_displacement
from weftform.laboratory.scatter import point_scatter
from weftform.laboratory.specimen import Specimen, read_specimens
from weftform.reproduction.items import Item
from weftform.reproduction.simulated import value_at
from weftform.result import Result

Floats = NDArray[np.float64]

TOGETHER = "all laboratories"
"""Name of the card made from all tables at once."""
SECTION = "Real picture frames (Cao et al. 2008)"
THICKNESS, AREAL_WEIGHT = 1.2, 743.0
STIFFNESS = 5000.0
"""Tension per width and unit strain [N/mm], which a shear test does not tell: about that of the paper's fabric. Shear
forces do not depend on it as long as the yarns hardly stretch."""
BIAS = (150.0, 50.0)
"""Height and width of the virtual bias specimens [mm]."""
BIAS_CAO = (("100x300", 300.0, 100.0), ("150x300", 300.0, 150.0))
"""Name in the table, height and width [mm] of the measured bias specimens."""


@dataclass(frozen=True, eq=False)
class FrameTable:
    """The table of one laboratory: shear angle [deg] and normalised shear force [N/mm], shape [n] each."""

    laboratory: str
    angle: Floats
    force: Floats

    @property
    def rising(self) -> FrameTable:
        """The table up to its largest force; a law that falls beyond would be no law."""
        end = int(np.argmax(self.force)) + 1
        return FrameTable(self.laboratory, self.angle[:end], self.force[:end])


def frame_tables() -> tuple[FrameTable, ...]:
    """The tables of the shipped sample, one per laboratory, in the order of the file."""
    columns = [Quantity.SHEAR_ANGLE, Quantity.NORMALISED_SHEAR_FORCE]
    table = read_table(sample("cao2008-picture-frame")[0], columns, optional=[Quantity.SPECIMEN])
    names = np.array(table.names[Quantity.SPECIMEN])
    angle, force = (table.values[q] for q in columns)
    return tuple(FrameTable(str(n), angle[names == n], force[names == n]) for n in dict.fromkeys(names))


def write_cards(folder: Path) -> dict[str, Path]:
    """Characterise the tables and write one card per laboratory, and one of all together; returns them by laboratory.

    What ``weftform characterise picture-frame cao2008-picture-frame-plain.csv --only LABORATORY --height 100 --width 100
    --thickness 1.2 --areal-weight 743 --tension-stiffness 5000`` does. The table is normalised, so the sides of the
    frame do not matter.
    """
    folder.mkdir(parents=True, exist_ok=True)
    line = {"law": "linear", "specimen_length_mm": 100.0, "specimen_width_mm": 100.0}
    line |= {"stiffness_N_per_mm": STIFFNESS, "source": "assumed, not measured"}
    cards = {}
    for name in (*(t.laboratory for t in frame_tables()), TOGETHER):
        found = characterise_picture_frame(
            sample("cao2008-picture-frame"),
            frame_side=100.0,
            fabric_side=100.0,
            thickness=THICKNESS,
            reading=Reading(only=() if name == TOGETHER else (name,)),
        )
        origin = provenance(
            "picture-frame",
            found.specimens,
            found.shear.fit,
            found.interval_deg,
            "deg",
            "N_per_mm",
            found.warnings,
        )
        cards[name] = folder / f"twintex-{name.lower().replace(' ', '-')}.toml"
        cards[name].unlink(missing_ok=True)  # a former reproduction in the same folder
        write_card(
            cards[name],
            {("shear",): found.card_table()},
            {"shear": origin},
            defaults={
                ("fabric", "areal_weight_g_m2"): AREAL_WEIGHT,
                ("fabric", "thickness_mm"): THICKNESS,
                ("tension", "warp"): line,
                ("tension", "weft"): {"same_as": "warp"},
            },
        )
    return cards


def frame_runs(cards: Mapping[str, Path]) -> dict[str, tuple[str, tuple[str, ...]]]:
    """The virtual tests: name of each run, its shipped study and what is changed in it."""
    runs: dict[str, tuple[str, tuple[str, ...]]] = {}
    for table in frame_tables():
        card = f"fabric.card={cards[table.laboratory]}"
        end = float(table.rising.angle[-1])
        # the field is uniform, so nine cells do
        runs[f"frame-{table.laboratory}"] = (
            "picture-frame",
            (card, f"loading.shear_angles_deg=[{end}]", "specimen.cell_length_mm=50", "output.frames=2"),
        )
        height, width = BIAS
        runs[f"frame-bias-{table.laboratory}"] = ("bias-extension", (card, *_bias_changes(height, width, 9.0)))
    for name, height, width in BIAS_CAO:
        card = f"fabric.card={cards[TOGETHER]}"
        runs[f"frame-bias-{name}"] = ("bias-extension", (card, *_bias_changes(height, width, 12.0)))
    return runs


def _bias_changes(height: float, width: float, cell: float) -> tuple[str, ...]:
    """A bias test to 28 degrees of kinematic shear, four times as slow as the shipped one: some of these cloths hardly
    resist for the first ten degrees, and inertia must be small beside that."""
    end = float(kinematic_displacement(np.radians(28.0), height, width))
    return (
        f"specimen.length_mm={height}",
        f"specimen.width_mm={width}",
        f"specimen.cell_length_mm={cell}",
        f"loading.displacement_mm={end:.6g}",
        "loading.duration_s=1.6",
        "output.rows=81",
        "output.frames=2",
    )


def measured_bias() -> dict[str, Specimen]:
    """Raw force [N] against displacement [mm] of the measured bias specimens by their names."""
    specimens = read_specimens(sample("cao2008-bias-extension"), Quantity.DISPLACEMENT, Quantity.FORCE)
    return {s.name.split(": ")[-1]: s for s in specimens}


def virtual_curve(result: Result) -> tuple[Floats, Floats]:
    """Shear angle [deg] and normalised shear force [N/mm] of a virtual picture frame."""
    return result.history["shear_angle_frame_deg"], result.history["normalised_shear_force_N_per_mm"]


def real_frame_items(results: Mapping[str, Result]) -> list[Item]:
    """Each virtual frame beside the table its card was made from; each virtual bias test beside its closed form."""
    items = []
    tables = frame_tables()
    for table in tables:
        rising = table.rising
        found = np.interp(rising.angle, *virtual_curve(results[f"frame-{table.laboratory}"]))
        items.append(
            Item(
                SECTION,
                f"{table.laboratory}: virtual frame minus table, rms to {rising.angle[-1]:.3g} deg (N/mm)",
                f"its {len(rising.angle)} points",
                0.0,
                float(np.sqrt(np.mean((found - rising.force) ** 2))),
                point_scatter(rising.angle, rising.force),
                remark=f"the limit is the scatter of the points themselves; the largest force is {rising.force[-1]:.3g} N/mm",
            )
        )
    angle = np.radians(26.0)
    height, width = BIAS
    for table in tables:
        result = results[f"frame-bias-{table.laboratory}"]
        items.append(
            Item(
                SECTION,
                f"{table.laboratory}: virtual bias test {height:g} x {width:g} mm, force at 26 deg (N)",
                "three uniform zones, inextensible",
                _zones(result, height, width, angle),
                _force_at(result, height, width, angle),
                0.05,
            )
        )
    for name, height, width in BIAS_CAO:
        specimen = measured_bias()[name]
        d = float(kinematic_displacement(angle, height, width))
        items.append(
            Item(
                SECTION,
                f"{TOGETHER}: virtual bias test {height:g} x {width:g} mm, force at {d:.3g} mm (N)",
                "measured, raw",
                float(np.interp(d, specimen.x, specimen.y)),
                _force_at(results[f"frame-bias-{name}"], height, width, angle),
                remark="forces of the published bias and frame tables differ by a factor, see the head of the sample",
            )
        )
    return items


def _force_at(result: Result, height: float, width: float, angle: float) -> float:
    return value_at(result, float(kinematic_displacement(angle, height, width)))


def _zones(result: Result, height: float, width: float, angle: float) -> float:
    law = result.fabric.normalised_shear_force
    return float(bias_design(np.array([angle]), height, width, lambda g: law(g)[:, None])[0, 0])
