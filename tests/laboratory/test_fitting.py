"""Least squares: exact where it can be, monotone where it must be, with a band that covers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_equations import eq4, eq8
from scipy.integrate import trapezoid

from weftform.errors import MeasurementError
from weftform.fabric.laws import first_fall
from weftform.laboratory.fitting import fit_polynomial
from weftform.laboratory.kinematics import (
    bias_design,
    bias_force,
    frame_angle,
    frame_lever,
    kinematic_angle,
    kinematic_displacement,
    kinematic_limit,
)
from weftform.laboratory.monotone import power_basis
from weftform.laboratory.samples import SHEAR, TENSILE
from weftform.laboratory.tabulating import fit_table

POWERS = [1, 2, 3, 4, 5]
RUNS = 40
FEWEST_COVERED = 32
"""Of 40 bands that each cover with 95 % probability, fewer than 32 cover with probability 2e-5 (binomial)."""


def test_eq7_returns_eq8_exactly() -> None:
    angle = np.radians(np.linspace(1.0, 40.0, 60))
    for height, width in ((150.0, 50.0), (200.0, 100.0), (300.0, 60.0)):
        force = bias_force(angle, SHEAR, height, width)
        design = bias_design(angle, height, width, lambda g: power_basis(g, POWERS))
        fit = fit_polynomial([design], [force], POWERS, float(angle[-1]))
        np.testing.assert_allclose(fit.coefficients, SHEAR, rtol=1e-8)
        assert not fit.constrained


def test_eq7_is_the_energy_balance_over_the_zones() -> None:
    """The force does the work of the torques of zones B and C, in small steps of the angle, without use of
    Eq. 5."""
    height, width = 150.0, 50.0
    g = np.radians(np.linspace(0.0, 40.0, 4001))
    torque = eq8(g) * np.cos(g)
    half = eq8(g / 2) * np.cos(g / 2)
    zone_b, zone_c = width * (2 * height - 3 * width) / 2, width**2
    power = zone_b * torque + zone_c * half * 0.5
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(g))])
    force = bias_force(g, SHEAR, height, width)
    d = kinematic_displacement(g, height, width)
    done = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(d))])
    np.testing.assert_allclose(done[100:], work[100:], rtol=1e-5)


def test_picture_frame_lever_is_the_energy_balance() -> None:
    side, cloth = 150.0, 110.0
    d = np.linspace(0.0, 60.0, 4001)
    g = frame_angle(d, side)
    force = frame_lever(g, side, cloth) * eq8(g)
    done = trapezoid(force, d)
    power = eq8(g) * np.cos(g) * cloth**2
    work = trapezoid(power, g)
    assert done == pytest.approx(work, rel=1e-6)


@given(st.floats(1.0, 400.0), st.floats(0.1, 0.5), st.floats(0.0, 0.99))
def test_kinematic_angle_is_eq2_and_inverts(height, ratio, share) -> None:
    width = ratio * height
    d = share * kinematic_limit(height, width)
    diagonal = height - width
    printed = np.pi / 2 - 2 * np.arccos(min((diagonal + d) / (np.sqrt(2) * diagonal), 1.0))
    assert float(kinematic_angle(d, height, width)) == pytest.approx(printed, abs=1e-7)
    assert float(kinematic_displacement(kinematic_angle(d, height, width), height, width)) == pytest.approx(
        d, abs=1e-7 * height
    )


def test_21_mm_and_21_degrees_are_two_events() -> None:
    assert np.degrees(kinematic_angle(21.0, 150.0, 50.0)) == pytest.approx(27.65, abs=0.01)
    assert float(kinematic_displacement(np.radians(21.0), 150.0, 50.0)) == pytest.approx(16.6, abs=0.055)
    assert kinematic_limit(150.0, 50.0) == pytest.approx(41.42, abs=0.01)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 8))
def test_a_monotone_fit_rises_whatever_the_points(seed, degree) -> None:
    rng = np.random.default_rng(seed)
    x = np.sort(rng.uniform(0.0, 3.0, 40))
    y = np.abs(rng.standard_normal(40)) + rng.uniform(0, 3) * x
    powers = list(range(1, degree + 1))
    fit = fit_polynomial([power_basis(x, powers)], [y], powers, float(x[-1]))
    assert first_fall(fit.law(), fit.valid_to) is None
    free = power_basis(x, powers) @ fit.free_coefficients
    best = power_basis(x, powers) @ fit.coefficients
    assert ((y - best) ** 2).sum() >= ((y - free) ** 2).sum() * (1 - 1e-9)


def test_monotone_fit_is_the_best_one() -> None:
    """Against an independent solver of the same constrained problem."""
    from scipy.optimize import minimize

    x = np.linspace(0.0, 1.0, 50)
    y = np.sin(4.0 * x)
    a = power_basis(x, [1, 2, 3, 4])
    fit = fit_polynomial([a], [y], [1, 2, 3, 4], 1.0)
    assert fit.constrained
    grid = power_basis(np.linspace(0, 1, 401), [1, 2, 3, 4], "slope")
    other = minimize(
        lambda c: ((a @ c - y) ** 2).sum(),
        np.ones(4),
        jac=lambda c: 2 * a.T @ (a @ c - y),
        constraints={"type": "ineq", "fun": lambda c: grid @ c, "jac": lambda c: grid},
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    ours = ((a @ fit.coefficients - y) ** 2).sum()
    assert ours == pytest.approx(other.fun, rel=1e-3)


def _covered(draw, truth, slope, at) -> tuple[int, int]:
    value = rate = 0
    for seed in range(RUNS):
        fit = draw(np.random.default_rng(seed))
        band = fit.band(at)
        value += bool(((band.lower <= truth) & (truth <= band.upper)).all())
        band = fit.band(at, kind="slope")
        rate += bool(((band.lower <= slope) & (slope <= band.upper)).all())
    return value, rate


@pytest.mark.parametrize("kind", ["per point", "per specimen"])
def test_band_covers_eqs_8_to_10_with_two_percent_noise_and_five_specimens(kind) -> None:
    d = np.linspace(0.0, kinematic_displacement(np.radians(40.0), 150.0, 50.0), 120)[1:]
    angle = kinematic_angle(d, 150.0, 50.0)
    force = bias_force(angle, SHEAR, 150.0, 50.0)
    design = bias_design(angle, 150.0, 50.0, lambda g: power_basis(g, POWERS))
    at = np.radians(np.linspace(5.0, 35.0, 31))

    def draw(rng):
        shape = (5, len(force)) if kind == "per point" else (5, 1)
        forces = list(force * (1.0 + 0.02 * rng.standard_normal(shape)))
        return fit_polynomial([design] * 5, forces, POWERS, float(angle[-1]))

    value, slope = _covered(draw, eq8(at), power_basis(at, POWERS, "slope") @ SHEAR, at)
    assert value >= FEWEST_COVERED and slope >= FEWEST_COVERED


@pytest.mark.parametrize("kind", ["per point", "per specimen"])
def test_band_covers_eq_4_with_two_percent_noise_and_five_specimens(kind) -> None:
    u = np.linspace(0.0, 3.9, 120)[1:]
    force = eq4(u)
    powers = [1, 2, 3, 4]
    at = np.linspace(0.2, 3.8, 31)

    def draw(rng):
        shape = (5, len(force)) if kind == "per point" else (5, 1)
        forces = list(force * (1.0 + 0.02 * rng.standard_normal(shape)))
        return fit_polynomial([power_basis(u, powers)] * 5, forces, powers, 3.9)

    value, slope = _covered(draw, eq4(at), power_basis(at, powers, "slope") @ TENSILE, at)
    assert value >= FEWEST_COVERED and slope >= FEWEST_COVERED


def test_one_specimen_has_a_band_from_its_noise() -> None:
    u = np.linspace(0.0, 3.9, 120)[1:]
    covered = 0
    for seed in range(RUNS):
        noise = 40.0 * np.random.default_rng(seed).standard_normal(len(u))
        fit = fit_polynomial([power_basis(u, [1, 2, 3, 4])], [eq4(u) + noise], [1, 2, 3, 4], 3.9, monotone=False)
        band = fit.band(u)
        covered += bool(((band.lower <= eq4(u)) & (eq4(u) <= band.upper)).all())
    assert covered >= FEWEST_COVERED


def test_pointwise_band_is_narrower_and_levels_order() -> None:
    u = np.linspace(0.1, 3.9, 60)
    rng = np.random.default_rng(1)
    forces = [eq4(u) * (1 + 0.02 * rng.standard_normal(60)) for _ in range(5)]
    fit = fit_polynomial([power_basis(u, [1, 2, 3, 4])] * 5, forces, [1, 2, 3, 4], 3.9)
    assert fit.band(u, simultaneous=False).critical < fit.band(u).critical < fit.band(u, level=0.99).critical
    with pytest.raises(ValueError, match="between 0 and 1"):
        fit.band(u, level=95.0)


def test_covariance_is_that_of_the_mean_of_separate_fits() -> None:
    u = np.linspace(0.1, 3.9, 60)
    a = power_basis(u, [1, 2, 3, 4])
    rng = np.random.default_rng(2)
    forces = [eq4(u) * (1 + 0.02 * rng.standard_normal(60)) for _ in range(6)]
    fit = fit_polynomial([a] * 6, forces, [1, 2, 3, 4], 3.9, monotone=False)
    separate = np.array([np.linalg.lstsq(a, f, rcond=None)[0] for f in forces])
    np.testing.assert_allclose(fit.coefficients, separate.mean(axis=0), rtol=1e-6)
    np.testing.assert_allclose(fit.covariance, np.cov(separate.T) / 6, rtol=1e-5)


def test_relative_weights_sharpen_a_curve_with_relative_errors() -> None:
    u = np.linspace(0.1, 3.9, 60)
    a = power_basis(u, [1, 2, 3, 4])
    errors = {"uniform": [], "relative": []}
    for seed in range(20):
        rng = np.random.default_rng(seed)
        forces = [eq4(u) * (1 + 0.02 * rng.standard_normal(60)) for _ in range(5)]
        for weighting, found in errors.items():
            fit = fit_polynomial([a] * 5, forces, [1, 2, 3, 4], 3.9, weighting=weighting)
            found.append(float(np.abs(fit.law().value(0.5) / eq4(np.array([0.5]))[0] - 1)))
    assert np.mean(errors["relative"]) < 0.5 * np.mean(errors["uniform"])


def test_too_few_or_coincident_points_are_refused() -> None:
    with pytest.raises(MeasurementError, match="too few points"):
        fit_polynomial([power_basis(np.array([1.0, 2.0]), POWERS)], [np.ones(2)], POWERS, 2.0)
    x = np.ones(20)
    with pytest.raises(MeasurementError, match="do not determine"):
        fit_polynomial([power_basis(x, POWERS)], [x], POWERS, 1.0)


def test_table_follows_a_smooth_curve_and_rises() -> None:
    u = np.linspace(0.0, 3.9, 300)
    fit = fit_table([u], [eq4(u)], lambda x, basis: basis(x), 3.9)
    assert fit.rms < 0.002 * eq4(u).max()
    noisy = eq4(u) + 300.0 * np.random.default_rng(0).standard_normal(300)
    fit = fit_table([u], [noisy], lambda x, basis: basis(x), 3.9)
    assert (np.diff(fit.x) > 0).all() and (np.diff(fit.y) > 0).all() and fit.y[0] == 0.0
    assert first_fall(fit.law(), 3.9) is None
    with pytest.raises(MeasurementError, match="does not rise"):
        fit_table([u], [-eq4(u) - 1.0], lambda x, basis: basis(x), 3.9)
