"""``weftform doctor``: is this installation sound?"""

from __future__ import annotations

from typing import Annotated

import typer

from weftform.cli.options import AsJson


def doctor(
    as_json: AsJson = False,
    quick: Annotated[bool, typer.Option("--quick", help="Skip the tiny run and the rendering.")] = False,
) -> None:
    """Check this installation: versions, threads, a tiny run against a stored number, rendering, write permission.

    Exits 0 where all is well and 1 otherwise, with one line of advice for each failure.
    """
    import json

    from weftform.diagnosis import diagnose

    findings = diagnose(quick=quick)
    if as_json:
        typer.echo(json.dumps([f.as_dict() for f in findings], indent=2))
    else:
        for finding in findings:
            mark, colour = ("ok  ", "green") if finding.ok else ("FAIL", "red")
            typer.secho(mark, fg=colour, nl=False)
            typer.echo(f"  {finding.what}: {finding.found}")
            if not finding.ok and finding.advice:
                typer.echo(f"      advice: {finding.advice}")
    if not all(finding.ok for finding in findings):
        raise typer.Exit(1)
