"""Comparison with the paper's equations and their printing errors: no simulation needed."""

from __future__ import annotations

import numpy as np

from weftform.fabric import Fabric
from weftform.laboratory.kinematics import bias_force, kinematic_angle, kinematic_displacement, kinematic_limit
from weftform.laboratory.point_by_point import normalised_shear_force
from weftform.reproduction.items import Item

HEIGHT, WIDTH = 150.0, 50.0
EQ_9 = (0.0829, -0.6723, 3.0133, -5.9826, 4.588)
EQ_10 = (0.0829, -1.3447, 9.0399, -23.9304, 22.9438)
EQ_4_PRINTED = (-3.446, 19.75, -123.13, 573.0, -170.85)


def law_items(fabric: Fabric) -> list[Item]:
    """Eqs. 2, 4, 5, 8, 9, 10 and 11."""
    section = "Equations"
    items = []
    shear = fabric.card.shear.coefficients or []
    thickness = fabric.thickness
    for k, (found, printed) in enumerate(zip(shear, EQ_9, strict=True), 1):
        items.append(
            Item(
                section,
                f"Eq. 9, coefficient of gamma^{k} (MPa)",
                "Eq. 9",
                printed,
                found / thickness,
                1e-3,
                remark="Eq. 8 over the thickness of 0.62 mm",
            )
        )
    for k, (found, printed) in enumerate(zip(shear, EQ_10, strict=True), 1):
        power = f" of gamma^{k - 1}" if k > 1 else ", constant"
        items.append(
            Item(
                section,
                f"Eq. 10, coefficient{power} (MPa)",
                "Eq. 10",
                printed,
                k * found / thickness,
                1e-3,
                remark="derivative of Eq. 9",
            )
        )
    elongation = fabric.warp.specimen_force.valid_to / fabric.warp.length
    lines = fabric.warp.width / 1.0 + 1.0
    items += [
        Item(
            section,
            "Uc_max for l0 = 1 mm (mm)",
            "Sec. 3.2",
            0.026,
            elongation,
            1e-6,
            remark="Eq. 11: 3.9 mm over N = 150",
        ),
        Item(
            section,
            "Fc_max for l0 = 1 mm (N)",
            "Sec. 3.2",
            215.47,
            float(fabric.warp.force(3.9)) / lines,
            1e-3,
            remark="Eq. 11: repaired Eq. 4 over n + 1 = 51 lines; 215.47 with a0 = -3.446 N, which the card leaves out",
        ),
        Item(
            section,
            "kinematic shear angle at 16.55 mm (deg)",
            "Eq. 2",
            21.0,
            float(np.degrees(kinematic_angle(16.55, HEIGHT, WIDTH))),
            1e-2,
        ),
        Item(
            section,
            "end of the kinematic range (mm)",
            "Eq. 2",
            100.0 * (np.sqrt(2.0) - 1.0),
            kinematic_limit(HEIGHT, WIDTH),
            1e-9,
        ),
    ]
    angle = np.radians(np.linspace(0.05, 40.0, 2000))
    force = bias_force(angle, shear, HEIGHT, WIDTH)
    back = normalised_shear_force(angle, force, HEIGHT, WIDTH)
    for degrees in (10.0, 20.0, 35.0):
        items.append(
            Item(
                section,
                f"F_sh at {degrees:g} deg recovered by Eq. 5 from forces made with Eq. 8 (N/mm)",
                "Eq. 8",
                float(fabric.normalised_shear_force(np.radians(degrees))),
                float(np.interp(np.radians(degrees), angle, back)),
                5e-3,
                remark="round trip, point by point",
            )
        )
    return items


def misprints(fabric: Fabric) -> list[Item]:
    """Known printing errors, both values side by side; none has to agree."""
    section = "Printing errors of the paper"
    printed = np.polynomial.Polynomial(EQ_4_PRINTED)
    return [
        Item(
            section,
            "F(3.9 mm) of Eq. 4 as printed (N)",
            "Sec. 3.2: 215.47 N x 51 lines",
            215.47 * 51.0,
            float(printed(3.9)),
            remark="the printed a4 = -170.85 makes the force negative; a4 = -91.645 meets the text",
        ),
        Item(
            section,
            "E ln 2 with the printed E = 34 500 MPa (MPa)",
            "Table 2",
            24500.0,
            34500.0 * np.log(2.0),
            remark="the stresses of Table 2 are those of E = 35 400 MPa",
        ),
        Item(
            section,
            "kinematic shear angle at 21 mm (deg)",
            "Sec. 2.4.2: 21 deg",
            21.0,
            float(np.degrees(kinematic_angle(21.0, HEIGHT, WIDTH))),
            remark="two events: slip at 21 mm is 27.65 deg of kinematic shear",
        ),
        Item(
            section,
            "displacement at a kinematic angle of 21 deg (mm)",
            "Sec. 3.6: 21 mm",
            21.0,
            float(kinematic_displacement(np.radians(21.0), HEIGHT, WIDTH)),
            remark="likewise",
        ),
        Item(
            section,
            "C_s(gamma / 2) / F_sh(gamma / 2) at gamma = 30 deg",
            "formula before Eq. 5: cos(gamma)",
            float(np.cos(np.radians(30.0))),
            float(np.cos(np.radians(15.0))),
            remark="must be cos(gamma / 2); Eq. 5 has it right",
        ),
        Item(
            section,
            "imposed displacement of the tensile strip (mm)",
            "Sec. 3.2: U = 39 mm",
            39.0,
            3.9,
            remark="3.9 mm, as Uc_max = 3.9 / 150 = 0.026 mm says",
        ),
        Item(
            section,
            "displacement that the yarns can follow in the bias test (mm)",
            "Sec. 2.3.1: up to 50 mm",
            50.0,
            kinematic_limit(HEIGHT, WIDTH),
            remark="beyond it the yarns slip",
        ),
    ]
