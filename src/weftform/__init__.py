"""weftform: forming simulation of dry woven reinforcements, from laboratory tests to the formed part.

>>> from weftform import Fabric
>>> Fabric.load("hexforce-48600-c1300").thickness
0.62
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from weftform.comparison import compare
    from weftform.execution import run
    from weftform.fabric import Fabric
    from weftform.identification import Target, identify
    from weftform.result import Result
    from weftform.study import Study

__all__ = ["Fabric", "Result", "Study", "Target", "__version__", "compare", "identify", "run"]

_HOMES = {
    "Fabric": "weftform.fabric",
    "Result": "weftform.result",
    "Study": "weftform.study",
    "Target": "weftform.identification",
    "compare": "weftform.comparison",
    "identify": "weftform.identification",
    "run": "weftform.execution",
}


def __getattr__(name: str) -> Any:
    """Import the public names when they are first used, so that ``weftform --help`` stays quick."""
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'weftform' has no attribute '{name}'")
