"""Tensile tests: Eq. 4 comes back, the stages are found, Eq. 11 holds."""

from __future__ import annotations

import numpy as np
import pytest
from paper_equations import eq4

from weftform.fabric.laws import PolynomialLaw, TabulatedLaw
from weftform.laboratory import Reading, characterise_tensile, sample
from weftform.laboratory.samples import TENSILE
from weftform.laboratory.stages import tensile_stages

SIZE = {"length": 150.0, "width": 50.0}
U = np.linspace(0.0, 3.9, 140)


def test_round_trip_of_eq_4_without_noise(write) -> None:
    found = characterise_tensile([write("a.csv", U, eq4(U))], direction="warp", **SIZE)
    np.testing.assert_allclose(found.fit.coefficients, TENSILE, rtol=1e-6)
    at = np.linspace(0.1, 3.9, 100)
    np.testing.assert_allclose(found.law.value(at), eq4(at), rtol=1e-3)
    assert found.interval == (0.0, 3.9) and not found.stages.damage


def test_connector_limits_of_eq_11_are_the_papers(write) -> None:
    """Sec. 3.2: Uc_max = 0.026 mm and Fc_max = 215.47 N for l0 = 1 mm (51 lines)."""
    found = characterise_tensile([write("a.csv", U, eq4(U))], direction="warp", **SIZE)
    uc, fc = found.connector_limits(1.0)
    assert uc == pytest.approx(0.026, abs=1e-6) and fc == pytest.approx(215.47, rel=5e-4)
    uc, fc = found.connector_limits(2.69)
    assert uc == pytest.approx(3.9 * 2.69 / 150.0) and fc == pytest.approx(
        float(eq4(np.array([3.9]))[0]) / (50 / 2.69 + 1)
    )


def test_stages_of_a_curve_with_known_stages() -> None:
    """A parabola of crimp to 2 mm, a straight line to 4 mm, then half the force: the knots are known."""
    u = np.linspace(0.0, 5.0, 501)
    f = np.where(u < 2, 250 * u**2, 1000 + 1000 * (u - 2))
    f = np.where(u > 4, 3000 - 1500 * (u - 4), f)
    stages = tensile_stages(u, f)
    # The parabola leaves its tangent by the tolerance (1 % of 3000 N, shared above and below the line) at
    # most so far out:
    early = np.sqrt(2 * stages.tolerance / 250)
    assert 2.0 - early <= stages.crimp_end <= 2.0
    assert stages.linear_end == pytest.approx(4.0, abs=0.05) and stages.damage
    assert stages.linear_stiffness == pytest.approx(1000, rel=0.05)


def test_shipped_specimens() -> None:
    for direction, share in (("warp", 1.0), ("weft", 0.96)):
        found = characterise_tensile(sample(f"tensile-{direction}"), direction=direction, **SIZE)
        assert len(found.specimens) == 5 and found.stages.damage and not found.fit.constrained
        assert 1.5 < found.stages.crimp_end < 2.5 and 3.6 < found.stages.linear_end < 4.1
        at = np.linspace(0.5, 3.7, 30)
        band = found.force_band(at)
        assert ((band.lower <= share * eq4(at)) & (share * eq4(at) <= band.upper)).all()


def test_scatter_band_is_that_of_the_specimens(write) -> None:
    scales = np.array([0.97, 0.99, 1.0, 1.01, 1.03])
    files = [write(f"{k}.csv", U, s * eq4(U)) for k, s in enumerate(scales)]
    mean = characterise_tensile(files, direction="warp", **SIZE).mean
    np.testing.assert_allclose(mean.mean, eq4(mean.x) * scales.mean(), atol=0.05)
    np.testing.assert_allclose(mean.deviation[1:], (eq4(mean.x) * scales.std(ddof=1))[1:], rtol=1e-3, atol=0.05)


def test_printed_eq_4_is_made_monotone_and_said(write) -> None:
    printed = np.maximum(U[:, None] ** np.arange(1, 5) @ np.array([19.75, -123.13, 573.0, -170.85]), 0.0)
    path = write("a.csv", U, printed)
    found = characterise_tensile([path], direction="warp", interval=(0.0, 3.0), **SIZE)
    assert found.fit.constrained and any("the best rising one is used" in w for w in found.warnings)
    free = characterise_tensile([path], direction="warp", interval=(0.0, 3.0), monotone=False, **SIZE)
    assert any("not monotone" in w for w in free.warnings)


def test_interval_degree_origin_and_table(write) -> None:
    path = write("a.csv", U, eq4(U))
    found = characterise_tensile([path], direction="weft", interval=(0.0, 2.0), degree=6, **SIZE)
    assert found.fit.valid_to == 2.0 and len(found.fit.coefficients) == 6
    table = characterise_tensile([path], direction="weft", law="tabulated", **SIZE)
    assert isinstance(table.law, TabulatedLaw) and table.force_band(U) is None
    np.testing.assert_allclose(table.law.value(np.array([1.0, 2.0, 3.0])), [374.5, 2661.2, 6995.4], rtol=0.01)
    offset = characterise_tensile([write("b.csv", U, eq4(U) + 20.0)], direction="weft", through_origin=False, **SIZE)
    assert isinstance(offset.law, PolynomialLaw) and offset.law.constant == pytest.approx(20.0, rel=1e-6)
    assert any("does not pass the origin" in w for w in offset.warnings)


def test_interval_beyond_the_measurements_is_said(write) -> None:
    found = characterise_tensile([write("a.csv", U, eq4(U))], direction="warp", interval=(0.0, 6.0), **SIZE)
    assert found.fit.valid_to == pytest.approx(3.9) and any("validity ends there" in w for w in found.warnings)


def test_several_specimens_in_one_file(text) -> None:
    rows = [
        f"{name},{u:.4f},{s * f:.4f}" for name, s in (("a", 0.98), ("b", 1.02)) for u, f in zip(U, eq4(U), strict=True)
    ]
    path = text("a.csv", "\n".join(["specimen,displacement_mm,force_N", *rows]))
    assert [s.name for s in characterise_tensile([path], direction="warp", **SIZE).specimens] == [
        "a: a",
        "a: b",
    ]
    one = characterise_tensile([path], direction="warp", reading=Reading(only=("b",)), **SIZE)
    assert [s.name for s in one.specimens] == ["a: b"]
