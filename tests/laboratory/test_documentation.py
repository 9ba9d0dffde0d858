"""The examples in the docstrings and on the page work as they stand."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import pytest

import weftform.laboratory.bias_extension
import weftform.laboratory.tensile
import weftform.laboratory.units

PAGE = Path(__file__).parents[2] / "docs" / "laboratory.md"


@pytest.mark.parametrize("name", ["bias_extension", "tensile", "units"])
def test_docstring_examples(name) -> None:
    assert doctest.testmod(getattr(weftform.laboratory, name)).failed == 0


def test_page(tmp_path, monkeypatch) -> None:
    from typer.testing import CliRunner

    from weftform import Study, run
    from weftform.cli.characterise import app
    from weftform.fabric import Fabric

    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text(encoding="utf-8")
    for block in re.findall(r"```python\n(.*?)```", text, flags=re.S):
        exec(block, {})
    for block in re.findall(r"```console\n(.*?)```", text, flags=re.S):
        for command in block.replace("\\\n", " ").split("$ weftform characterise ")[1:]:
            words = [w.strip('"') for w in re.findall(r'"[^"]*"|\S+', command)]
            files = [[str(p) for p in sorted(Path().glob(w))] if "?" in w else [w] for w in words]
            quiet = [] if words[0] == "shear-map" else ["--no-figures"]
            result = CliRunner().invoke(app, [*(f for fs in files for f in fs), *quiet])
            assert result.exit_code == 0, result.output
        for command in block.replace("\\\n", " ").split("$ weftform run ")[1:]:
            words = command.split()
            study, out = words[0], words[words.index("--out") + 1]
            changes = [words[k + 1] for k, w in enumerate(words) if w == "--set"]
            loaded = Study.load(study, changes)
            if study == "picture-frame":  # the bias test takes longer; that it loads is enough here
                assert run(loaded, Path(out)).summary["ok"]
    assert Fabric.load("my-twill.toml").name == "my twill"
    assert Fabric.load("twintex-uml.toml").thickness == 1.2
