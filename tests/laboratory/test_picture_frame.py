"""Picture frame: the normalisation inverts, and every laboratory of Cao et al. (2008) gives a card."""

from __future__ import annotations

import numpy as np
import pytest
from paper_equations import eq8

from weftform.errors import MeasurementError
from weftform.fabric import Fabric
from weftform.laboratory import Quantity, Reading, characterise_picture_frame, read_table, sample
from weftform.laboratory.card_file import provenance, write_card
from weftform.laboratory.kinematics import frame_angle, frame_lever

SIZE = {"frame_side": 150.0, "fabric_side": 110.0, "thickness": 0.62}
LABORATORIES = ("HKUST", "KUL 1st", "KUL 3rd", "LMSP", "UML", "UN", "UT")


def _curve():
    d = np.linspace(0.0, 65.0, 200)
    g = frame_angle(d, 150.0)
    return d, g, frame_lever(g, 150.0, 110.0) * eq8(g)


def test_three_kinds_of_table_give_the_same_law(write) -> None:
    d, g, force = _curve()
    files = {
        "force-displacement": write("a.csv", d, force),
        "force-angle": write("b.csv", np.degrees(g), force, "shear_angle_deg,force_N"),
        "normalised": write("c.csv", np.degrees(g), eq8(g), "shear_angle_deg,normalised_shear_force_N_per_mm"),
    }
    at = np.radians(np.linspace(2.0, 40.0, 50))
    for kind, path in files.items():
        found = characterise_picture_frame([path], law="polynomial", **SIZE)
        assert found.measured == kind
        np.testing.assert_allclose(found.shear.normalised_force(at), eq8(at), rtol=1e-3)
        table = characterise_picture_frame([path], **SIZE)
        np.testing.assert_allclose(table.shear.normalised_force(at), eq8(at), rtol=0.05)
        assert table.shear.modulus_positive
    np.testing.assert_allclose(found.force(g), force, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("law", ["tabulated", "polynomial"])
@pytest.mark.parametrize("laboratory", LABORATORIES)
def test_every_laboratory_of_cao_yields_a_valid_card(laboratory, law, tmp_path) -> None:
    path = sample("cao2008-picture-frame")
    reading = Reading(only=(laboratory,))
    found = characterise_picture_frame(path, frame_side=100, fabric_side=100, thickness=1.2, law=law, reading=reading)
    line = {
        "law": "linear",
        "stiffness_N_per_mm": 1e4,
        "specimen_length_mm": 100.0,
        "specimen_width_mm": 100.0,
    }
    card = tmp_path / "card.toml"
    write_card(
        card,
        {("shear",): found.card_table()},
        {
            "shear": provenance(
                "picture-frame", found.specimens, found.shear.fit, found.interval_deg, "deg", "N_per_mm", ()
            )
        },
        defaults={
            ("fabric", "areal_weight_g_m2"): 743.0,
            ("fabric", "thickness_mm"): 1.2,
            ("tension", "warp"): line,
            ("tension", "weft"): {"same_as": "warp"},
        },
    )
    fabric = Fabric.load(card)
    columns = [Quantity.SHEAR_ANGLE, Quantity.NORMALISED_SHEAR_FORCE]
    table = read_table(path[0], columns, optional=[Quantity.SPECIMEN])
    own = np.array(table.names[Quantity.SPECIMEN]) == laboratory
    angle, force = (table.values[q][own] for q in columns)
    inside = np.radians(angle) <= fabric.shear.valid_to
    misfit = fabric.normalised_shear_force(np.radians(angle[inside])) - force[inside]
    # The scatter between the laboratories is some tens of per cent; reading the figure off costs about 1 %
    # of its range.
    limit = 0.01 if law == "tabulated" else 0.03
    assert np.sqrt(np.mean(misfit**2)) < limit * force.max()
    assert inside.mean() > 0.9


def test_law_reaches_the_last_rising_point_and_follows_the_first_degrees(write) -> None:
    """The largest force lies between two places of the grid of the mean; friction starts the curve with a step."""
    found = characterise_picture_frame(
        sample("cao2008-picture-frame"), frame_side=100, fabric_side=100, thickness=1.2, reading=Reading(only=("UT",))
    )
    assert found.interval_deg[1] == pytest.approx(33.13) and any("falls beyond 33.13 deg" in w for w in found.warnings)
    angle = np.linspace(0.0, 45.0, 91)
    force = np.where(angle > 0.0, 0.01, 0.0) + 0.0002 * angle
    path = write("step.csv", angle, force, "shear_angle_deg,normalised_shear_force_N_per_mm")
    law = characterise_picture_frame([path], **SIZE).shear
    at = angle[2:]
    np.testing.assert_allclose(law.normalised_force(np.radians(at)), force[2:], rtol=0.02)


def test_laboratories_together_give_their_scatter() -> None:
    found = characterise_picture_frame(sample("cao2008-picture-frame"), frame_side=100, fabric_side=100, thickness=1.2)
    assert len(found.specimens) == 7 and len(found.curves) == 7
    assert (found.mean.deviation > 0).all() and found.shear.modulus_positive


def test_frames_that_are_none(write) -> None:
    d, g, force = _curve()
    path = write("a.csv", d, force)
    with pytest.raises(MeasurementError, match="make no picture frame"):
        characterise_picture_frame([path], frame_side=100, fabric_side=120, thickness=1.0)
    with pytest.raises(MeasurementError, match="closed at") as caught:
        characterise_picture_frame([path], frame_side=100, fabric_side=80, thickness=1.0)
    assert caught.value.line is not None
    with pytest.raises(MeasurementError, match="shear angle of"):
        characterise_picture_frame([write("b.csv", np.degrees(g) * 60, force, "shear_angle_deg,force_N")], **SIZE)
    with pytest.raises(MeasurementError, match="no column for force_N"):
        characterise_picture_frame([write("c.csv", d, force, "displacement_mm,stress")], **SIZE)
