"""How the command is started, and what it says before any verb."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import version

from typer.testing import CliRunner

import weftform
from weftform.cli import app
from weftform.cli.bodies import VERBS


def test_the_module_is_the_command() -> None:
    done = subprocess.run([sys.executable, "-m", "weftform", "--version"], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, f"weftform {weftform.__version__}\n", "")
    wrong = subprocess.run(
        [sys.executable, "-m", "weftform", "check", "no-such-study"], capture_output=True, text=True, timeout=60
    )
    assert wrong.returncode == 2 and wrong.stderr.startswith("error: ") and "Traceback" not in wrong.stderr


def test_the_version_is_that_of_the_package() -> None:
    assert weftform.__version__ == version("weftform")


def test_help_names_every_verb_and_the_version() -> None:
    said = CliRunner().invoke(app, ["--help"])
    words = " ".join(said.output.split())
    assert said.exit_code == 0 and "--version" in words and "from laboratory tests to the formed part" in words
    assert all(f"  {verb} " in said.output for verb in [*VERBS, "characterise"])


def test_without_a_verb_the_help_is_shown() -> None:
    assert "Usage:" in CliRunner().invoke(app, []).output
