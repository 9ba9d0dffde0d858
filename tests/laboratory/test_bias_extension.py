"""Bias extension: Eqs. 8 to 10 come back, slip is found where it is and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
from paper_equations import bias_curve, eq8

from weftform.errors import MeasurementError
from weftform.laboratory import (
    LockingCriterion,
    Reading,
    characterise_bias_extension,
    sample,
    slip_onset,
    track_markers,
)
from weftform.laboratory.kinematics import bias_force, kinematic_angle
from weftform.laboratory.samples import SHEAR

SIZE = {"height": 150.0, "width": 50.0, "thickness": 0.62}
AT = np.radians(np.linspace(1.0, 35.0, 69))
EQ10 = (0.0829, -1.3447, 9.0399, -23.9304, 22.9438)


def test_round_trip_of_eqs_8_9_10_without_noise(write) -> None:
    found = characterise_bias_extension([write("a.csv", *bias_curve())], **SIZE)
    shear = found.shear
    np.testing.assert_allclose(shear.normalised_force(AT), eq8(AT), rtol=1e-3)
    np.testing.assert_allclose(shear.stress(AT), eq8(AT) / 0.62, rtol=1e-3)
    modulus = sum(k * c * AT ** (k - 1) for k, c in enumerate(SHEAR, 1)) / 0.62
    np.testing.assert_allclose(shear.modulus(AT), modulus, rtol=1e-3)
    np.testing.assert_allclose(shear.modulus_coefficients, EQ10, rtol=2e-3)  # the print is rounded
    assert shear.modulus_positive and found.angle_source == "kinematic"
    d, f = bias_curve()
    np.testing.assert_allclose(found.force(kinematic_angle(d, 150, 50)), f, atol=1e-9)


def test_five_noisy_specimens_from_files_cover_eq_8(write) -> None:
    rng = np.random.default_rng(5)
    d, f = bias_curve(31.0)
    files = [write(f"{k}.csv", d, f * (1.0 + 0.02 * rng.standard_normal(len(f)))) for k in range(5)]
    shear = characterise_bias_extension(files, **SIZE).shear
    at = np.radians(np.linspace(5.0, 35.0, 61))
    for band, truth in (
        (shear.force_band(at), eq8(at)),
        (shear.stress_band(at), eq8(at) / 0.62),
        (shear.modulus_band(at), sum(k * c * at ** (k - 1) for k, c in enumerate(SHEAR, 1)) / 0.62),
    ):
        assert ((band.lower <= truth) & (truth <= band.upper)).all()
        assert (band.upper - band.lower).max() < 0.5 * truth.max()


def test_other_sizes_and_degrees(write) -> None:
    d = np.linspace(0.0, 30.0, 200)
    straight = bias_force(kinematic_angle(d, 200.0, 100.0), [0.03], 200.0, 100.0)
    found = characterise_bias_extension([write("a.csv", d, straight)], height=200, width=100, thickness=1.0, degree=1)
    np.testing.assert_allclose(found.shear.fit.coefficients, [0.03], rtol=1e-9)


def test_table_instead_of_polynomial(write) -> None:
    found = characterise_bias_extension([write("a.csv", *bias_curve())], law="tabulated", **SIZE)
    at = np.radians([10.0, 20.0, 30.0])
    np.testing.assert_allclose(found.shear.normalised_force(at), eq8(at), rtol=0.02)
    assert found.shear.modulus_positive and found.shear.force_band(at) is None


def test_fall_of_the_force_ends_the_law(write) -> None:
    d, f = bias_curve(30.0)
    f = np.where(d > 25.0, np.interp(25.0, d, f) * (1.0 - 0.05 * (d - 25.0)), f)
    found = characterise_bias_extension([write("a.csv", d, f)], **SIZE)
    assert any("the mean force falls beyond" in w for w in found.warnings)
    assert found.interval_deg[1] == pytest.approx(np.degrees(kinematic_angle(25.0, 150, 50)), abs=1.0)


def test_slip_ends_the_kinematic_law_and_auto_takes_the_measured_angle() -> None:
    tracking = [track_markers(sample("bias-extension-markers")[0], sample("bias-extension-layout")[0])]
    kinematic = characterise_bias_extension(sample("bias-extension"), tracking=tracking, angle="kinematic", **SIZE)
    assert kinematic.slip.displacement == pytest.approx(16.5, abs=0.5)
    assert kinematic.slip.interval[0] <= 16.5 <= kinematic.slip.interval[1]
    assert kinematic.interval_deg[1] < 22.0 and any("yarns slip from" in w for w in kinematic.warnings)
    auto = characterise_bias_extension(sample("bias-extension"), tracking=tracking, **SIZE)
    assert auto.angle_source == "measured" and auto.interval_deg[1] == pytest.approx(39.0, abs=0.5)
    at = np.radians(np.linspace(5.0, 35.0, 31))
    band = auto.shear.force_band(at)
    assert ((band.lower <= eq8(at)) & (eq8(at) <= band.upper)).all()
    assert auto.shear.stages.locking_deg is not None


def test_measured_angle_from_a_column(text) -> None:
    d = np.linspace(0.0, 50.0, 101)
    from weftform.laboratory.samples import measured_angle

    g = measured_angle(d)
    rows = [
        f"{a!r},{b!r},{c!r}"
        for a, b, c in zip(d.tolist(), bias_force(g, SHEAR, 150, 50).tolist(), np.degrees(g).tolist(), strict=True)
    ]
    path = text("a.csv", "\n".join(["displacement_mm,force_N,shear_angle_deg", *rows]))
    found = characterise_bias_extension([path], **SIZE)
    assert found.angle_source == "measured"
    np.testing.assert_allclose(found.shear.normalised_force(AT), eq8(AT), rtol=0.01)


def test_measured_angle_without_measurement_is_refused(write) -> None:
    with pytest.raises(MeasurementError, match="no measured angle"):
        characterise_bias_extension([write("a.csv", *bias_curve())], angle="measured", **SIZE)


def test_no_measured_angle_is_said(write) -> None:
    found = characterise_bias_extension([write("a.csv", *bias_curve(40.0))], **SIZE)
    assert found.slip is None and any("slip cannot be seen" in w for w in found.warnings)
    assert found.interval_deg[1] <= 60.0 and any("--to-deg" in w for w in found.warnings)


def test_negative_modulus_is_refused_or_said(write) -> None:
    coefficients = [0.05, -0.2, 0.25]  # falls between 0.19 and 0.34 rad
    d = np.linspace(0.0, 29.0, 150)
    path = write("a.csv", d, np.maximum(bias_force(kinematic_angle(d, 150, 50), coefficients, 150, 50), 0))
    found = characterise_bias_extension([path], degree=3, **SIZE)
    assert found.shear.fit.constrained and found.shear.modulus_positive
    free = characterise_bias_extension([path], degree=3, monotone=False, **SIZE)
    assert not free.shear.modulus_positive and any("G12 is negative" in w for w in free.warnings)


def test_locking_by_stiffness_ratio_does_not_depend_on_the_range(write) -> None:
    angles = []
    for end in (29.0, 31.0, 33.0):
        found = characterise_bias_extension(
            [write(f"{end}.csv", *bias_curve(end))], locking=LockingCriterion.STIFFNESS_RATIO, **SIZE
        )
        angles.append(found.shear.stages.locking_deg)
    assert max(angles) - min(angles) < 1.0


def test_straight_shear_curve_has_no_locking(write) -> None:
    d = np.linspace(0.0, 25.0, 100)
    path = write("a.csv", d, bias_force(kinematic_angle(d, 150, 50), [0.03], 150, 50))
    assert characterise_bias_extension([path], degree=2, **SIZE).shear.stages.locking_deg is None


def test_cao_bias_tables_with_their_own_sizes() -> None:
    for name, width in (("150x300", 150.0), ("100x300", 100.0)):
        found = characterise_bias_extension(
            sample("cao2008-bias-extension"),
            height=300.0,
            width=width,
            thickness=1.2,
            law="tabulated",
            reading=Reading(only=(name,)),
        )
        assert found.shear.fit.r_squared > 0.99 and found.shear.modulus_positive


# Slip


def _slip(shape: str, seed: int, images: int = 76, end: float = 37.5):
    d = np.linspace(0.0, end, images)
    kinematic = np.degrees(kinematic_angle(d, 150.0, 50.0))
    at = float(np.degrees(kinematic_angle(16.5, 150.0, 50.0)))
    after = {
        "stops": np.full_like(d, at),
        "half": at + 0.5 * (kinematic - at),
        "straight": at + 0.54 * (d - 16.5),
        "none": kinematic,
        "offset": kinematic + 0.5,
    }[shape]
    measured = np.where(d > 16.5, after, kinematic + (0.5 if shape == "offset" else 0.0))
    measured = measured + 0.3 * np.random.default_rng(seed).standard_normal(images)
    return slip_onset(d, measured, kinematic)


@pytest.mark.parametrize("shape", ["stops", "half", "straight"])
def test_slip_at_16_5_mm_is_found_within_half_a_millimetre(shape) -> None:
    covered = 0
    for seed in range(20):
        found = _slip(shape, seed)
        assert found.found and found.confidence > 0.99
        assert found.displacement == pytest.approx(16.5, abs=0.5)
        covered += found.interval[0] <= 16.5 <= found.interval[1]
    assert covered >= 15  # P(fewer of 20) = 3e-4 for a true 95 % interval


@pytest.mark.parametrize("shape", ["none", "offset"])
def test_no_slip_is_invented(shape) -> None:
    assert not any(_slip(shape, seed).found for seed in range(25))


def test_slip_in_a_short_test_is_not_claimed() -> None:
    """The test ends before the onset."""
    assert not any(_slip("stops", seed, 34, 16.5).found for seed in range(20))


def test_too_few_or_lost_images() -> None:
    d = np.linspace(0, 30, 60)
    kinematic = np.degrees(kinematic_angle(d, 150, 50))
    assert not slip_onset(d[:5], kinematic[:5] - 5, kinematic[:5]).found
    measured = np.where(d > 16.5, kinematic[33], kinematic)
    measured[[3, 20, 40]] = np.nan
    assert slip_onset(d, measured, kinematic).displacement == pytest.approx(16.5, abs=0.6)
