"""Run the comparison with the paper and write it down."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from weftform.errors import ResultError
from weftform.fabric import Fabric
from weftform.reproduction import hemispheres, simulated
from weftform.reproduction.items import Item
from weftform.reproduction.laws import law_items, misprints
from weftform.reproduction.picture_frames import real_frame_items
from weftform.reproduction.runs import run_all
from weftform.result import Result
from weftform.result.writer import write_whole

CARD = "hexforce-48600-c1300"

HEADER = ("Item", "Paper or closed form", "Computed", "Difference", "Remark")


@dataclass(frozen=True)
class Reproduction:
    """The comparison.

    Attributes
    ----------
    items
        All lines, section by section.
    results
        The simulations behind them.
    seconds
        Wall time of everything.
    """

    items: list[Item]
    results: dict[str, Result]
    seconds: float

    @property
    def disagreeing(self) -> list[Item]:
        """Items that must agree and do not."""
        return [item for item in self.items if item.agrees is False]

    @property
    def ok(self) -> bool:
        return not self.disagreeing and all(result.summary["ok"] for result in self.results.values())

    def to_json(self) -> str:
        """Items, runs and the verdict as JSON."""
        return json.dumps(
            {
                "ok": self.ok,
                "seconds": self.seconds,
                "items": [item.as_dict() for item in self.items],
                "runs": {
                    name: {
                        "study": result.study.name,
                        "cells": result.summary["cells"],
                        "steps": result.summary["steps"],
                        "wall_s": result.summary["wall_s"],
                        "ok": result.summary["ok"],
                        "balance_error": result.summary["energy"]["balance_error"],
                        "kinetic_over_internal": result.summary["energy"]["kinetic_over_internal"],
                    }
                    for name, result in self.results.items()
                },
            },
            indent=2,
        )

    def to_markdown(self, figures: list[Path]) -> str:
        """The table section by section, then the runs and the figures."""
        from weftform import __version__

        agreed = sum(item.agrees is True for item in self.items)
        must = sum(item.agrees is not None for item in self.items)
        lines = [
            "# Reproduction of the paper",
            "",
            f"Made by `weftform reproduce` (weftform {__version__}). {agreed} of {must} items that must agree do; the other "
            f"{len(self.items) - must} are misprints, measurements or values that the paper does not give.",
            "",
        ]
        for section, members in groupby(self.items, key=lambda item: item.section):
            lines += [f"## {section}", "", "| " + " | ".join(HEADER) + " |", "|---|---:|---:|---:|---|"]
            lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in item.cells()) + " |" for item in members]
            lines.append("")
        lines += [
            "## Runs",
            "",
            "One thread each. Wall times are of the time loop on the machine that made this page.",
            "",
            "| Run | Study | Cells | Steps | Loop [s] | Ledger misses | Kinetic / internal |",
            "|---|---|---:|---:|---:|---:|---:|",
        ]
        for name, result in self.results.items():
            s = result.summary
            lines.append(
                f"| {name} | {s['study']} | {s['cells']} | {s['steps']} | {s['wall_s']:.2f} | "
                f"{100 * s['energy']['balance_error']:.2g} % | {100 * s['energy']['kinetic_over_internal']:.2g} % |"
            )
        if figures:
            lines += ["", "## Figures", ""]
            lines += [f"![{path.stem}](figures/{path.name})" for path in figures]
        return "\n".join(lines) + "\n"


def reproduce(
    folder: Path, *, figures: bool = True, watch: Callable[[str, int, int], None] | None = None
) -> Reproduction:
    """Run everything the paper reports and write ``reproduction.md``, ``reproduction.json`` and the figures.

    Parameters
    ----------
    folder
        Where to write; the runs go to ``folder/runs``.
    figures
        Whether to draw the figures.
    watch
        Called with the name of each finished run, the number done and the number of all.

    Raises
    ------
    ResultError
        The folder cannot be written.
    """
    begun = time.perf_counter()
    try:
        (folder / "runs").mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise ResultError(f"the folder cannot be written ({problem.strerror})", file=folder) from None
    results = run_all(folder / "runs", watch)
    fabric = Fabric.load(CARD)
    items = [
        *law_items(fabric),
        *simulated.element_items(results),
        *simulated.tensile_items(results),
        *simulated.bias_items(results),
        *simulated.frame_items(results),
        *real_frame_items(results),
        *hemispheres.hemisphere_items(results),
        *hemispheres.convergence_items(results),
        *misprints(fabric),
    ]
    drawn: list[Path] = []
    if figures:
        from weftform.reproduction.figures import draw_paper_figures

        drawn = draw_paper_figures(results, folder / "figures")
    found = Reproduction(items, results, time.perf_counter() - begun)
    write_whole(folder / "reproduction.json", found.to_json() + "\n")
    write_whole(folder / "reproduction.md", found.to_markdown(drawn))
    return found
