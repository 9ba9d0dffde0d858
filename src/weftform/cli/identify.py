"""``weftform identify``: parameters of card and study from measured curves, with the simulation in the loop."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from weftform.cli.characterise_options import Columns, Only, Preset, Units, Zero, reading_of, tracking_of
from weftform.cli.options import AsJson, Changes, StudyName

if TYPE_CHECKING:
    from weftform.identification import Identification, Target
    from weftform.identification.inverse import Progress


class MethodChoice(StrEnum):
    """How the parameters are looked for."""

    LEAST_SQUARES = "least-squares"
    GLOBAL = "global"


class SizeChoice(StrEnum):
    """Size of an error along a curve."""

    RELATIVE = "relative"
    UNIFORM = "uniform"


def identify(
    study: StudyName,
    target: Annotated[
        list[str],
        typer.Option(
            "--target",
            metavar="[STUDY=]FILE",
            help="Curve of force against displacement to meet, and the study that simulates it where that is another "
            "(tensile-warp=pull.csv); it is run with the card of STUDY. Repeatable.",
        ),
    ],
    fit: Annotated[
        list[str],
        typer.Option(
            "--fit",
            metavar="NAME[=START][:LOW..HIGH][,OPTION=VALUE]",
            help="shear.G12, shear.polynomial (degree=4, to=DEG), shear.table (intervals=8, to=DEG), shear.scale, "
            "tension.scale, tension.warp.scale, tension.weft.scale, or a dotted key of card or study. Repeatable.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder of the identification; default results/identify-NAME."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Card to write or update; default DIR/card.toml.")
    ] = None,
    changes: Changes = None,
    ranges: Annotated[
        list[str] | None,
        typer.Option("--range", metavar="[STUDY=]LO..HI", help="Displacements that count [mm]. Repeatable."),
    ] = None,
    until_slip: Annotated[
        bool, typer.Option("--until-slip", help="Bias extension: only up to the onset of slip (markers or angles).")
    ] = False,
    markers: Annotated[list[Path] | None, typer.Option(help="Table of marker positions. Repeatable.")] = None,
    layout: Annotated[Path | None, typer.Option(help="TOML file with the quadruples of markers.")] = None,
    displacements: Annotated[
        Path | None, typer.Option(help="Table of image and displacement, if the markers have none.")
    ] = None,
    weight: Annotated[
        list[str] | None,
        typer.Option("--weight", metavar="STUDY=W", help="Weight of the curves of a study (1). Repeatable."),
    ] = None,
    weighting: Annotated[
        SizeChoice, typer.Option(help="Errors as shares of the force at each point, or of the largest force.")
    ] = SizeChoice.RELATIVE,
    method: Annotated[
        MethodChoice, typer.Option(help='global: search between the bounds first (pip install "weftform[search]").')
    ] = MethodChoice.LEAST_SQUARES,
    trials: Annotated[int, typer.Option(help="Points of the global search.", min=1)] = 64,
    seed: Annotated[int, typer.Option(help="Of the global search.", min=0)] = 0,
    jobs: Annotated[
        int | None, typer.Option("--jobs", metavar="N", help="Simulations side by side; as many as pay without.", min=1)
    ] = None,
    iterations: Annotated[int, typer.Option("--max-iterations", help="Most steps of the least squares.", min=1)] = 40,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an interrupted identification in DIR.")] = False,
    preset: Preset = "auto",
    column: Columns = None,
    unit: Units = None,
    only: Only = None,
    zero: Zero = False,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
    as_json: AsJson = False,
) -> None:
    """Identify parameters by simulating the test until it meets the measured curves (Sec. 3.6).

    Examples: weftform identify bias-extension --target curve.csv --fit shear.G12=0.05:0.01..0.5; weftform identify
    bias-extension --target bias.csv --target tensile-warp=pull.csv --fit shear.polynomial --fit tension.scale
    """
    from weftform.identification import identify as compute
    from weftform.study import Study

    loaded = Study.load(study, changes or ())
    folder = out if out is not None else Path("results") / f"identify-{loaded.name}"
    display = _Display(enabled=not quiet)
    try:
        with display:
            found = compute(
                loaded,
                targets_of(target, study, ranges or (), weight or ()),
                fit,
                out=folder,
                output=output,
                until_slip=until_slip,
                tracking=tracking_of(markers, layout, displacements),
                weighting=weighting.value,
                reading=reading_of(preset, column, unit, only, zero),
                method=method.value,
                trials=trials,
                seed=seed,
                jobs=jobs,
                most_iterations=iterations,
                resume=resume,
                figures=not no_figures,
                watch=display.show,
            )
    except KeyboardInterrupt:
        typer.secho(
            f"\ninterrupted; every finished simulation is in {folder}; go on with --resume", fg="yellow", err=True
        )
        raise typer.Exit(1) from None
    if as_json:
        typer.echo((folder / "identification.json").read_text(encoding="utf-8"), nl=False)
    else:
        typer.echo("\n".join(_report(found)))
    for note in found.notes:
        typer.echo(f"note       {note}", err=True)
    for warning in found.warnings:
        typer.secho(f"warning    {warning}", fg="red", err=True)
    if not found.ok:
        raise typer.Exit(1)


def targets_of(texts: list[str], main: str, ranges: Any, weights: Any) -> list[Target]:
    """Targets with their studies, ranges and weights; ``None`` stands for the study that is identified.

    Raises
    ------
    IdentificationError
        A range or weight cannot be read, or names a study that no target has.
    """
    from weftform.errors import IdentificationError
    from weftform.identification import Target
    from weftform.study import shipped_studies

    named: list[tuple[str, str]] = []
    for text in texts:
        name, equals, file = text.partition("=")
        is_study = bool(equals) and not Path(text).exists() and (name in shipped_studies() or name.endswith(".toml"))
        named.append((name, file) if is_study else (main, text))
    studies = list(dict.fromkeys(name for name, _ in named))

    def per_study(given: Any, option: str, form: str) -> dict[str, str]:
        values: dict[str, str] = {}
        for text in given:
            name, equals, value = text.partition("=")
            if not equals:
                values |= dict.fromkeys(studies, text)
            elif name in studies:
                values[name] = value
            else:
                raise IdentificationError(
                    "no target belongs to that study", key=option, expected=", ".join(studies) + f"={form}", got=text
                )
        return values

    spans = {k: _range(v) for k, v in per_study(ranges, "--range", "LO..HI").items()}
    shares = {k: _weight(v) for k, v in per_study(weights, "--weight", "W").items()}
    return [
        Target(file, None if name == main else name, shares.get(name, 1.0), spans.get(name)) for name, file in named
    ]


def _range(text: str) -> tuple[float, float]:
    from weftform.errors import IdentificationError

    low, dots, high = text.partition("..")
    try:
        if not dots:
            raise ValueError
        return float(low or 0.0), float(high)
    except ValueError:
        raise IdentificationError("a range cannot be read", key="--range", expected="LO..HI in mm", got=text) from None


def _weight(text: str) -> float:
    from weftform.errors import IdentificationError

    try:
        return float(text)
    except ValueError:
        raise IdentificationError("a weight is no number", key="--weight", expected="STUDY=W", got=text) from None


def _report(found: Identification) -> list[str]:
    """What is printed at the end."""
    sure = found.uncertainty
    wide = max(len(p.name) for p in found.parameters)
    lines = [
        f"misfit     {100 * found.misfit:.3g} % (start {100 * found.iterates[0].misfit:.3g} %), {found.solution.message}",
        f"runs       {found.evaluations} simulations, {found.reused} taken from the log, {found.seconds:.0f} s",
    ]
    for k, (parameter, value) in enumerate(zip(found.parameters, found.values, strict=True)):
        lines.append(
            f"{'parameters' if k == 0 else '':<10} {parameter.name:<{wide}}  {value:.5g} {parameter.unit}"
            f"  (95 %: {sure.lower[k]:.4g} to {sure.upper[k]:.4g}; start {parameter.start:.4g})"
        )
    if found.card is not None:
        lines.append(f"card       {found.card}")
    lines.append(f"results    {found.folder}")
    return lines


class _Display:
    """Progress: a line that is rewritten on a terminal, one line per step elsewhere."""

    def __init__(self, *, enabled: bool) -> None:
        from rich.console import Console

        self._console = Console(stderr=True)
        self.enabled = enabled
        self._status: Any = None

    def __enter__(self) -> _Display:
        if self.enabled and self._console.is_terminal:
            self._status = self._console.status("first simulation (kernels are compiled once)")
            self._status.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._status is not None:
            self._status.stop()

    def show(self, progress: Progress) -> None:
        """Say where the identification stands."""
        if not self.enabled:
            return
        runs = f"{progress.evaluations} runs" + (f" + {progress.reused} from the log" if progress.reused else "")
        last = progress.iterate
        if last is None:
            if self._status is not None:
                self._status.update(runs)
            return
        values = ", ".join(f"{n} = {v:.4g}" for n, v in zip(progress.names, last.values, strict=True))
        line = f"step {last.number}  misfit {100 * last.misfit:.4g} %  {runs}  {values}"
        if progress.accepted:
            self._console.print(line, highlight=False, soft_wrap=True)
        if self._status is not None:
            self._status.update(f"step {last.number}, misfit {100 * last.misfit:.4g} %, {runs}")
