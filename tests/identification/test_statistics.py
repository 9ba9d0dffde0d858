"""Confidence intervals against the textbook, coverage of correlated errors, and warnings of poor identifiability."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from weftform.identification.fits import Parameter
from weftform.identification.statistics import uncertainty


def linear(name: str, lower: float = -100.0, upper: float = 100.0) -> Parameter:
    return Parameter(name, "", 1.0, lower, upper)


def test_intervals_of_a_straight_line_are_those_of_the_textbook():
    """Ordinary least squares with independent errors: s^2 (X'X)^-1 and Student's t. The errors alternate in sign, so
    that no correlation of neighbours widens the intervals."""
    x = np.linspace(0.0, 1.0, 30)
    rng = np.random.default_rng(3)
    y = 1.0 + 2.0 * x + 0.05 * (-1.0) ** np.arange(30) * (1.0 + 0.3 * rng.random(30))
    known = stats.linregress(x, y)
    a = np.column_stack([np.ones(30), x])
    values = [known.intercept, known.slope]
    parameters = [linear("intercept"), linear("slope")]
    found = uncertainty(a * [p.size for p in parameters], [a @ values - y], [1.0], parameters, values)
    t = stats.t.ppf(0.975, 28)
    assert found.freedom == pytest.approx(28.0)
    assert found.upper[1] - values[1] == pytest.approx(t * known.stderr, rel=1e-9)
    assert values[0] - found.lower[0] == pytest.approx(t * known.intercept_stderr, rel=1e-9)
    assert found.correlation[0, 1] == pytest.approx(-x.mean() / np.sqrt((x**2).mean()), rel=1e-9)


@pytest.mark.parametrize("memory", [0.0, 0.6, 0.8])
def test_intervals_cover_the_truth_when_errors_are_correlated(memory):
    """95 % intervals of 400 noisy lines cover the slope in 91 to 99 % of cases (four standard errors of the count are
    4.4 %); with neighbours that err alike too."""
    x = np.linspace(0.0, 1.0, 200)
    a = np.column_stack([np.ones(200), x])
    rng = np.random.default_rng(11)
    hits = 0
    for _ in range(400):
        shocks = rng.normal(0.0, 0.1, 200)
        errors = np.empty(200)
        errors[0] = shocks[0] / np.sqrt(1.0 - memory**2)
        for k in range(1, 200):
            errors[k] = memory * errors[k - 1] + shocks[k]
        y = 1.0 + 2.0 * x + errors
        values = np.linalg.lstsq(a, y, rcond=None)[0]
        parameters = [linear("intercept"), linear("slope")]
        found = uncertainty(a * [p.size for p in parameters], [a @ values - y], [1.0], parameters, list(values))
        hits += found.lower[1] <= 2.0 <= found.upper[1]
    assert 0.91 <= hits / 400 <= 0.99


def test_curves_of_different_noise_keep_their_own():
    """The intercept of a curve hardly depends on the noise of another that does not see it."""
    rng = np.random.default_rng(5)
    a = np.zeros((300, 2))
    a[:150, 0] = a[150:, 1] = 1.0
    quiet, loud = rng.normal(0.0, 0.01, 150), rng.normal(0.0, 1.0, 150)
    quiet, loud = quiet - quiet.mean(), loud - loud.mean()
    parameters = [linear("quiet"), linear("loud")]
    found = uncertainty(a * [p.size for p in parameters], [quiet, loud], [1.0, 1.0], parameters, [1.0, 1.0])
    assert (found.upper[0] - 1.0) / (found.upper[1] - 1.0) == pytest.approx(quiet.std() / loud.std(), rel=0.3)


def test_logarithmic_parameter_has_a_positive_interval():
    p = Parameter("G12", "MPa", 1.0, 0.05, 20.0)
    rng = np.random.default_rng(1)
    found = uncertainty(0.05 * np.ones((20, 1)), [rng.normal(0.0, 0.1, 20)], [1.0], [p], [0.5])
    assert 0.0 < found.lower[0] < 0.5 < found.upper[0]
    assert found.lower[0] * found.upper[0] == pytest.approx(0.25)


def test_parameters_that_stand_for_one_another_are_named():
    x = np.linspace(0.0, 1.0, 50)
    a = np.column_stack([1.0 + x, 1.0 + x + 1e-3 * x**2])
    found = uncertainty(a, [0.01 * np.sin(40 * x)], [1.0], [linear("a"), linear("b")], [1.0, 1.0])
    assert found.condition > 30
    assert any("correlated" in w and "a and b" in w for w in found.warnings)
    assert any("poorly told apart" in w for w in found.warnings)


def test_equal_columns_cannot_be_told_apart():
    a = np.ones((50, 2))
    found = uncertainty(a, [np.zeros(50)], [1.0], [linear("a"), linear("b")], [1.0, 1.0])
    assert np.isinf(found.condition) and np.isinf(found.standard_errors).all()
    assert any("cannot be told apart" in w for w in found.warnings)


def test_insensitive_parameter_and_one_at_its_bound_are_named():
    x = np.linspace(0.0, 1.0, 50)
    a = np.column_stack([1.0 + x, 1e-6 * x, x**2])
    parameters = [linear("good"), linear("unseen"), linear("stuck", upper=3.0)]
    found = uncertainty(a, [0.01 * np.sin(40 * x)], [1.0], parameters, [1.0, 1.0, 3.0])
    assert any("unseen is not seen" in w for w in found.warnings)
    assert any("stuck ends at its bound" in w for w in found.warnings)
    assert np.isfinite(found.standard_errors[0])
    assert np.isinf(found.standard_errors[1]) and np.isnan(found.standard_errors[2])


def test_model_that_does_not_follow_is_said():
    """A straight line through a parabola: a systematic error, which no interval of the line can hold."""
    x = np.linspace(0.0, 1.0, 100)
    a = np.column_stack([np.ones(100), x])
    values = np.linalg.lstsq(a, x**2, rcond=None)[0]
    parameters = [linear("a"), linear("b")]
    found = uncertainty(a * [p.size for p in parameters], [a @ values - x**2], [1.0], parameters, list(values))
    assert any("systematic" in w for w in found.warnings)
    # rough, but within an order of magnitude of the parabola, not nothing and not everything
    assert (found.upper - found.lower < 10.0).all() and (found.upper - found.lower > 0.1).all()
