"""Curves to meet: what is read of them, what counts, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from bias_formula import bias_curve

from weftform.errors import IdentificationError, MeasurementError, StudyError
from weftform.identification import Target
from weftform.identification.loading import shear_angle_at, shortened, travel
from weftform.identification.preparing import compared_curves, studies_of
from weftform.laboratory import Reading, copy_samples, sample, track_markers
from weftform.laboratory.kinematics import kinematic_angle
from weftform.study import Study


def read(study, *targets, weighting="relative", until_slip=False, tracking=(), reading=None):
    studies, homes = studies_of(study, "bias-extension", targets)
    return compared_curves(
        targets,
        studies,
        homes,
        reading=reading or Reading(),
        weighting=weighting,
        until_slip=until_slip,
        tracking=tracking,
    )


def test_whole_curve_counts_but_its_origin(study, curve):
    (found,), notes = read(study, Target(curve))
    assert len(found.force) == 80 and found.displacement[0] > 0.0
    assert notes == []


def test_a_met_curve_has_no_residuals_and_a_share_too_much_is_the_misfit(study, curve):
    (found,), _ = read(study, Target(curve, weight=4.0))
    d, force = bias_curve(study)
    np.testing.assert_allclose(found.residuals(d, force), 0.0, atol=1e-9)
    residuals = found.residuals(d, 1.1 * force)
    strong = found.force > 0.1 * found.force.max()
    # weight times mean square: sqrt(4 / n) * 0.1 where the force is well above the floor of 2 %
    np.testing.assert_allclose(residuals[strong] / np.sqrt(4.0 / len(found.force)), 0.1, rtol=0.02)


def test_uniform_weighting_counts_shares_of_the_largest_force(study, curve):
    (found,), _ = read(study, Target(curve), weighting="uniform")
    np.testing.assert_array_equal(found.size, found.force.max())


def test_range_cuts_both_ends(study, curve):
    (found,), _ = read(study, Target(curve, range_mm=(5.0, 12.0)))
    assert found.displacement.min() >= 5.0 and found.displacement.max() <= 12.0


def test_points_beyond_the_study_are_left_out_and_named(study, write):
    longer = Study.load("bias-extension", {"loading.displacement_mm": 30.0})
    (found,), notes = read(study, Target(write(*bias_curve(longer))))
    assert found.displacement.max() <= 20.0
    # 81 points to 30 mm: every 0.375 mm, of which 53 lie within 20 mm
    assert any("27 points beyond 20 mm" in note for note in notes)


def test_range_without_a_simulated_point_is_refused(study, curve, write):
    with pytest.raises(IdentificationError, match="0 points lie in the range") as caught:
        read(study, Target(curve, range_mm=(25.0, 30.0)))
    assert "0 to 20 mm" in caught.value.expected and str(curve) in str(caught.value)
    far = write(np.linspace(100.0, 200.0, 50), np.linspace(1.0, 2.0, 50), "far.csv")
    with pytest.raises(IdentificationError, match="0 points"):
        read(study, Target(far))


@pytest.mark.parametrize("span", [(12.0, 5.0), (5.0, 5.0), (-2.0, 5.0), (0.0, float("nan"))])
def test_range_that_is_none_is_refused(span):
    with pytest.raises(IdentificationError, match="range"):
        Target("curve.csv", range_mm=span)


@pytest.mark.parametrize("weight", [0.0, -1.0, float("nan"), float("inf")])
def test_weight_that_is_none_is_refused(weight):
    with pytest.raises(IdentificationError, match="weight"):
        Target("curve.csv", weight=weight)


def test_missing_column_is_refused_with_its_line(study, write):
    file = write(np.linspace(0, 20, 30), np.linspace(0, 1, 30), header="displacement_mm,width_mm")
    with pytest.raises(MeasurementError, match="force"):
        read(study, Target(file))


def test_missing_file_is_refused(study, tmp_path):
    with pytest.raises(MeasurementError):
        read(study, Target(tmp_path / "none.csv"))


def test_the_same_curve_twice_is_refused(study, curve):
    with pytest.raises(IdentificationError, match="twice"):
        read(study, Target(curve), Target(curve))


def test_specimens_of_one_file_share_its_weight(study, tmp_path):
    d, force = bias_curve(study)
    rows = [f"{name},{a},{b * f}" for name, f in (("a", 1.0), ("b", 1.1)) for a, b in zip(d, force, strict=True)]
    file = tmp_path / "both.csv"
    file.write_text("\n".join(["specimen,displacement_mm,force_N", *rows]) + "\n")
    found, _ = read(study, Target(file, weight=3.0))
    assert [c.weight for c in found] == [1.5, 1.5]


def test_other_studies_take_the_card_of_the_first(tmp_path, curve, study):
    from weftform.fabric.fabric import shipped_cards

    mine = tmp_path / "mine.toml"
    mine.write_text(shipped_cards()["hexforce-48600-c1300"].read_text(encoding="utf-8").replace("= 0.62", "= 0.5"))
    main = Study.load("bias-extension", {"fabric.card": str(mine), "fabric.override.fabric.areal_weight_g_m2": 500.0})
    studies, homes = studies_of(
        main, "mine", [Target(curve), Target("pull.csv", "tensile-warp"), Target("again.csv", "tensile-warp")]
    )
    assert homes == [0, 1, 1] and len(studies) == 2
    assert studies[1].fabric.thickness == 0.5
    assert studies[1].fabric.card.fabric.areal_weight_g_m2 == 500.0
    # what the other study changes itself stays
    assert studies[1].fabric.card.membrane.warp_modulus_MPa == 0.0


def test_unknown_study_of_a_target_is_refused(study, curve):
    with pytest.raises(StudyError, match="no study named"):
        read(study, Target(curve, "bias-extensoin"))


@pytest.mark.parametrize("name", ["element-shear", "shear-cycle"])
def test_study_without_a_force_curve_is_refused(name, curve):
    with pytest.raises(IdentificationError):
        studies_of(Study.load(name), name, [Target(curve)])


def test_slip_ends_the_curve(study, write):
    """Angles that stop at 12 mm: the curve counts up to there, within the half millimetre of the detection."""
    d, force = bias_curve(study)
    angle = np.degrees(kinematic_angle(np.minimum(d, 12.0), 150.0, 50.0))
    noise = np.random.default_rng(2).normal(0.0, 0.3, len(d))
    file = write(d, force, header="displacement_mm,force_N,shear_angle_deg", more=(angle + noise,))
    (found,), notes = read(study, Target(file), until_slip=True)
    assert found.slip_mm == pytest.approx(12.0, abs=0.5)
    assert found.displacement.max() <= found.slip_mm
    assert any("yarns slip from" in note for note in notes)


def test_no_slip_is_invented(study, write):
    d, force = bias_curve(study)
    angle = np.degrees(kinematic_angle(d, 150.0, 50.0)) + np.random.default_rng(2).normal(0.0, 0.3, len(d))
    file = write(d, force, header="displacement_mm,force_N,shear_angle_deg", more=(angle,))
    (found,), notes = read(study, Target(file), until_slip=True)
    assert found.slip_mm is None and len(found.force) == 80
    assert any("no slip found" in note for note in notes)


def test_slip_from_the_shipped_markers():
    """The shipped markers leave the kinematic angle at 16.5 mm."""
    tracking = [track_markers(sample("bias-extension-markers")[0], sample("bias-extension-layout")[0])]
    file = sample("bias-extension")[0]
    (found,), _ = read(Study.load("bias-extension"), Target(file), until_slip=True, tracking=tracking)
    assert found.slip_mm == pytest.approx(16.5, abs=0.5)
    assert found.displacement.max() <= found.slip_mm


def test_slip_without_angles_is_refused(study, curve):
    with pytest.raises(IdentificationError, match="no measured shear angle"):
        read(study, Target(curve), until_slip=True)


def test_travel_of_the_shipped_tests():
    assert travel(Study.load("bias-extension")) == 40.0
    assert travel(Study.load("tensile-warp")) == 3.9
    assert travel(Study.load("hemisphere-0-90")) == 30.0
    frame = Study.load("picture-frame")
    assert np.degrees(shear_angle_at(frame, travel(frame))) == pytest.approx(45.0)


def test_a_shorter_test_is_a_slower_one():
    study = Study.load("bias-extension")
    short = shortened(study, 15.0)
    assert short.model.loading.displacement_mm == pytest.approx(15.3)
    assert short.model.loading.duration_s == study.model.loading.duration_s
    assert shortened(study, 39.0) is study
    assert shortened(Study.load("hemisphere-0-90"), 3.0).model.loading.stroke_mm == 30.0


def test_samples_can_be_copied_and_read(study, tmp_path):
    copy_samples(tmp_path)
    targets = [Target(p) for p in sorted(tmp_path.glob("bias-extension-?.csv"))]
    found, _ = read(study, *targets)
    assert len(found) == 5
