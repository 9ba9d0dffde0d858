"""Studies and curves that the tests of the identification share."""

from __future__ import annotations

from pathlib import Path

import pytest
from bias_formula import Formula, bias_curve

from weftform.identification import evaluations
from weftform.study import Study


@pytest.fixture
def formula(monkeypatch) -> Formula:
    """Replace the simulation by the formula."""
    stand_in = Formula()
    monkeypatch.setattr(evaluations, "simulate", stand_in)
    return stand_in


@pytest.fixture
def write(tmp_path):
    """Write a curve as CSV; returns its path."""

    def writer(x, y, name: str = "curve.csv", header: str = "displacement_mm,force_N", more=()) -> Path:
        path = tmp_path / name
        rows = [",".join(repr(float(v)) for v in row) for row in zip(x, y, *more, strict=True)]
        path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
        return path

    return writer


BIAS = {"loading.displacement_mm": 20.0}


@pytest.fixture
def study() -> Study:
    """The shipped bias-extension test, to 20 mm."""
    return Study.load("bias-extension", BIAS)


@pytest.fixture
def curve(study, write) -> Path:
    """The curve of the shipped card by the formula."""
    return write(*bias_curve(study))
