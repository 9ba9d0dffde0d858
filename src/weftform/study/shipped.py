"""The studies in the package."""

from __future__ import annotations

from importlib import resources
from pathlib import Path


def shipped_studies() -> dict[str, Path]:
    """Names and files of the studies in the package."""
    folder = resources.files("weftform") / "data" / "studies"
    return {p.name.removesuffix(".toml"): Path(str(p)) for p in sorted(folder.iterdir(), key=lambda p: p.name)}
