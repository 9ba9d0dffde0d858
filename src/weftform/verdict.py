"""What a run says of itself: how well its energies close, where it left its laws, what blank it formed."""

from __future__ import annotations

import math

import numpy as np

from weftform.result.fields import Fields
from weftform.study import Study

MOST_IMBALANCE = 0.01
"""Largest share of the work that the ledger may miss."""
MOST_KINETIC = 0.05
"""Largest share of kinetic in internal energy once the fabric is loaded."""
LOADED_FROM = 0.01
"""The fabric counts as loaded once its internal energy exceeds this share of its largest value."""
MOST_PENETRATION = 0.05
"""Largest penetration into a tool as a share of the thickness."""

MUCH_INERTIA = 4.0
"""Factor on the mass from which the least step is what makes a run dynamic."""


def percent(share: float) -> str:
    """A share in percent, two digits, without powers of ten."""
    return f"{100.0 * share:.2g} %" if share < 1.0 else f"{100.0 * share:,.0f} %"


def doubts(energy: dict[str, float], penetration: float, *, inertia: float = 1.0, whole: bool = True) -> list[str]:
    """What casts doubt on a run, with what to change.

    Parameters
    ----------
    energy
        From :func:`energy_summary`.
    penetration
        Largest penetration as a share of the thickness.
    inertia
        Largest factor by which the least step has scaled the mass.
    whole
        Whether the run came to its end. Of a part the largest internal energy is not known, by which it is judged when the
        fabric is loaded and kinetic energy counts.
    """
    found = []
    if energy["balance_error"] > MOST_IMBALANCE:
        found.append(
            f"the energy ledger misses {percent(energy['balance_error'])} of the work (limit 1 %): lower solver.safety"
        )
    if whole and energy["kinetic_over_internal"] > MOST_KINETIC:
        found.append(
            f"kinetic energy reaches {percent(energy['kinetic_over_internal'])} of the internal energy (limit 5 %): "
            "lengthen loading.duration_s"
            + (
                f", or lower solver.least_step_s, which scales the mass by up to {inertia:.2g}"
                if inertia > MUCH_INERTIA
                else ""
            )
        )
    if penetration > MOST_PENETRATION:
        found.append(
            f"the fabric sinks {percent(penetration)} of its thickness into a tool (limit 5 %): raise "
            "contact.*.stiffness_N_per_mm3"
        )
    return found


def beyond_the_laws(fields: Fields) -> list[str]:
    """Which laws of the card are used beyond the range for which it gives them, where they go on straight."""
    notes = []
    fabric, share = fields.fabric, fields.grid.cell_share
    here = share > 0.0
    angle = np.abs(fields.shear_angle[here])
    beyond = angle > fabric.shear.valid_to * (1.0 + 1e-3)
    if beyond.any():
        part = float(share[here][beyond].sum() / share[here].sum())
        notes.append(
            f"{100 * part:.3g} % of the area shears beyond {np.degrees(fabric.shear.valid_to):.3g} deg, where the shear law "
            f"of the card ends (largest {np.degrees(angle.max()):.3g} deg): there it is continued by a straight line"
        )
    for name, law, strain in (("warp", fabric.warp, fields.warp_strain), ("weft", fabric.weft, fields.weft_strain)):
        end = law.specimen_force.valid_to / law.length
        largest = float(strain[here].max())
        if largest > end * (1.0 + 1e-3):
            notes.append(
                f"the {name} is stretched by {100 * largest:.3g} %, its law in the card ends at {100 * end:.3g} %: beyond, it is "
                "continued by a straight line"
            )
    return notes


def energy_summary(rows: list[dict[str, float]]) -> dict[str, float]:
    """Quality of the energy ledger over a history, and its last entry [mJ]."""
    if not rows:
        return {"balance_error": 0.0, "kinetic_over_internal": 0.0}
    work = max(abs(row["external_work_mJ"]) for row in rows)
    final = rows[-1]
    most = max(row["internal_energy_mJ"] for row in rows)
    loaded = [row for row in rows if row["internal_energy_mJ"] > LOADED_FROM * most > 0.0]
    return {
        "balance_error": max(abs(row["imbalance_mJ"]) for row in rows) / work if work > 0.0 else 0.0,
        "kinetic_over_internal": max(
            (row["kinetic_energy_mJ"] / row["internal_energy_mJ"] for row in loaded), default=0.0
        ),
        **{name: final[name] for name in final if name.endswith("_mJ")},
    }


def blank_summary(study: Study) -> dict[str, float | int | str]:
    """Size, mesh and area of the blank, and how far the mesh departs from the declared outline."""
    grid = study.grid
    return {
        "warp_cell_length_mm": grid.warp_pitch,
        "weft_cell_length_mm": grid.weft_pitch,
        "warp_angle_deg": math.degrees(grid.warp_angle),
        "symmetry": {1: "full", 2: "half", 4: "quarter"}[grid.copies],
        "half_cells": int((grid.cells > 1).sum()),
        "area_mm2": grid.area * grid.copies,
        "area_error": grid.area / grid.requested_area - 1.0,
        "mass_kg": 1e3 * study.fabric.areal_density * grid.area * grid.copies,
    }
