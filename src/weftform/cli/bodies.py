"""The verbs in the order of ``weftform --help``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from weftform.cli.bench import bench
from weftform.cli.cards import cards
from weftform.cli.check import check
from weftform.cli.compare import compare
from weftform.cli.doctor import doctor
from weftform.cli.identify import identify
from weftform.cli.new import new
from weftform.cli.probe import probe
from weftform.cli.reproduce import reproduce
from weftform.cli.run import run
from weftform.cli.studies import studies
from weftform.cli.view import view

VERBS: dict[str, Callable[..., Any]] = {
    "new": new,
    "check": check,
    "run": run,
    "view": view,
    "probe": probe,
    "compare": compare,
    "studies": studies,
    "cards": cards,
    "identify": identify,
    "reproduce": reproduce,
    "bench": bench,
    "doctor": doctor,
}
