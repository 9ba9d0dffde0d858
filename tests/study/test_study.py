"""Studies: the shipped ones load, bad ones are refused with place, expectation and hint, and TOML round trips."""

from __future__ import annotations

import math
import time

import pytest

from weftform.cases import case_of
from weftform.errors import CardError, StudyError
from weftform.fabric.fabric import shipped_cards
from weftform.study import Study
from weftform.study.schema import MODELS
from weftform.study.study import shipped_studies

HEMISPHERE = shipped_studies()["hemisphere-0-90"].read_text()
UNBALANCED = {
    "fabric.override": {
        "tension": {
            "weft": {
                "law": "linear",
                "stiffness_N_per_mm": 50.0,
                "specimen_length_mm": 150.0,
                "specimen_width_mm": 50.0,
            }
        }
    }
}


def line_with(text, beginning):
    return next(k for k, line in enumerate(text.splitlines(), 1) if line.startswith(beginning))


def written(tmp_path, *replacements, name="study.toml"):
    text = HEMISPHERE
    for old, new in replacements:
        assert old in text, old
        text = text.replace(old, new, 1)
    file = tmp_path / name
    file.write_text(text)
    return file, text


def refused(source, changes=(), error=StudyError):
    with pytest.raises(error) as caught:
        Study.load(source, changes)
    assert caught.value.exit_code == 2
    assert str(caught.value).count("\n") <= 3
    return caught.value


# -- what is accepted ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", shipped_studies())
def test_shipped_study_loads_under_its_name(name):
    study = Study.load(name)
    assert study.name == name
    if study.model.kind == "forming":
        assert study.grid.cell_count > 100
        assert {tool.name for tool in study.tools} == set(study.model.contact)
        return
    assert study.tools == ()
    assert (study.grid.cell_count == 1) == (study.model.kind == "element")


def test_every_kind_of_study_is_shipped():
    assert {Study.load(name).model.kind for name in shipped_studies()} == set(MODELS)


@pytest.mark.parametrize("name", ["hemisphere-0-90", "hemisphere-45"])
def test_hemisphere_is_that_of_the_paper(name):
    """150 x 150 mm, 30 mm of stroke, 238.45 N, friction 0.2; a quarter of the blank, cells near 2.69 mm."""
    study = Study.load(name)
    grid, tools = study.grid, {tool.name: tool for tool in study.tools}
    assert grid.area == pytest.approx(150 * 150 / 4, rel=1e-12)
    assert grid.warp_pitch == pytest.approx(2.69, rel=0.02)
    assert study.model.loading.stroke_mm == 30.0
    assert tools["punch"].radius == 25.0
    assert tools["die"].s0 - tools["die"].radius == pytest.approx(27.7)
    assert tools["die"].radius == 6.0
    assert tools["blank_holder"].force == 238.45
    assert {tool.friction for tool in study.tools} == {0.2}
    assert [tools[n].up for n in ("punch", "die", "blank_holder")] == [1.0, -1.0, 1.0]
    problem = case_of(study).problem()
    assert problem.motions[problem.stroke].values == (0.0, 30.0)
    loading = study.model.loading
    assert problem.motions[problem.stroke].times == pytest.approx(
        (loading.closing_s, loading.closing_s + loading.duration_s)
    )
    assert problem.settings.ramps == (loading.ramp, loading.end_ramp)


@pytest.mark.parametrize("name", shipped_studies())
def test_toml_round_trip_gives_an_equal_model(name, tmp_path):
    forming = name.startswith("hemisphere")
    study = Study.load(name, {**({"blank.cell_length_mm": 5.3} if forming else {}), "solver.mass_scaling": 2.0})
    file = tmp_path / "again.toml"
    file.write_text(study.to_toml("a header\nof two lines"))
    again = Study.load(file)
    assert again.model == study.model
    assert (again.grid.cells == study.grid.cells).all()
    assert again.fabric.card == study.fabric.card


def test_resolved_study_names_every_default(tmp_path):
    text = Study.load("hemisphere-0-90").to_toml()
    for key in ("mass_scaling", "hourglass", "safety", "tangential_ratio", "stiffness_N_per_mm3", "ramp", "fit_cells"):
        assert f"{key} = " in text


def test_card_next_to_the_study_is_found_and_made_absolute(tmp_path):
    card = shipped_cards()["hexforce-48600-c1300"].read_text()
    (tmp_path / "mine.toml").write_text(card.replace("thickness_mm = 0.62", "thickness_mm = 0.5"))
    file, _ = written(tmp_path, ('card = "hexforce-48600-c1300"', 'card = "mine.toml"'))
    study = Study.load(file)
    assert study.fabric.thickness == 0.5
    elsewhere = tmp_path / "deep" / "copy.toml"
    elsewhere.parent.mkdir()
    elsewhere.write_text(study.to_toml())
    assert Study.load(elsewhere).fabric.thickness == 0.5


def test_changes_replace_values_and_may_add_keys():
    study = Study.load(
        "hemisphere-0-90", ["blank.warp_angle_deg=90", "solver.safety = 0.5", "name=other", 'description="x = y"']
    )
    assert study.model.blank.warp_angle_deg == 90.0
    assert study.model.solver.safety == 0.5
    assert study.name == "other"
    assert study.model.description == "x = y"
    assert Study.load("hemisphere-0-90", {"output.frames": 7}).model.output.frames == 7


def test_outlines_of_other_kinds():
    disc = {"blank.outline": "disc", "blank.diameter_mm": 150.0}
    text = {**disc}
    error = refused("hemisphere-0-90", text)
    assert "width_mm has no meaning" in error.message
    study = Study.load(shipped_studies()["hemisphere-0-90"], [])
    model = study.model.model_copy(
        update={
            "blank": study.model.blank.model_copy(
                update={"outline": "disc", "width_mm": None, "height_mm": None, "diameter_mm": 150.0}
            )
        }
    )
    made = Study(model, study.file)
    made.check()
    assert made.grid.area == pytest.approx(math.pi * 75**2 / 4, rel=0.01)


def test_symmetry_at_45_degrees_is_for_balanced_fabrics_only():
    """Along the yarns an unbalanced fabric has its planes of symmetry; on the full blank it needs none."""
    for symmetry in ("quarter", "half-x", "half-y"):
        error = refused("hemisphere-45", {**UNBALANCED, "blank.symmetry": symmetry})
        assert error.key == "blank.symmetry"
        assert "unbalanced" in error.message
        assert "exchanged" in error.message
    coarse = {**UNBALANCED, "blank.cell_length_mm": 6.0}
    assert Study.load("hemisphere-45", {**coarse, "blank.symmetry": "full"}).grid.copies == 1
    assert Study.load("hemisphere-0-90", coarse).grid.copies == 4


# -- bad values ------------------------------------------------------------------------------------


SIZES = [
    "width_mm",
    "height_mm",
    "cell_length_mm",
    "diameter_mm",
    "hole_diameter_mm",
    "force_N",
    "stroke_mm",
    "duration_s",
]


@pytest.mark.parametrize("key", SIZES)
@pytest.mark.parametrize("value", ["-1.0", "0.0", "nan", "inf", "-inf", '"wide"', "[1.0]", "true", '"1.5"'])
def test_sizes_that_are_none_are_refused_with_their_line(tmp_path, key, value):
    start = next(line for line in HEMISPHERE.splitlines() if line.startswith(f"{key} = "))
    file, text = written(tmp_path, (start, f"{key} = {value}"))
    error = refused(file)
    assert error.file == file
    assert error.line == line_with(text, f"{key} = {value}")
    assert error.key.endswith(key)
    assert error.got is not None


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ("contact.die.friction=-0.1", "contact.die.friction"),
        ("contact.die.friction=nan", "contact.die.friction"),
        ("loading.closing_s=-1", "loading.closing_s"),
        ("loading.ramp=0.6", "loading.ramp"),
        ("loading.ramp=0", "loading.ramp"),
        ("solver.safety=1.1", "solver.safety"),
        ("solver.safety=0", "solver.safety"),
        ("solver.mass_scaling=0.5", "solver.mass_scaling"),
        ("solver.damping_per_s=-1", "solver.damping_per_s"),
        ("output.frames=1", "output.frames"),
        ("output.rows=2.5", "output.rows"),
        ("blank.warp_angle_deg=1e9", "blank.warp_angle_deg"),
        ("blank.outline=star", "blank.outline"),
        ("blank.symmetry=eighth", "blank.symmetry"),
        ("tools.punch.motion=dance", "tools.punch.motion"),
        ("format=2", "format"),
        ("kind=weaving", "kind"),
        ("tools=3", "tools"),
        ("blank=3", "blank"),
        ("blank.width_mm.deep=3", "blank.width_mm"),
    ],
)
def test_values_out_of_range_are_refused_by_key(change, key):
    error = refused("hemisphere-0-90", [change])
    assert error.key == key


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ("loading.end_ramp=0.7", "a number, greater than 0 and at most 0.5"),
        ("loading.closing_s=-1", "a number, at least 0"),
        ("loading=3", "a table with the keys stroke_mm, closing_s, duration_s, ramp, end_ramp"),
        ("output.rows=2.5", "a whole number, at least 2 and at most 100000"),
        ("blank.fit_cells=3", "true or false"),
        ("blank.symmetry=eighth", "one of full, half-x, half-y, quarter"),
        ("tools.punch.shape=cube", "one of hemisphere, flat-punch, opening"),
        ("format=2", "1"),
        ("tools.die.hole_diameter_mm=51", "at least 51.24 mm for the diameter of 50 mm"),
        ("tools.blank_holder.hole_diameter_mm=49", "at least 50 mm for the diameter of 50 mm"),
    ],
)
def test_what_is_expected_is_said(change, expected):
    error = refused("hemisphere-0-90", [change])
    assert error.expected == expected
    assert str(error).startswith(f"change {change}, key ")


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ("nosuch.key=3", StudyError),
        ("fabric.card=nope", CardError),
        ("fabric.override.fabric.thicknes_mm=0.5", CardError),
        ("fabric.override.fabric.thickness_mm=-1", CardError),
        ("fabric.override.fabric={thickness_mm=-1}", CardError),
    ],
)
def test_a_change_is_blamed_for_what_it_brings(change, error):
    assert str(refused("hemisphere-0-90", [change], error)).startswith(f"change {change.partition('=')[0]}=")


def test_a_card_is_blamed_for_what_no_change_brings(tmp_path):
    card = tmp_path / "bad.toml"
    card.write_text(
        shipped_cards()["hexforce-48600-c1300"].read_text().replace("thickness_mm = 0.62", "thickness_mm = -1")
    )
    changes = [f"fabric.card={card}", "fabric.override.fabric.areal_weight_g_m2=500"]
    assert str(refused("hemisphere-45", changes, CardError)).startswith(f"{card}, line 10")


def test_the_last_of_several_changes_wins():
    study = Study.load("hemisphere-45", ["solver.safety=0.5", "solver={safety=0.7}", "solver.safety=0.6"])
    assert study.model.solver.safety == 0.6


def test_a_bad_card_of_a_change_is_named_with_its_line(tmp_path):
    card = tmp_path / "bad.toml"
    card.write_text(
        shipped_cards()["hexforce-48600-c1300"].read_text().replace("thickness_mm = 0.62", "thickness_mm = -1")
    )
    error = refused("hemisphere-45", [f"fabric.card={card}"], CardError)
    assert str(error).startswith(f"{card}, line 10, key fabric.thickness_mm: ")


def test_a_bad_change_is_named_and_not_a_line_of_the_file():
    """Also one that only fails with what the file says."""
    for change in ("blank.cell_length_mm=-1", "blank.warp_cell_mm=3", "blank.symmetry=eighth"):
        error = refused("hemisphere-0-90", [change])
        assert str(error).startswith(f"change {change}, key {change.partition('=')[0]}: ")
        assert error.line is None


@pytest.mark.parametrize(
    ("change", "key", "hint"),
    [
        ("blank.widht_mm=3", "blank.widht_mm", "width_mm"),
        ("blnk.width_mm=3", "blnk", "blank"),
        ("solver.saftey=0.5", "solver.saftey", "safety"),
        ("tools.punch.diametre_mm=50", "tools.punch.diametre_mm", "diameter_mm"),
    ],
)
def test_unknown_key_is_refused_with_what_is_known_and_the_nearest(change, key, hint):
    error = refused("hemisphere-0-90", [change])
    assert "unknown key" in error.message
    assert error.key == key
    assert hint in error.hint


def test_unknown_key_in_a_file_is_placed(tmp_path):
    file, text = written(tmp_path, ("width_mm = 150.0", "widht_mm = 150.0"))
    error = refused(file)
    assert error.line == line_with(text, "widht_mm")
    assert "width_mm" in error.expected


@pytest.mark.parametrize("change", ["blank.width_mm", "=3", " = 3", ""])
def test_change_of_another_form_is_refused(change):
    assert "dotted.key=value" in refused("hemisphere-0-90", [change]).message


def test_change_of_a_value_into_a_table_is_refused():
    error = refused("hemisphere-0-90", ["name.first=x"])
    assert error.key == "name.first"


def test_unknown_tool_is_refused(tmp_path):
    file, _ = written(tmp_path, ("[contact.die]", "[contact.dye]"))
    error = refused(file)
    assert "dye" in error.message and "punch, die, blank_holder" in error.message


def test_tool_without_contact_is_refused(tmp_path):
    file, _ = written(tmp_path, ("[contact.die]\nfriction = 0.2\n", ""))
    assert "tool die has no [contact.die]" in refused(file).message


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"tools.punch.motion": "fixed"}, 'one tool makes the stroke (motion = "stroke"); here 0 do'),
        (
            {"tools.die.motion": "stroke"},
            'one tool makes the stroke (motion = "stroke"); here 2 do',
        ),
        ({"tools.punch.hole_diameter_mm": 5.0}, "hole_diameter_mm has no meaning"),
        ({"tools.die.diameter_mm": 5.0}, "diameter_mm has no meaning"),
        ({"tools.punch.shape": "flat-punch"}, "needs edge_radius_mm"),
        ({"tools.punch.shape": "flat-punch", "tools.punch.edge_radius_mm": 26.0}, "at most half of diameter_mm"),
        ({"tools.die.force_N": 5.0}, 'force_N goes with motion = "force"'),
        ({"tools.die.motion": "force"}, 'force_N goes with motion = "force"'),
        ({"tools.die.mass_kg": 5.0}, 'mass_kg goes with motion = "force"'),
    ],
)
def test_tools_that_make_no_sense_are_refused(changes, words):
    assert words in refused("hemisphere-0-90", changes).message


# -- bad geometry ----------------------------------------------------------------------------------


@pytest.mark.parametrize("sizes", [(60.0, 60.0), (150.0, 66.0), (67.4, 150.0)])
def test_blank_smaller_than_the_hole_with_its_fillet_is_refused(sizes):
    """The die's hole with its fillet is 67.4 mm wide."""
    error = refused("hemisphere-0-90", {"blank.width_mm": sizes[0], "blank.height_mm": sizes[1]})
    assert "smaller than the hole of the die" in error.message
    assert error.line is not None and error.expected and error.got


def test_blank_that_lies_beside_the_hole_is_refused():
    """Its edge is far from the axis, but on the wrong side of it."""
    blank = {"outline": "polygon", "points_mm": [(100, 100), (160, 100), (160, 160), (100, 160)], "cell_length_mm": 5.0}
    model = Study.load("hemisphere-0-90").model
    blank_table = type(model.blank).model_validate(blank)
    study = Study(model.model_copy(update={"blank": blank_table}))
    with pytest.raises(StudyError, match="hole of the die"):
        study.check()


def test_punch_that_does_not_fit_through_the_die_is_refused():
    error = refused("hemisphere-0-90", {"tools.punch.diameter_mm": 55.0})
    assert error.key == "tools.die.hole_diameter_mm"
    assert error.got == "55.4 mm"
    assert error.expected == "at least 56.24 mm for the diameter of 55 mm"


@pytest.mark.parametrize("length", [151.0, 1e3, 1e9])
@pytest.mark.parametrize("name", ["hemisphere-0-90", "hemisphere-45"])
def test_cell_length_that_gives_no_cell_is_refused(name, length):
    error = refused(name, {"blank.cell_length_mm": length})
    assert "no cell" in error.message
    assert error.key == "blank.cell_length_mm"
    assert str(error.file) == f"change blank.cell_length_mm={length}"


@pytest.mark.parametrize("length", [0.016, 1e-3, 1e-12])
@pytest.mark.parametrize("name", ["hemisphere-0-90", "hemisphere-45"])
def test_cell_length_that_gives_over_20_million_is_refused_at_once(name, length):
    start = time.perf_counter()
    error = refused(name, {"blank.cell_length_mm": length})
    assert time.perf_counter() - start < 1.0
    assert "20,000,000" in error.expected


@pytest.mark.parametrize("degrees", [30, 1, -44])
@pytest.mark.parametrize("symmetry", ["quarter", "half-x", "half-y"])
def test_angle_with_the_wrong_symmetry_is_refused(degrees, symmetry):
    error = refused("hemisphere-0-90", {"blank.warp_angle_deg": degrees, "blank.symmetry": symmetry})
    assert error.key == "blank.symmetry"
    assert "full" in error.hint


def test_polygon_that_crosses_itself_is_refused(tmp_path):
    file, _ = written(
        tmp_path,
        ('outline = "rectangle"', 'outline = "polygon"'),
        ("width_mm = 150.0", "points_mm = [[-70, -70], [70, 70], [70, -70], [-70, 70]]"),
        ("height_mm = 150.0", ""),
    )
    error = refused(file)
    assert error.key == "blank.points_mm"
    assert "not a simple outline" in error.message


# -- bad cards -------------------------------------------------------------------------------------


def test_card_whose_tension_is_not_monotone_is_refused_with_the_reason():
    error = refused("hemisphere-0-90", {"fabric.tension_variant": "printed"}, CardError)
    assert "not monotone" in error.message
    assert error.key == "tension.variants.printed.warp"
    assert error.file is not None and error.line is not None


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"fabric.card": "no-such-card"}, "no card named"),
        ({"fabric.card": "no-such-card.toml"}, "no such file"),
        ({"fabric.tension_variant": "typo"}, "no tension variant"),
        ({"fabric.override": {"fabric": {"thickness_mm": -1.0}}}, "greater than 0"),
        ({"fabric.override": {"fabric": {"thicknes_mm": 1.0}}}, "unknown key"),
    ],
)
def test_bad_card_is_refused(changes, words):
    assert words in refused("hemisphere-0-90", changes, CardError).message


# -- bad files -------------------------------------------------------------------------------------


def test_missing_file_is_refused_with_what_lies_near(tmp_path):
    written(tmp_path, name="hemisphere.toml")
    error = refused(tmp_path / "hemisphre.toml")
    assert "no such file" in error.message
    assert "hemisphere.toml" in error.hint
    assert "does not exist" in refused(tmp_path / "nowhere" / "study.toml").hint


def test_unknown_name_is_refused_with_the_shipped_ones():
    assert "hemisphere-45" in refused("hemisphere-90").expected
    assert refused("hemisfere").hint == "did you mean hemisphere-45?"
    assert "weftform new" in refused("qqq").hint


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"name = = 3\n", "not valid TOML"),
        (b"PK\x03\x04\xff\xfe\x00\x01", "UTF-8"),
        (b"\x00\x01\x02", "not valid TOML"),
        (b"", "kind is missing"),
        (b"# nothing\n", "kind is missing"),
        (b"[blank]\nwidth_mm = 3\n[blank]\n", "not valid TOML"),
    ],
)
def test_file_that_is_no_study_is_refused(tmp_path, content, words):
    file = tmp_path / "bad.toml"
    file.write_bytes(content)
    error = refused(file)
    assert words in error.message
    assert error.file == file


def test_line_of_a_syntax_error_is_given(tmp_path):
    file, text = written(tmp_path, ("height_mm = 150.0", "height_mm = = 150.0"))
    assert refused(file).line == line_with(text, "height_mm")


def test_folder_is_no_study(tmp_path):
    assert "folder" in refused(tmp_path).message


def test_enormous_file_is_refused_without_reading_it(tmp_path):
    file = tmp_path / "big.toml"
    with file.open("wb") as out:
        out.truncate(10**10)
    start = time.perf_counter()
    assert "too large" in refused(file).message
    assert time.perf_counter() - start < 1.0


def test_card_of_a_change_is_seen_from_the_current_folder(tmp_path, monkeypatch):
    """Of a shipped study or of one in another folder; a card named in the study itself is beside it."""
    from weftform.fabric import shipped_cards

    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    there.mkdir()
    text = shipped_cards()["hexforce-48600-c1300"].read_text(encoding="utf-8")
    (here / "mine.toml").write_text(text.replace('name = "hexforce-48600-c1300"', 'name = "mine"'), encoding="utf-8")
    monkeypatch.chdir(here)
    study = Study.load("picture-frame", ["fabric.card=mine.toml"])
    assert study.fabric.name == "mine"
    (there / "again.toml").write_text(study.to_toml(), encoding="utf-8")
    monkeypatch.chdir(there)
    assert Study.load("again.toml").fabric.name == "mine"
