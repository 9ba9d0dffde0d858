from __future__ import annotations

import pytest


@pytest.fixture
def table(tmp_path):
    """Write a table of numbers (or names) with a header."""

    def write(name, header, rows, delimiter=","):
        path = tmp_path / name
        lines = [header, *(delimiter.join(c if isinstance(c, str) else f"{c:.9f}" for c in row) for row in rows)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write
