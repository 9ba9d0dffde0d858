"""``weftform studies``: list the shipped studies."""

from __future__ import annotations

import json

import typer

from weftform.cli.options import AsJson


def studies(as_json: AsJson = False) -> None:
    """List the shipped studies. Run one by its name: weftform run hemisphere-0-90 --out results/first"""
    import tomllib

    from weftform.study.shipped import shipped_studies

    found = {name: tomllib.loads(path.read_text(encoding="utf-8")) for name, path in shipped_studies().items()}
    if as_json:
        typer.echo(json.dumps({name: study.get("description", "") for name, study in found.items()}, indent=2))
        return
    width = max(len(name) for name in found)
    for name, study in found.items():
        typer.echo(f"{name:<{width}}  {study.get('description', '')}")
