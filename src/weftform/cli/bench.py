"""``weftform bench``: how fast the solver is on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from weftform.cli.options import AsJson


def bench(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="56 x 56 cells only, half a minute.")] = False,
    device: Annotated[list[str] | None, typer.Option("--device", help="cpu or cuda; may be given again.")] = None,
    threads: Annotated[list[int] | None, typer.Option("--threads", help="1 and all processors without.")] = None,
    markdown: Annotated[
        Path | None, typer.Option("--markdown", metavar="FILE", help="Write the performance page.")
    ] = None,
    peers: Annotated[
        Path | None,
        typer.Option("--peers", metavar="FILE", help="Peers for that page, from benchmarks/peers/run.py --json."),
    ] = None,
) -> None:
    """Time the solver on sheets of 56, 200 and 700 cells a side, beside a C program with the same physics.

    Needs gcc for the C program and says so without. Takes some minutes, mostly for the largest sheet.
    """
    import json

    from rich.console import Console
    from rich.table import Table

    from weftform.benchmark import bench as whole
    from weftform.errors import WeftformError

    notes = Console(stderr=True)
    compared = None
    if peers is not None:
        try:
            compared = json.loads(peers.read_text())
        except (OSError, ValueError) as problem:
            raise WeftformError(f"the peers cannot be read ({problem})", file=peers) from None
    said = ""

    def watch(what: str, share: float) -> None:
        nonlocal said
        line = f"{what} {10 * int(10 * share)} %" if what == "timing" else what
        if line != said:
            notes.print(line)
            said = line

    found = whole.bench(
        sides=whole.QUICK_SIDES if quick else whole.SIDES,
        threads=threads or (),
        devices=device or ("cpu",),
        seconds=whole.QUICK_SECONDS if quick else whole.SECONDS,
        with_start_up=not quick,
        watch=watch,
    )
    if markdown is not None:
        from weftform.benchmark.page import page

        markdown.write_text(page(found, compared))
        notes.print(f"page       {markdown}")
    if as_json:
        typer.echo(found.to_json())
        return
    console = Console(width=None if Console().is_terminal else 140)
    table = Table("program", "cells", "contact", "threads", "device", "ns", "loop", "median", "ratio to C", "loop / C")
    for case in found.cases:
        table.add_row(
            case["program"],
            str(case["cells"]),
            "yes" if case["contact"] else "no",
            str(case["threads"]),
            case["device"],
            *(f"{case[name]:.1f}" for name in ("ns_per_cell_step", "loop_ns_per_cell_step", "median_ns_per_cell_step")),
            *(f"{case[name]:.2f}" if name in case else "" for name in ("ratio_to_c", "loop_ratio_to_c")),
        )
    console.print(table)
    for name, value in found.machine.items():
        if name != "notes":
            typer.echo(f"{name:22} {value}")
    for note in found.machine["notes"]:
        typer.secho(note, fg="yellow", err=True)
