"""The identification itself, with a formula in place of the simulation: it finds what made the curve, loses nothing,
does not depend on how it was run, and leaves a card."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest
from bias_formula import bias_curve

from weftform import Fabric, Study, Target, identify
from weftform.errors import CardError, IdentificationError, ResultError
from weftform.identification import evaluations
from weftform.identification.evaluations import LOG
from weftform.identification.preparing import claim, jobs_for
from weftform.laboratory.kinematics import kinematic_angle

ANGLES = np.linspace(0.0, float(kinematic_angle(20.0, 150.0, 50.0)), 60)
QUIET = {"jobs": 1, "figures": False}


def test_polynomial_is_recovered_from_half_its_stiffness(formula, study, curve, tmp_path):
    """The law that made the curve lies in the family, so nothing but the tolerance of the fit is left."""
    softer = Study.load(
        "bias-extension",
        {
            "loading.displacement_mm": 20.0,
            "fabric.override.shear.coefficients": [0.0257, -0.2084, 0.9341, -1.8546, 1.4225],
        },
    )
    found = identify(softer, [curve], ["shear.polynomial"], out=tmp_path / "out", **QUIET)
    assert found.ok and found.misfit < 1e-4
    np.testing.assert_allclose(found.fabric.shear.modulus(ANGLES), study.fabric.shear.modulus(ANGLES), rtol=0.01)
    assert found.iterates[0].misfit == pytest.approx(0.5, rel=0.02)


def test_polynomial_is_recovered_from_a_constant(formula, study, curve, tmp_path):
    found = identify(study, [curve], ["shear.polynomial=0.03"], out=tmp_path / "out", **QUIET)
    np.testing.assert_allclose(found.fabric.shear.modulus(ANGLES), study.fabric.shear.modulus(ANGLES), rtol=0.01)


def test_table_follows_the_law_within_its_intervals(formula, study, curve, tmp_path):
    """Twelve secants of a law: its stress is met at the edges within the resolution of the curve."""
    found = identify(study, [curve], ["shear.table=0.03,intervals=12,to=26"], out=tmp_path / "out", **QUIET)
    edges = np.radians(np.linspace(0.0, 26.0, 13)[1:])
    np.testing.assert_allclose(
        found.fabric.shear.shear_stress(edges), study.fabric.shear.shear_stress(edges), rtol=0.02
    )


def test_constant_is_recovered_through_noise_with_an_honest_interval(formula, write, tmp_path):
    """2 % of noise: the force is in proportion to G12, so its standard error is 2 % over the root of 80 points, and the
    interval at least holds the truth at four of them."""
    true = Study.load(
        "bias-extension",
        {"loading.displacement_mm": 20.0, "fabric.override.shear": {"law": "constant", "modulus_MPa": 0.04}},
    )
    d, force = bias_curve(true)
    noisy = force * (1.0 + 0.02 * np.random.default_rng(4).normal(size=len(d)))
    found = identify(true, [write(d, noisy)], ["shear.G12=0.02"], out=tmp_path / "out", **QUIET)
    (value,), sure = found.values, found.uncertainty
    assert value == pytest.approx(0.04, rel=4 * 0.02 / np.sqrt(80))
    half = np.log(sure.upper[0] / value)
    assert half == pytest.approx(1.99 * 0.02 / np.sqrt(80), rel=0.35)
    assert found.misfit == pytest.approx(0.02, rel=0.25)


def test_two_tests_find_what_each_alone_would_not(formula, study, curve, write, tmp_path):
    """The shear law from the bias curve and the tension from the strip, at once."""
    strip = Study.load("tensile-warp")
    u, force = bias_curve(strip)
    pull = write(u, 1.3 * force, "pull.csv")
    found = identify(
        study, [Target(curve), Target(pull, "tensile-warp", weight=2.0)], ["shear.scale=2", "tension.scale"],
        out=tmp_path / "out", **QUIET,
    )  # fmt: skip
    assert found.values == pytest.approx((1.0, 1.3), rel=1e-3)
    card = Fabric.load(found.card)
    assert float(card.weft.force(2.0)) == pytest.approx(1.3 * float(study.fabric.weft.force(2.0)), rel=1e-3)
    assert json.loads((tmp_path / "out" / "identification.json").read_text())["curves"][1]["study"] == "tensile-warp"


def test_what_the_curves_do_not_see_is_said(formula, study, curve, tmp_path):
    """In the formula yarns do not stretch, so the bias curve knows nothing of their tension."""
    found = identify(study, [curve], ["shear.scale=2", "tension.scale"], out=tmp_path / "out", **QUIET)
    assert found.values[0] == pytest.approx(1.0, rel=1e-3)
    assert any("tension.scale is not seen" in w for w in found.warnings)
    summary = json.loads((tmp_path / "out" / "identification.json").read_text(), parse_constant=pytest.fail)
    assert summary["condition_number"] is None


def test_value_at_its_bound_is_said(formula, study, curve, tmp_path):
    found = identify(study, [curve], ["shear.scale=0.6:0.5..0.8"], out=tmp_path / "out", **QUIET)
    assert found.values[0] == pytest.approx(0.8, rel=1e-2)
    assert any("ends at its bound" in w for w in found.warnings)


def test_card_loads_and_says_where_it_comes_from(formula, study, curve, tmp_path):
    found = identify(study, [curve], ["shear.polynomial=0.03"], out=tmp_path / "out", **QUIET)
    card = Fabric.load(found.card)
    np.testing.assert_allclose(card.shear.modulus(ANGLES), found.fabric.shear.modulus(ANGLES), rtol=1e-12)
    origin = card.card.provenance["identification"]
    assert origin["files"][0]["name"] == "curve.csv" and len(origin["files"][0]["sha256"]) == 64
    assert [p["name"] for p in origin["parameters"]] == [p.name for p in found.parameters]
    assert all(p["low_95"] <= p["value"] <= p["high_95"] for p in origin["parameters"])
    assert "inverse" in card.card.shear.source
    assert float(card.warp.force(2.0)) == float(study.fabric.warp.force(2.0))


def test_card_that_exists_is_updated(formula, study, curve, tmp_path):
    from weftform.fabric.fabric import shipped_cards

    mine = tmp_path / "mine.toml"
    mine.write_text(
        "# my remark\n" + shipped_cards()["hexforce-48600-c1300"].read_text(encoding="utf-8"), encoding="utf-8"
    )
    found = identify(study, [curve], ["shear.G12"], out=tmp_path / "out", output=mine, **QUIET)
    assert mine.read_text(encoding="utf-8").startswith("# my remark")
    assert Fabric.load(mine).card.shear.modulus_MPa == pytest.approx(found.values[0])


def test_study_keys_make_no_card(formula, study, curve, tmp_path):
    found = identify(study, [curve], ["loading.duration_s"], out=tmp_path / "out", **QUIET)
    assert found.card is None and not (tmp_path / "out" / "card.toml").exists()
    with pytest.raises(IdentificationError, match="no card to write"):
        identify(study, [curve], ["loading.duration_s"], out=tmp_path / "b", output=tmp_path / "c.toml", **QUIET)


# -- nothing is lost ------------------------------------------------------------------------------------------------


def test_interrupted_identification_resumes_to_the_same_bits(formula, study, curve, tmp_path):
    """Ctrl-C anywhere: what was run is not run again, and the end is that of the one that went through."""
    fit = ["shear.polynomial=0.03,degree=2"]
    through = identify(study, [curve], fit, out=tmp_path / "through", **QUIET)
    needed = formula.calls
    out = tmp_path / "out"
    formula.calls, formula.most = 0, 7
    with pytest.raises(KeyboardInterrupt):
        identify(study, [curve], fit, out=out, **QUIET)
    assert len((out / LOG).read_text().splitlines()) == 7
    assert not (out / "scratch").exists()
    formula.calls, formula.most = 0, 10**9
    resumed = identify(study, [curve], fit, out=out, resume=True, **QUIET)
    assert formula.calls == needed - 7 and resumed.reused == 7
    assert resumed.values == through.values
    np.testing.assert_array_equal(resumed.solution.jacobian, through.solution.jacobian)


def test_line_cut_by_a_crash_is_run_again(formula, study, curve, tmp_path):
    out = tmp_path / "out"
    formula.most = 5
    with pytest.raises(KeyboardInterrupt):
        identify(study, [curve], ["shear.G12=0.02"], out=out, **QUIET)
    whole = (out / LOG).read_bytes()
    (out / LOG).write_bytes(whole[:-40])
    formula.calls, formula.most = 0, 10**9
    found = identify(study, [curve], ["shear.G12=0.02"], out=out, resume=True, **QUIET)
    assert found.ok and found.reused == 4
    assert all(json.loads(line) for line in (out / LOG).read_text().splitlines())


def test_foreign_line_in_the_log_is_refused(formula, study, curve, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / LOG).write_text('{"something": "else"}\n')
    with pytest.raises(IdentificationError, match="not a line") as caught:
        identify(study, [curve], ["shear.G12"], out=out, resume=True, **QUIET)
    assert caught.value.line == 1


def test_finished_one_resumes_without_a_simulation(formula, study, curve, tmp_path):
    first = identify(study, [curve], ["shear.G12"], out=tmp_path / "out", **QUIET)
    formula.calls = 0
    again = identify(study, [curve], ["shear.G12"], out=tmp_path / "out", resume=True, **QUIET)
    assert formula.calls == 0 and again.values == first.values and again.evaluations == 0


def test_other_studies_reuse_nothing(formula, study, curve, tmp_path):
    """The log knows a simulation by all that decides it, so a changed study never meets an old curve."""
    identify(study, [curve], ["shear.G12"], out=tmp_path / "out", **QUIET)
    formula.calls = 0
    other = Study.load("bias-extension", {"loading.displacement_mm": 20.0, "loading.duration_s": 0.5})
    found = identify(other, [curve], ["shear.G12"], out=tmp_path / "out", resume=True, **QUIET)
    assert found.reused == 0 and formula.calls == found.evaluations > 0


def test_full_disk_keeps_what_was_written(formula, study, curve, tmp_path, monkeypatch):
    written, whole = [], evaluations.os.fsync

    def full(descriptor):
        written.append(descriptor)
        if len(written) > 4:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(evaluations.os, "fsync", full)
    with pytest.raises(ResultError, match="No space left") as caught:
        identify(study, [curve], ["shear.G12=0.02"], out=tmp_path / "out", **QUIET)
    assert "--resume" in caught.value.hint
    monkeypatch.setattr(evaluations.os, "fsync", whole)
    assert identify(study, [curve], ["shear.G12=0.02"], out=tmp_path / "out", resume=True, **QUIET).reused >= 4


def test_folders_are_claimed_with_care(tmp_path, formula, study, curve):
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.tex").write_text("work")
    with pytest.raises(ResultError, match="other files"):
        claim(other, resume=False)
    with pytest.raises(ResultError, match="nothing to resume"):
        claim(tmp_path / "none", resume=True)
    out = tmp_path / "out"
    formula.most = 3
    with pytest.raises(KeyboardInterrupt):
        identify(study, [curve], ["shear.G12=0.02"], out=out, **QUIET)
    with pytest.raises(ResultError, match="interrupted") as caught:
        claim(out, resume=False)
    assert "--resume" in caught.value.hint
    assert len((out / LOG).read_text().splitlines()) == 3


# -- trials that cannot be run --------------------------------------------------------------------------------------


def test_trials_that_blow_up_are_stepped_back_from(formula, study, curve, tmp_path):
    """A trial that cannot be run is no end: the trust region shrinks."""
    _, force = bias_curve(study)
    formula.fails_above = 1.01 * float(force[-1])
    found = identify(study, [curve], ["shear.scale=0.1:0.01..100"], out=tmp_path / "out", **QUIET)
    assert found.values[0] == pytest.approx(1.0, rel=1e-3)
    failed = [json.loads(line)["failure"] for line in (tmp_path / "out" / LOG).read_text().splitlines()]
    assert "blew up" in failed


def test_start_that_cannot_be_run_is_refused(formula, study, curve, tmp_path):
    formula.fails_above = 1e-9
    with pytest.raises(IdentificationError, match="cannot be run at the start: blew up"):
        identify(study, [curve], ["shear.G12"], out=tmp_path / "out", **QUIET)


def test_too_few_steps_are_said(formula, study, curve, tmp_path):
    found = identify(study, [curve], ["shear.polynomial=0.03"], out=tmp_path / "out", most_iterations=2, **QUIET)
    assert not found.ok and any("not converged" in w for w in found.warnings)


# -- the global search ----------------------------------------------------------------------------------------------


def test_global_search_is_seeded_and_ends_at_the_same_place(formula, study, curve, tmp_path):
    pytest.importorskip("optuna")
    fit = ["shear.G12=0.002:0.001..10"]
    local = identify(study, [curve], ["shear.G12"], out=tmp_path / "local", **QUIET)
    found = [
        identify(study, [curve], fit, out=tmp_path / name, method="global", trials=20, seed=7, **QUIET) for name in "ab"
    ]
    assert found[0].values == found[1].values
    assert found[0].values[0] == pytest.approx(local.values[0], rel=1e-3)
    assert found[0].evaluations > 20


def test_global_search_without_optuna_says_what_to_install(formula, study, curve, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    with pytest.raises(IdentificationError, match="not installed") as caught:
        identify(study, [curve], ["shear.G12"], out=tmp_path / "out", method="global", **QUIET)
    assert "weftform[search]" in caught.value.expected
    assert not (tmp_path / "out").exists()


# -- refusals -------------------------------------------------------------------------------------------------------


def test_too_few_points_for_the_parameters_are_refused(formula, study, curve, tmp_path):
    with pytest.raises(IdentificationError, match="cannot determine") as caught:
        identify(study, [Target(curve, range_mm=(0.0, 1.0))], ["shear.table"], out=tmp_path / "out", **QUIET)
    assert caught.value.got == "4" and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("keywords", "error"),
    [
        ({"jobs": 0}, IdentificationError),
        ({"most_iterations": 0}, IdentificationError),
        ({"output": "card.json"}, CardError),
        ({"output": "/nowhere/at/all/card.toml"}, CardError),
    ],
)
def test_bad_settings_are_refused_before_anything_runs(formula, study, curve, tmp_path, keywords, error):
    with pytest.raises(error):
        identify(study, [curve], ["shear.G12"], out=tmp_path / "out", figures=False, **keywords)
    assert formula.calls == 0


def test_no_target_is_refused(study, tmp_path):
    with pytest.raises(IdentificationError, match="no curve"):
        identify(study, [], ["shear.G12"], out=tmp_path / "out")


def test_jobs_follow_the_work():
    assert jobs_for(5, 1) == 5
    assert jobs_for(None, 1) == 1
    with pytest.raises(IdentificationError):
        jobs_for(0, 1)


# -- figures and the command line -----------------------------------------------------------------------------------


def test_figures_are_drawn(formula, study, curve, tmp_path):
    identify(study, [curve], ["shear.polynomial=0.03,degree=2"], out=tmp_path / "out", jobs=1, most_iterations=1)
    for name in ("current", "curves", "shear-law", "correlation"):
        assert (tmp_path / "out" / f"{name}.png").stat().st_size > 5000


def command(*words: str):
    from typer.testing import CliRunner

    from weftform.cli import app

    return CliRunner().invoke(app, ["identify", *map(str, words)])


def test_command_prints_the_parameters_and_the_summary(formula, curve, tmp_path):
    common = [
        "bias-extension",
        "--set",
        "loading.displacement_mm=20",
        "--target",
        curve,
        "--fit",
        "shear.G12=0.03:0.01..0.2",
    ]
    common += ["--out", tmp_path / "out", "--jobs", "1", "--no-figures"]
    shown = command(*common)
    assert shown.exit_code == 0, shown.output
    assert "shear.G12" in shown.output and "95 %" in shown.output and "step 1" in shown.output
    printed = command(*common, "--json", "--quiet")
    (parameter,) = json.loads(printed.stdout)["parameters"]
    assert parameter["bounds"] == [0.01, 0.2] and parameter["low_95"] < parameter["value"] < parameter["high_95"]


@pytest.mark.parametrize(
    "words",
    [
        ["--range", "12..5"],
        ["--range", "5"],
        ["--range", "tensile-warp=0..3"],
        ["--weight", "bias-extension=heavy"],
        ["--weight", "bias-extension=-1"],
        ["--fit", "shear.G13"],
        ["--layout", "layout.toml"],
    ],
)
def test_command_refuses_with_exit_code_2(formula, curve, tmp_path, words):
    from weftform.errors import WeftformError

    result = command(
        "bias-extension", "--target", curve, "--fit", "shear.G12", "--out", tmp_path / "out", "--no-figures", *words
    )  # fmt: skip
    assert isinstance(result.exception, WeftformError) and result.exception.exit_code == 2
    assert formula.calls == 0 and not (tmp_path / "out").exists()


def test_command_ties_curves_ranges_and_weights_to_studies(curve):
    from weftform.cli.identify import targets_of

    made = targets_of(
        [str(curve), "tensile-warp=pull.csv"], "bias-extension", ["0..16", "tensile-warp=0..3"], ["tensile-warp=0.5"]
    )
    assert made == [Target(str(curve), None, 1.0, (0.0, 16.0)), Target("pull.csv", "tensile-warp", 0.5, (0.0, 3.0))]
