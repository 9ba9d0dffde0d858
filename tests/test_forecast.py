"""What ``weftform check`` says before anything runs."""

import pytest

from weftform.forecast import forecast
from weftform.study import Study


def test_the_least_step_counts():
    """The steps that the shipped run makes (docs/theory/dynamics.md), roughly; without it the stable step."""
    with_least = forecast(Study.load("hemisphere-0-90"))
    assert with_least.steps == pytest.approx(43_800, rel=0.2)
    assert with_least.smallest_step_s == 2e-6
    without = forecast(Study.load("hemisphere-0-90", ["solver.least_step_s=0"]))
    assert without.inertia == 1.0
    assert with_least.inertia == pytest.approx((2e-6 / without.smallest_step_s) ** 2, rel=1e-12)
    assert with_least.warnings == []


def test_mass_that_will_be_scaled_much_is_warned_of():
    (warning,) = forecast(Study.load("hemisphere-0-90", ["blank.cell_length_mm=1.5"])).warnings
    assert "solver.least_step_s" in warning
