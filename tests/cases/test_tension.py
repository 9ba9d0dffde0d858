"""The tensile strip and the biaxial test against their closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from weftform.execution import run
from weftform.study import Study

EQ_4 = np.polynomial.Polynomial([0.0, 19.75, -123.13, 573.0, -91.645])
"""The repaired Eq. 4 [N of mm]."""
WEFT_N_PER_MM = 2000.0
UNBALANCED = {
    "fabric.override.tension.weft": {
        "law": "linear",
        "stiffness_N_per_mm": WEFT_N_PER_MM,
        "specimen_length_mm": 150.0,
        "specimen_width_mm": 50.0,
    }
}
NO_MEMBRANE = {"fabric.override.membrane": {"warp_modulus_MPa": 0.0, "weft_modulus_MPa": 0.0}}


def curve(result):
    return result.history["displacement_mm"], result.history["force_N"]


@pytest.mark.parametrize("cell_length", [2.5, 5.0])
def test_strip_gives_the_curve_of_the_specimen_whatever_its_cells(tmp_path, cell_length):
    """At 1, 2, 3 and 3.9 mm within 1 %."""
    result = run(Study.load("tensile-warp", {"specimen.cell_length_mm": cell_length}), tmp_path / "out")
    assert result.summary["ok"]
    way, force = curve(result)
    for at in (1.0, 2.0, 3.0, 3.9):
        assert np.interp(at, way, force) == pytest.approx(EQ_4(at), rel=0.01), at


def test_unbalanced_card_gives_two_curves(tmp_path):
    forces = {}
    for direction in ("warp", "weft"):
        study = Study.load(f"tensile-{direction}", {**UNBALANCED, "specimen.cell_length_mm": 5.0})
        assert not study.fabric.balanced
        way, force = curve(run(study, tmp_path / direction))
        forces[direction] = np.interp([1.0, 2.0, 3.0, 3.9], way, force)
    np.testing.assert_allclose(forces["warp"], EQ_4(np.array([1.0, 2.0, 3.0, 3.9])), rtol=0.01)
    np.testing.assert_allclose(forces["weft"], WEFT_N_PER_MM * np.array([1.0, 2.0, 3.0, 3.9]), rtol=0.01)


@pytest.mark.parametrize(("warp", "weft"), [(0.02, 0.01), (0.01, 0.015), (0.02, 0.0)])
def test_biaxial_forces_are_those_of_the_two_laws(tmp_path, warp, weft):
    """Warp and weft do not interact. 100 mm of width have 21 lines of 5 mm, the specimen of 50 mm has 11."""
    changes = {**NO_MEMBRANE, "loading.warp_strain": warp, "loading.weft_strain": weft}
    summary = run(Study.load("biaxial", changes), tmp_path / "out").summary
    largest = EQ_4(150.0 * max(warp, weft)) * 21 / 11
    expected = [EQ_4(150.0 * strain) * 21 / 11 for strain in (warp, weft)]
    assert summary["force_N"] == pytest.approx(expected[0], rel=0.01)
    assert summary["weft_force_N"] == pytest.approx(expected[1], rel=0.01, abs=1e-3 * largest)
    assert summary["warp_force_N_per_mm"] == pytest.approx(summary["force_N"] / 100.0)
    assert summary["displacement_mm"] == pytest.approx(100.0 * warp)
    assert summary["weft_displacement_mm"] == pytest.approx(100.0 * weft)
