"""The command line: cards written whole or not at all, provenance, figures, exit codes."""

from __future__ import annotations

import hashlib
import tomllib

import numpy as np
import pytest
from paper_equations import eq8
from typer.testing import CliRunner

from weftform.cli.characterise import app
from weftform.fabric import Fabric
from weftform.laboratory import sample
from weftform.laboratory.samples import copy_samples, write_samples

SIZE = ["--height", "150", "--width", "50"]
NEW = ["--areal-weight", "600", "--thickness", "0.62"]


def _run(*arguments, code: int = 0):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert result.exit_code == code, result.output
    assert "Traceback" not in result.output
    return result


def _bias(*more, code: int = 0):
    markers = ["--markers", *sample("bias-extension-markers"), "--layout", *sample("bias-extension-layout")]
    return _run("bias-extension", *sample("bias-extension"), *SIZE, *markers, *more, code=code)


@pytest.fixture(scope="module")
def whole_card(tmp_path_factory):
    """A card made once from the shipped bias-extension specimens."""
    card = tmp_path_factory.mktemp("card") / "card.toml"
    _run(
        "bias-extension",
        *sample("bias-extension"),
        *SIZE,
        *NEW,
        "--tension-stiffness",
        5000,
        "-o",
        card,
        "--no-figures",
        "--to-deg",
        20,
    )
    return card


def test_three_runs_make_a_whole_card(tmp_path) -> None:
    card = tmp_path / "card.toml"
    _bias(*NEW, "--tension-stiffness", 5000, "--name", "sample fabric", "-o", card, "--no-figures")
    assert Fabric.load(card).card.tension.warp.law == "linear"
    _run("tensile", *sample("tensile-warp"), *SIZE, "-o", card, "--no-figures")
    _run("tensile", *sample("tensile-weft"), *SIZE, "--direction", "weft", "-o", card, "--no-figures")
    fabric = Fabric.load(card)
    assert fabric.name == "sample fabric" and not fabric.balanced
    assert float(fabric.warp.force(3.0)) == pytest.approx(6995.4, rel=0.03)
    assert float(fabric.weft.force(3.0)) == pytest.approx(0.96 * 6995.4, rel=0.03)
    at = np.radians([10.0, 20.0, 30.0])
    np.testing.assert_allclose(fabric.normalised_shear_force(at), eq8(at), rtol=0.05)
    origin = tomllib.loads(card.read_text())["provenance"]
    assert set(origin) == {"shear", "tension-warp", "tension-weft"}
    first = sample("tensile-warp")[0]
    assert origin["tension-warp"]["files"][0] == {
        "name": first.name,
        "sha256": hashlib.sha256(first.read_bytes()).hexdigest(),
    }
    assert origin["shear"]["slip_mm"] == pytest.approx(16.5, abs=0.5)
    assert {"interval_deg", "rms_N", "r_squared", "covariance", "points"} <= set(origin["shear"])


def test_a_card_that_lacks_something_is_not_written(tmp_path) -> None:
    card = tmp_path / "card.toml"
    result = _run("tensile", *sample("tensile-warp"), *SIZE, "-o", card, code=2)
    for words in (
        "fabric.areal_weight_g_m2",
        "--areal-weight",
        "tension.weft",
        "shear",
        "nothing is written",
        "--from",
    ):
        assert words in result.output
    assert not any(tmp_path.iterdir())


def test_new_card_from_another(tmp_path) -> None:
    card = tmp_path / "mine.toml"
    _run(
        "tensile",
        *sample("tensile-warp"),
        *SIZE,
        "--direction",
        "both",
        "--from",
        "hexforce-48600-c1300",
        "-o",
        card,
        "--no-figures",
    )
    fabric = Fabric.load(card)
    assert fabric.name == "mine" and fabric.balanced and fabric.card.fabric.weave == ""
    assert "hexforce-48600-c1300" in fabric.card.provenance["taken_from"]
    result = _run("tensile", *sample("tensile-warp"), *SIZE, "--from", "hexforce-48600-c1300", "-o", card, code=2)
    assert "is updated" in result.output


def test_update_keeps_the_comments_and_the_rest(tmp_path) -> None:
    from weftform.fabric import shipped_cards

    card = tmp_path / "card.toml"
    card.write_text(shipped_cards()["hexforce-48600-c1300"].read_text())
    result = _run("tensile", *sample("tensile-warp"), *SIZE, "-o", card, "--no-figures")
    text = card.read_text()
    assert "# Table 1, nominal weight" in text and "[tension.variants.printed.warp]" in text
    assert "the weft of the card is the same as the warp" in result.output
    assert Fabric.load(card).card.shear.source == "Eq. 8"


def test_card_without_a_change_is_the_same_bytes(tmp_path) -> None:
    cards = [tmp_path / "a.toml", tmp_path / "b.toml"]
    for card in cards:
        _run(
            "tensile",
            *sample("tensile-warp"),
            *SIZE,
            *NEW,
            "--direction",
            "both",
            "--shear-modulus",
            0.1,
            "--name",
            "x",
            "-o",
            card,
            "--no-figures",
        )
    assert cards[0].read_bytes() == cards[1].read_bytes()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--thickness", "0.5"], "the card says 0.62, the option 0.5"),
        (["--name", "other"], "the option says other"),
        (["--height", "90"], "height / width >= 2"),
        (["--column", "force"], "NAME=VALUE"),
        (["--column", "force=nowhere"], "no column for force_N"),
        (["--unit", "force=mm"], "no unit of force_N"),
        (["--only", "nobody", "--preset", "zwick"], "no reader preset"),
        (["--from-deg", "5"], "without its end"),
        (["--layout", "x.toml"], "belong to --markers"),
        (["--angle", "measured"], "no measured angle"),
    ],
)
def test_bad_options_leave_the_card_alone(arguments, words, tmp_path, whole_card) -> None:
    card = tmp_path / "card.toml"
    card.write_bytes(whole_card.read_bytes())
    before = card.read_bytes()
    result = _run("bias-extension", *sample("bias-extension"), *SIZE, "-o", card, "--no-figures", *arguments, code=2)
    assert words in result.output and len(result.output) < 3000
    assert card.read_bytes() == before and list(tmp_path.iterdir()) == [card]


def test_card_that_would_not_be_valid_is_refused_and_nothing_written(tmp_path, write) -> None:
    u = np.linspace(0.0, 3.0, 100)
    path = write("falls.csv", u, np.sin(u) * 100.0)
    card = tmp_path / "card.toml"
    result = _run(
        "tensile",
        path,
        *SIZE,
        *NEW,
        "--shear-modulus",
        0.1,
        "--direction",
        "both",
        "--not-monotone",
        "--to-mm",
        2.9,
        "-o",
        card,
        code=2,
    )
    assert "nothing is written" in result.output and "not monotone" in result.output
    assert list(tmp_path.iterdir()) == [path]
    _run(
        "tensile",
        path,
        *SIZE,
        *NEW,
        "--shear-modulus",
        0.1,
        "--direction",
        "both",
        "-o",
        tmp_path / "no" / "c.toml",
        code=2,
    )
    _run(
        "tensile",
        path,
        *SIZE,
        *NEW,
        "--shear-modulus",
        0.1,
        "--direction",
        "both",
        "-o",
        tmp_path / "c.json",
        code=2,
    )


def test_figures_are_drawn_beside_the_card(tmp_path) -> None:
    card = tmp_path / "card.toml"
    _bias(*NEW, "--tension-stiffness", 5000, "-o", card)
    drawn = {p.name for p in (tmp_path / "card-figures").iterdir()}
    assert drawn == {f"bias-extension-{name}.png" for name in ("force", "angles", "zones", "shear-force", "moduli")}
    _run("tensile", *sample("tensile-warp"), *SIZE, "--figures", tmp_path / "f")
    assert (tmp_path / "f" / "tensile-warp.png").stat().st_size > 10_000
    _run(
        "picture-frame",
        *sample("cao2008-picture-frame"),
        "--only",
        "UML",
        "--height",
        100,
        "--width",
        100,
        "--thickness",
        1.2,
        "--figures",
        tmp_path / "f",
    )
    assert len(list((tmp_path / "f").iterdir())) == 3


def test_shear_map_of_a_full_field_export(tmp_path) -> None:
    png, table = tmp_path / "new" / "map.png", tmp_path / "map.csv"
    result = _run("shear-map", *sample("dic-aramis"), "--png", png, "--csv", table)
    assert "mean 20.0" in result.output and "1 of 63 points lost" in result.output
    assert png.stat().st_size > 10_000
    angle = np.loadtxt(table, delimiter=",", skiprows=1)[:, 2]
    # trellis of 20 degrees; 0.003 mm of noise on points 3 mm apart
    assert angle.mean() == pytest.approx(20.0, abs=0.1) and np.abs(angle - 20.0).max() < 1.0
    turned = _run("shear-map", *sample("dic-aramis"), "--png", png, "--warp-deg", "-45")
    assert "mean 20.0" in turned.output or "mean -20.0" in turned.output
    assert "triangulated" in _run("shear-map", _line(tmp_path), "--png", png, code=2).output
    assert (
        "cannot be written"
        in _run("shear-map", *sample("dic-aramis"), "--csv", tmp_path / "no" / "m.csv", code=2).output
    )


def _line(folder):
    path = folder / "line.csv"
    path.write_text("x_mm,y_mm,shift_x_mm,shift_y_mm\n" + "".join(f"{k},{k},0,0\n" for k in range(9)))
    return path


def test_help_needs_no_heavy_import() -> None:
    import subprocess
    import sys

    code = (
        "import sys\nfrom typer.testing import CliRunner\nfrom weftform.cli.characterise import app\n"
        "r = CliRunner().invoke(app, ['tensile', '--help'])\nassert r.exit_code == 0, r.output\n"
        "heavy = {'numpy', 'scipy', 'matplotlib', 'numba', 'tomlkit'} & set(sys.modules)\nassert not heavy, "
        "heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_shipped_samples_are_what_the_generator_writes(tmp_path) -> None:
    for path in write_samples(tmp_path):
        shipped = sample("tensile-warp")[0].parent / path.name
        assert path.read_bytes() == shipped.read_bytes(), path.name
        assert b"RECONSTRUCTED" in path.read_bytes()


def test_samples_can_be_copied(tmp_path) -> None:
    assert len(copy_samples(tmp_path / "s")) == 21
