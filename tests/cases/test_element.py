"""One cell: the stresses of Tables 2 and 3."""

from __future__ import annotations

import math

import pytest

from weftform.execution import run
from weftform.study import Study

E = 35400.0
HYBRID_LOG = {
    "fabric.override.tension.warp.law": "log-strain",
    "fabric.override.tension.warp.stiffness_N_per_mm": 35400.0,
    "fabric.override.tension.warp.specimen_length_mm": 1.0,
    "fabric.override.tension.warp.specimen_width_mm": 1.0,
}


def element(name, folder, changes=()):
    return run(Study.load(name, changes), folder / "out", threads=1).summary["element"]


def test_simple_shear_lengthens_the_weft_to_root_2(tmp_path):
    """Table 2, test 1: the weft leans by 45 degrees at constant height. The Green-Naghdi components are those of the
    weft's direction turned back by the polar rotation, atan(1/2): 71.57 degrees, cos^2 = 0.1, sin^2 = 0.9."""
    found = element("element-shear", tmp_path)
    stress = 0.5 * E * math.log(2.0)
    assert found["shear_angle_deg"] == pytest.approx(45.0, abs=1e-6)
    assert found["warp_stress_MPa"] == pytest.approx(0.0, abs=1e-6 * E)
    assert found["weft_log_strain"] == pytest.approx(0.5 * math.log(2.0), rel=1e-6)
    assert found["weft_stress_MPa"] == pytest.approx(stress, rel=1e-6)
    assert found["green_naghdi_xx_MPa"] == pytest.approx(0.1 * stress, rel=1e-5)
    assert found["green_naghdi_yy_MPa"] == pytest.approx(0.9 * stress, rel=1e-5)
    assert found["green_naghdi_xy_MPa"] == pytest.approx(0.3 * stress, rel=1e-5)


def test_shear_after_tension_leaves_the_warp_stress(tmp_path):
    """Table 2, test 2."""
    found = element("element-tension-shear", tmp_path)
    assert found["shear_angle_deg"] == pytest.approx(45.0, abs=1e-6)
    assert found["warp_stress_MPa"] == pytest.approx(E * math.log(2.0), rel=1e-6)
    assert found["weft_stress_MPa"] == pytest.approx(0.5 * E * math.log(2.0), rel=1e-6)


@pytest.mark.parametrize("degrees", [90.0, -37.0])
def test_rigid_turn_changes_no_stress_along_the_fibres(tmp_path, degrees):
    """Table 2, test 3, and another angle."""
    phases = [{"warp_stretch": 2.0}, {"rotation_deg": degrees}]
    found = element("element-tension-rotation", tmp_path, {"loading.phases": phases})
    assert found["shear_angle_deg"] == pytest.approx(0.0, abs=1e-6)
    assert found["warp_stress_MPa"] == pytest.approx(E * math.log(2.0), rel=1e-6)
    assert found["green_naghdi_xx_MPa"] == pytest.approx(E * math.log(2.0), rel=1e-6)
    for name in ("weft_stress_MPa", "green_naghdi_yy_MPa", "green_naghdi_xy_MPa"):
        assert found[name] == pytest.approx(0.0, abs=1e-6 * E), name


@pytest.mark.parametrize(
    ("changes", "warp", "weft"),
    [
        ({}, 24500.0, 24500.0 * (math.sqrt(2.0) - 1.0)),
        (HYBRID_LOG, E * math.log(2.0), 0.5 * E * math.log(2.0)),
    ],
    ids=["linear", "log-strain"],
)
def test_hybrid_cell_carries_its_tension_in_the_connectors(tmp_path, changes, warp, weft):
    """Table 3. Two connectors per direction; the nearly empty membrane adds its 3.9 MPa times the logarithmic strain."""
    found = element("element-hybrid", tmp_path, changes)
    assert found["warp_connector_force_N"] == pytest.approx(0.5 * warp, rel=1e-6)
    assert found["weft_connector_force_N"] == pytest.approx(0.5 * weft, rel=1e-6)
    assert found["warp_stress_MPa"] == pytest.approx(warp + 3.9 * math.log(2.0), rel=1e-6)
    assert found["weft_stress_MPa"] == pytest.approx(weft + 1.95 * math.log(2.0), rel=1e-6)
