"""Comparison of the simulated hemispheres with the paper, with the net of the sphere and with each other."""

from __future__ import annotations

import numpy as np

from weftform.reproduction.items import Item
from weftform.reproduction.net import sphere_net_angle
from weftform.reproduction.simulated import Results


def hemisphere_items(results: Results) -> list[Item]:
    """The hemisphere in both orientations (Sec. 4); its figures did not survive, so few numbers can be compared."""
    items = []
    for run, yarns in (("hemisphere-0-90", "0/90"), ("hemisphere-45", "+-45")):
        section = f"Hemisphere, {yarns} degrees"
        result = results[run]
        summary = result.summary
        radius = 25.0 + 0.5 * result.fabric.thickness
        points = [(10.0, 10.0), (15.0, 15.0), (10.0, 20.0), (20.0, 20.0)]
        for (u, v), probe in zip(points, result.probe(points), strict=True):
            items.append(
                Item(
                    section,
                    f"shear angle at the yarn point ({u:g}, {v:g}) mm on the dome (deg)",
                    "kinematic net of the sphere",
                    float(np.degrees(sphere_net_angle(u, v, radius))),
                    probe.shear_angle_deg,
                    1.0,
                    absolute=True,
                )
            )
        items += [
            Item(section, "largest shear angle (deg)", "Figs. 15 and 16", None, summary["shear_angle_deg"]["max"]),
            Item(section, "draw-in on the x axis (mm)", "Figs. 15 and 16", None, summary["draw_in_mm"]["edge_x"]),
            Item(section, "draw-in at the corner (mm)", "Figs. 15 and 16", None, summary["draw_in_mm"]["corner"]),
            Item(section, "punch force at 30 mm (N)", "not in the paper", None, summary["punch_force_N"]),
            Item(
                section,
                "share of the work that the ledger misses",
                "energy balance",
                0.0,
                summary["energy"]["balance_error"],
                0.01,
            ),
            Item(
                section,
                "kinetic over internal energy",
                "quasi-static",
                0.0,
                summary["energy"]["kinetic_over_internal"],
                0.05,
            ),
            Item(
                section, "penetration over thickness", "contact", 0.0, summary["penetration_share_of_thickness"], 0.05
            ),
        ]
    return items


def convergence_items(results: Results) -> list[Item]:
    """The hemisphere at 0/90 with other meshes, at a third of the speed and as a full model, against the shipped study."""
    section = "Hemisphere, 0/90 degrees: mesh, speed and symmetry"
    base = results["hemisphere-0-90"].summary
    items = []
    for run, what in (
        ("hemisphere-coarse", "cells 1.4 times larger"),
        ("hemisphere-fine", "cells 1.4 times smaller"),
        ("hemisphere-slow", "a third of the speed"),
    ):
        found = results[run].summary
        items += [
            Item(
                section,
                f"{what}: {quantity}",
                "shipped study",
                base[table][key],
                found[table][key],
                most,
                absolute=True,
            )
            for quantity, table, key, most in (
                ("largest shear angle (deg)", "shear_angle_deg", "max", 1.0),
                ("draw-in on the x axis (mm)", "draw_in_mm", "edge_x", 0.3),
                ("draw-in at the corner (mm)", "draw_in_mm", "corner", 0.3),
            )
        ]
        force = base["punch_force_N"], found["punch_force_N"]
        items.append(Item(section, f"{what}: punch force at 30 mm (N)", "shipped study", *force))
    points = [(float(u), float(v)) for u in range(0, 73, 8) for v in range(0, 73, 8)]
    quarter, full = (
        np.array([point.shear_angle_deg for point in results[run].probe(points)])
        for run in ("hemisphere-0-90", "hemisphere-full")
    )
    items += [
        Item(
            section,
            f"full against quarter model: largest difference of the shear angle over {len(points)} points (deg)",
            "symmetry",
            0.0,
            float(np.abs(full - quarter).max()),
            0.2,
        ),
        Item(
            section,
            "full against quarter model: punch force (N)",
            "quarter model",
            base["punch_force_N"],
            results["hemisphere-full"].summary["punch_force_N"],
            0.02,
        ),
    ]
    return items
