"""Every example runs and its number is what physics says."""

from __future__ import annotations

import importlib.util
import math
import re
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "examples"


def example(name: str) -> ModuleType:
    specification = importlib.util.spec_from_file_location(f"example_{name}", FOLDER / f"{name}.py")
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_every_example_is_tested() -> None:
    tested = {"hemisphere_angles", "compare_holder_forces", "tensile_strip", "picture_frame_of_a_laboratory"}
    assert {path.stem for path in FOLDER.glob("*.py")} == tested


def test_the_net_of_the_pole_is_flat() -> None:
    # close to the pole f = pi/2 - z + ..., so the angle is u v / R^2
    angle = example("hemisphere_angles").kinematic_angle(1.0, 1.0, 25.0)
    assert angle == pytest.approx(57.29578 / 625.0, rel=2e-3)


def test_hemisphere_follows_the_kinematic_net() -> None:
    # stiff yarns on a sphere: within 1 degree is asked of the default cells, and these are twice as long
    assert example("hemisphere_angles").main() < 1.0


@pytest.mark.slow
def test_holder_acts_through_friction_alone() -> None:
    # Two faces rub with mu = 0.2 where the holder presses, and the friction on the fillet of the die multiplies the
    # pull by at most exp(mu pi / 2) (Euler, Eytelwein). The edge is drawn in by less than the punch travels, and
    # nowhere by less than at the corner (2.7 mm of 30), so by the balance of work the slope lies between:
    slope = example("compare_holder_forces").main()
    assert 0.4 * 2.7 / 30.0 < slope < 0.4 * math.exp(0.1 * math.pi)


def test_strip_returns_the_curve_of_the_card() -> None:
    # Eq. 11 is exact for straight lines of equal connectors; what is left is inertia and the output's averaging
    assert example("tensile_strip").main() < 0.01


def test_virtual_frame_of_a_laboratory_returns_its_table(tmp_path) -> None:
    # reading the points off a printed figure costs about 1 % of its axis, which ends a little above the largest force
    assert example("picture_frame_of_a_laboratory").main(tmp_path) < 0.01
    assert (tmp_path / "frame.png").stat().st_size > 10_000


@pytest.mark.slow
def test_script_of_the_readme(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"^```python\n(.*?)^```", text, flags=re.S | re.M)
    assert len(script.splitlines()) <= 15
    exec(script, {})
    printed = capsys.readouterr().out
    # half-diagonal yarns: the point 10 mm along warp and weft of a blank turned by 45 degrees stays on the y axis
    assert "yarns (10, 10) at (-0.0," in printed or "yarns (10, 10) at (0.0," in printed
    assert "punch force at 15 mm" in printed
