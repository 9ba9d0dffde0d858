"""The command line: one file per verb, thin. Heavy imports happen inside the verbs, so that ``--help`` is quick."""

from __future__ import annotations

import gc
import os
import sys
from typing import Annotated

import typer

from weftform import __version__
from weftform.cli.bodies import VERBS
from weftform.cli.characterise import app as characterise
from weftform.errors import ResultError, WeftformError

app = typer.Typer(
    name="weftform",
    help="Forming simulation of dry woven reinforcements, from laboratory tests to the formed part.\n\n"
    "Start with: weftform run hemisphere-0-90 --out results/hemisphere",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
)


def _say_version(asked: bool) -> None:
    if asked:
        typer.echo(f"weftform {__version__}")
        raise typer.Exit


@app.callback()
def before_any_verb(
    version: Annotated[
        bool, typer.Option("--version", callback=_say_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """What may stand before the verb."""


for name, body in VERBS.items():
    app.command(name)(body)
app.add_typer(characterise, name="characterise")


def main() -> None:
    """Entry point: typed errors become one message and their exit code, without a traceback unless ``--debug``."""
    # Imports make hundreds of thousands of objects that stay. To look through them for garbage again and again is a tenth of
    # a start, and to do so once more at the very end another.
    gc.set_threshold(100_000, 50, 50)
    arguments = sys.argv[1:]
    debug = "--debug" in arguments
    if debug:
        arguments.remove("--debug")
    try:
        app(args=arguments)
    except WeftformError as problem:
        if debug:
            raise
        typer.secho("error: ", fg="red", bold=True, err=True, nl=False)
        typer.echo(str(problem), err=True)
        if isinstance(problem, ResultError):
            # HDF5 crashes when it puts away a file that it could not write
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(problem.exit_code)
        sys.exit(problem.exit_code)
    except KeyboardInterrupt:
        typer.secho("interrupted", fg="yellow", err=True)
        sys.exit(130)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
    finally:
        gc.freeze()


__all__ = ["app", "main"]
