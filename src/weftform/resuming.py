"""Whether an interrupted run may go on: with the study and the card that it began with."""

from __future__ import annotations

import hashlib
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weftform.errors import ResultError
from weftform.study import Study

MAY_CHANGE = ("name", "solver.most_steps")
"""What an interrupted run may be resumed with although it began with something else."""


def check_same(study: Study, file: Path) -> None:
    """Make sure that an interrupted run goes on with the study that it began with.

    Raises
    ------
    ResultError
        It is another, or the study of the folder cannot be read.
    """
    try:
        begun = _leaves(tomllib.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError) as problem:
        raise ResultError(f"the study of the interrupted run cannot be read ({problem})", file=file) from None
    now = _leaves(tomllib.loads(study.to_toml()))
    for key in sorted(begun.keys() | now.keys()):
        if begun.get(key) != now.get(key) and key not in MAY_CHANGE:
            raise ResultError(
                "the interrupted run began with another value",
                file=file,
                key=key,
                expected=str(begun.get(key, "none")),
                got=str(now.get(key, "none")),
                hint="resume with the same study and changes (this file holds them), or run anew without --resume",
            )


def _leaves(table: dict[str, Any], above: str = "") -> dict[str, Any]:
    """Values of nested tables by dotted key."""
    found: dict[str, Any] = {}
    for name, value in table.items():
        found |= _leaves(value, f"{above}{name}.") if isinstance(value, dict) else {f"{above}{name}": value}
    return found


def fingerprint(study: Study) -> NDArray[np.uint8]:
    """Of the laws of the fabric, changes included: the card is a file of its own."""
    card = study.fabric.card.model_dump_json()
    return np.frombuffer(hashlib.sha256(card.encode()).digest(), np.uint8)
