"""The connector: pulls, does not push, and stores the work done on it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from weftform.fabric import Fabric
from weftform.fabric.piecewise import pack_law
from weftform.mechanics.connector import connector_energy, connector_force, connector_tangent

LAW = Fabric.load("hexforce-48600-c1300").warp.line_law(2.69)
PACKED = pack_law(LAW, 1.0)
SIZES = (PACKED.degree, PACKED.pieces, PACKED.width, PACKED.end_slope)
SLACK = [0.0, 3.0]


def force(strain, slack):
    return connector_force(PACKED.coefficients, *SIZES, slack, strain)


def tangent(strain, slack):
    return connector_tangent(PACKED.coefficients, *SIZES, slack, strain)


def energy(strain, slack):
    return connector_energy(PACKED.coefficients, PACKED.integrals, *SIZES, slack, strain)


@pytest.mark.parametrize("slack", SLACK)
def test_pulls_by_the_law_and_barely_pushes(slack):
    for strain in (0.001, 0.01, 0.026, 0.05):
        assert force(strain, slack) == pytest.approx(float(LAW.value(strain)), rel=1e-12)
    assert force(0.0, slack) == 0.0
    assert force(-0.01, slack) == -0.01 * slack


@pytest.mark.parametrize("slack", SLACK)
@pytest.mark.parametrize("strain", [-0.02, -0.001, 0.001, 0.013, 0.0259, 0.03])
def test_tangent_is_the_slope_of_the_force(strain, slack):
    step = 1e-7
    difference = (force(strain + step, slack) - force(strain - step, slack)) / (2 * step)
    # Rounding: 1e-16 * some 600 N / 1e-7 < 1e-6 N; truncation step^2 * third derivative (1e8 N) is as small.
    assert tangent(strain, slack) == pytest.approx(difference, rel=1e-6, abs=1e-5)


@pytest.mark.parametrize("slack", SLACK)
@pytest.mark.parametrize("strain", [-0.02, 0.0, 0.001, 0.013, 0.026, 0.03])
def test_energy_is_the_work_of_the_force(strain, slack):
    # The law is polynomial in pieces: adaptive quadrature, told where they meet, is exact to rounding.
    meet = [p for p in (0.026,) if 0.0 < p < strain]
    work, _ = quad(force, 0.0, strain, args=(slack,), points=meet or None)
    assert energy(strain, slack) == pytest.approx(work, rel=1e-10, abs=1e-14)
    assert energy(strain, slack) >= 0.0


def test_force_never_falls_when_the_yarn_lengthens():
    strains = np.linspace(-0.05, 0.1, 2001)
    assert (np.diff([force(e, 3.0) for e in strains]) > 0.0).all()
