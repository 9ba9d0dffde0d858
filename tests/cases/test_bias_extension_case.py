"""The bias-extension test on coarse cells, and what it refuses and warns of."""

from __future__ import annotations

import numpy as np
import pytest

from weftform.cases import case_of
from weftform.errors import StudyError
from weftform.execution import run
from weftform.laboratory.kinematics import kinematic_limit
from weftform.study import Study

# In 0.1 s, the speed of the shipped study, kinetic energy is 36 % of the internal at 10 mm and C differs by 2 %.
COARSE = {
    "specimen.cell_length_mm": 6.0,
    "loading.displacement_mm": 10.0,
    "loading.duration_s": 0.4,
    "output.frames": 3,
    "output.rows": 41,
}


@pytest.fixture(scope="module")
def strip(tmp_path_factory):
    return run(Study.load("bias-extension", COARSE), tmp_path_factory.mktemp("bias") / "out", threads=1)


def test_halves_are_symmetric_within_1_percent(strip):
    for zone in "abc":
        upper, lower = (strip.summary[f"shear_angle_zone_{zone}_{half}_deg"] for half in ("upper", "lower"))
        kinematic = strip.summary["shear_angle_kinematic_deg"]
        assert upper == pytest.approx(lower, rel=0.01, abs=0.001 * kinematic), zone


def test_zones_shear_as_the_kinematics_say(strip):
    """B by the kinematic angle, C by half of it, A hardly; on coarse cells and with yarns that give."""
    s = strip.summary
    kinematic = s["shear_angle_kinematic_deg"]
    stretch = 1.0 + 10.0 / 100.0
    assert kinematic == pytest.approx(np.degrees(np.arcsin(stretch**2 - 1.0)), rel=1e-6)
    assert s["shear_angle_zone_b_deg"] == pytest.approx(kinematic, rel=0.05)
    assert s["shear_angle_zone_c_deg"] == pytest.approx(0.5 * kinematic, rel=0.25)
    assert abs(s["shear_angle_zone_a_deg"]) < 0.2 * kinematic


def test_specimen_narrows_and_pulls_back(strip):
    history = strip.history
    assert history["width_mm"][0] == pytest.approx(50.0, rel=1e-3)
    assert history["width_mm"][-1] < 47.0
    assert strip.summary["force_N"] > 0.0
    assert strip.summary["energy"]["balance_error"] < 0.01


@pytest.mark.parametrize("length", [50.0, 99.0])
def test_specimen_shorter_than_two_widths_is_refused(length):
    with pytest.raises(StudyError, match="no zone of pure shear") as caught:
        Study.load("bias-extension", {"specimen.length_mm": length})
    assert caught.value.key == "specimen.length_mm"
    assert "100 mm" in caught.value.expected


def test_displacement_beyond_the_kinematic_end_warns():
    end = kinematic_limit(150.0, 50.0)
    assert end == pytest.approx(100.0 * (2.0**0.5 - 1.0))
    assert case_of(Study.load("bias-extension", {"loading.displacement_mm": end - 0.1})).warnings() == []
    (warning,) = case_of(Study.load("bias-extension", {"loading.displacement_mm": end + 0.1})).warnings()
    assert "kinematic end" in warning and "41.42" in warning
