"""Inverse identification: the simulation in an optimisation loop (Sec. 3.6)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from weftform.identification.fits import Fit
    from weftform.identification.inverse import Identification, identify
    from weftform.identification.targets import Target

__all__ = ["Fit", "Identification", "Target", "identify"]

_HOMES = {
    "Fit": "weftform.identification.fits",
    "Identification": "weftform.identification.inverse",
    "Target": "weftform.identification.targets",
    "identify": "weftform.identification.inverse",
}


def __getattr__(name: str) -> Any:
    """Import the public names when they are first used: they bring in the solver and its compiler."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
