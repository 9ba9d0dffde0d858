"""Files of measurements for the tests, written from the paper's own equations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

Writer = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Writer:
    """Write a two-column CSV; returns its path."""

    def writer(name: str, x: np.ndarray, y: np.ndarray, header: str = "displacement_mm,force_N") -> Path:
        rows = [f"{a!r},{b!r}" for a, b in zip(map(float, x), map(float, y), strict=True)]
        path = tmp_path / name
        path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
        return path

    return writer


@pytest.fixture
def text(tmp_path: Path) -> Callable[[str, str | bytes], Path]:
    """Write any text or bytes; returns the path."""

    def writer(name: str, content: str | bytes) -> Path:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        return path

    return writer
