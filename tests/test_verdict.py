"""What a run says of itself."""

import pytest

from weftform.verdict import doubts, energy_summary


def entry(work, imbalance, kinetic, internal):
    return {
        "external_work_mJ": work,
        "imbalance_mJ": imbalance,
        "kinetic_energy_mJ": kinetic,
        "internal_energy_mJ": internal,
    }


def test_a_sound_run_leaves_no_doubt():
    energy = energy_summary([entry(0.0, 0.0, 0.0, 0.0), entry(100.0, 0.5, 1.0, 90.0)])
    assert energy["balance_error"] == pytest.approx(0.005)
    assert energy["kinetic_over_internal"] == pytest.approx(1.0 / 90.0)
    assert doubts(energy, 0.01) == []


def test_kinetic_energy_counts_only_once_the_fabric_is_loaded():
    """At the start the blank moves before it resists: 5 of 0.5 mJ says nothing about the forming."""
    energy = energy_summary([entry(5.5, 0.0, 5.0, 0.5), entry(100.0, 0.0, 1.0, 90.0)])
    assert energy["kinetic_over_internal"] == pytest.approx(1.0 / 90.0)


@pytest.mark.parametrize(
    ("energy", "penetration", "advice"),
    [
        ((0.02, 0.01), 0.01, "solver.safety"),
        ((0.001, 0.06), 0.01, "duration_s"),
        ((0.001, 0.01), 0.06, "stiffness_N_per_mm3"),
    ],
)
def test_each_doubt_says_what_to_change(energy, penetration, advice):
    (doubt,) = doubts(dict(zip(("balance_error", "kinetic_over_internal"), energy, strict=True)), penetration)
    assert advice in doubt


def test_mass_that_is_scaled_much_is_named_as_the_other_cause():
    energy = {"balance_error": 0.0, "kinetic_over_internal": 84.0}
    (doubt,) = doubts(energy, 0.0, inertia=6.3)
    assert "solver.least_step_s" in doubt and "6.3" in doubt and "8,400 %" in doubt
    (doubt,) = doubts(energy, 0.0, inertia=2.1)
    assert "least_step_s" not in doubt


def test_a_run_without_rows_has_no_energies():
    assert energy_summary([]) == {"balance_error": 0.0, "kinetic_over_internal": 0.0}
