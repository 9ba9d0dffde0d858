"""The declared problem: schema, reading, checking, shipped studies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from weftform.study.shipped import shipped_studies

if TYPE_CHECKING:
    from weftform.study.study import Study

__all__ = ["Study", "shipped_studies"]


def __getattr__(name: str) -> Any:
    """Import the study only when it is used: it brings the grid and its geometry library."""
    if name == "Study":
        from weftform.study.study import Study

        return Study
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
