"""Small results to draw."""

from __future__ import annotations

import pytest

from weftform import Result, Study, run

SMALL = ["blank.cell_length_mm=10", "loading.duration_s=0.02", "output.frames=3", "output.rows=11"]


@pytest.fixture(scope="session")
def along_yarns(tmp_path_factory) -> Result:
    return run(Study.load("hemisphere-0-90", SMALL), tmp_path_factory.mktemp("along") / "result")


@pytest.fixture(scope="session")
def along_bias(tmp_path_factory) -> Result:
    return run(Study.load("hemisphere-45", SMALL), tmp_path_factory.mktemp("bias") / "result")
