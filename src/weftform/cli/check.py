"""``weftform check``: what a study would do, before anything runs."""

from __future__ import annotations

import json

import typer

from weftform.cli.options import AsJson, Changes, StudyName


def check(study: StudyName, changes: Changes = None, as_json: AsJson = False) -> None:
    """Check a study: cells, mass, stable step, number of steps, expected duration and warnings. Nothing is run or written.

    Examples: weftform check my.toml; weftform check hemisphere-0-90 --set blank.cell_length_mm=1.5
    """
    from weftform.forecast import forecast
    from weftform.study import Study

    found = forecast(Study.load(study, changes or ()))
    if as_json:
        typer.echo(json.dumps(found.as_dict(), indent=2))
        return
    typer.echo("\n".join(found.lines()))
