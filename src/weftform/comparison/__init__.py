"""Comparison of a result with the experiment: outline, shear angles, force curves, markers (Sec. 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from weftform.comparison.comparison import Comparison, compare
    from weftform.comparison.placement import Placement
    from weftform.comparison.tolerance import LIMITED, Tolerance, Verdict

__all__ = ["LIMITED", "Comparison", "Placement", "Tolerance", "Verdict", "compare"]

_HOMES = {
    "LIMITED": "weftform.comparison.tolerance",
    "Comparison": "weftform.comparison.comparison",
    "Placement": "weftform.comparison.placement",
    "Tolerance": "weftform.comparison.tolerance",
    "Verdict": "weftform.comparison.tolerance",
    "compare": "weftform.comparison.comparison",
}


def __getattr__(name: str) -> Any:
    """Import the public names when they are first used: outlines bring in shapely."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
