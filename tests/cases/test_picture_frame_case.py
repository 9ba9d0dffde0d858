"""The picture frame returns the law that it was given; a shear cycle comes back to zero."""

from __future__ import annotations

import numpy as np
import pytest

from weftform.execution import run
from weftform.study import Study

EQ_8 = np.polynomial.Polynomial([0.0, 0.0514, -0.4168, 1.8682, -3.7092, 2.8450])
"""F_sh [N/mm of rad]."""


def test_frame_returns_the_law_within_1_percent(tmp_path):
    result = run(Study.load("picture-frame"), tmp_path / "out")
    assert result.summary["ok"]
    history = result.history
    np.testing.assert_allclose(history["shear_angle_mean_deg"], history["shear_angle_frame_deg"], atol=0.05)
    assert history["shear_angle_frame_deg"][-1] == pytest.approx(45.0, abs=1e-6)
    angle = history["shear_angle_frame_deg"]
    found = history["normalised_shear_force_N_per_mm"]
    law = EQ_8(np.radians(angle))
    sheared = angle > 5.0
    assert sheared.sum() > 40
    np.testing.assert_allclose(found[sheared], law[sheared], rtol=0.01)
    np.testing.assert_allclose(found, law, atol=0.01 * law.max())


def test_shear_cycle_returns_to_zero(tmp_path):
    """The law is odd and a function of the state: the way back is the way there, the other side its mirror image."""
    result = run(Study.load("shear-cycle"), tmp_path / "out")
    history = result.history
    angle, force = history["shear_angle_frame_deg"], history["force_N"]
    largest = np.abs(force).max()
    assert angle.max() == pytest.approx(30.0, abs=0.1) and angle.min() == pytest.approx(-30.0, abs=0.1)
    assert angle[-1] == pytest.approx(0.0, abs=1e-6)
    assert abs(force[-1]) < 0.01 * largest
    assert np.abs(result.fields().positions - result.grid.flat).max() < 0.01
    law = EQ_8(np.radians(np.abs(angle))) * np.sign(angle)
    found = history["normalised_shear_force_N_per_mm"]
    np.testing.assert_allclose(found, law, atol=0.01 * law.max())


def test_shear_cycle_raises_no_warning(tmp_path):
    assert run(Study.load("shear-cycle"), tmp_path / "out").summary["warnings"] == []


def test_beyond_the_measured_range_a_note_says_so(tmp_path):
    changes = {"specimen.cell_length_mm": 50.0, "output.frames": 2, "fabric.override.shear.valid_to_deg": 30.0}
    beyond = run(Study.load("picture-frame", changes), tmp_path / "beyond").summary
    assert any("100 % of the area shears beyond 30 deg" in note and "45 deg" in note for note in beyond["notes"])
    assert beyond["ok"]
    within = run(
        Study.load("picture-frame", {**changes, "loading.shear_angles_deg": [29.0]}), tmp_path / "within"
    ).summary
    assert within["notes"] == []
