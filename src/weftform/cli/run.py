"""``weftform run``: run a study."""

from __future__ import annotations

import shlex
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from weftform.cli.options import Changes, StudyName

if TYPE_CHECKING:
    from weftform.execution import Progress, Watch
    from weftform.processors import Device


def run(
    study: StudyName,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Result folder; default results/NAME.")
    ] = None,
    changes: Changes = None,
    threads: Annotated[
        int | None, typer.Option("--threads", metavar="N", help="Threads; chosen by the size of the blank without.")
    ] = None,
    device: Annotated[
        str,
        typer.Option("--device", metavar="cpu|cuda", help="Compute on the processor, or on a GPU (weftform[cuda])."),
    ] = "cpu",
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an interrupted run in DIR.")] = False,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Do not draw the figures.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar.")] = False,
) -> None:
    """Run a study and write its result folder: fields for ParaView, history, outline, summary and figures.

    Examples: weftform run hemisphere-0-90 --out results/first; weftform run my.toml --set
    tools.blank_holder.force_N=500
    """
    from weftform.execution import run as execute
    from weftform.study import Study

    loaded = Study.load(study, changes or ())
    folder = out if out is not None else Path("results") / loaded.name
    display = ProgressDisplay(enabled=not quiet)
    try:
        with display:
            result = execute(
                loaded, folder, threads=threads, device=cast("Device", device), resume=resume, watch=display.watch
            )
    except KeyboardInterrupt:
        if not (folder / "checkpoint.npz").exists():
            typer.secho("\ninterrupted before there was anything to keep", fg="yellow", err=True)
            raise typer.Exit(130) from None
        typer.secho(f"\ninterrupted; what was computed is in {folder}", fg="yellow", err=True)
        again = shlex.join(["weftform", "run", str(folder / "study.toml"), "--out", str(folder), "--resume"])
        typer.echo(f"go on with: {again}", err=True)
        raise typer.Exit(1) from None
    summary = result.summary
    typer.echo("\n".join(_report(summary)))
    if not no_figures:
        from weftform.report import write_figures

        begun = time.perf_counter()
        drawn = write_figures(result)
        typer.echo(f"figures    {len(drawn)} in {folder / 'figures'} ({time.perf_counter() - begun:.1f} s)")
        typer.echo(f"picture    {drawn[0]}")
    typer.echo(f"results    {folder} (open fields.vtkhdf in ParaView)")
    for note in summary["notes"]:
        typer.secho(f"note       {note}", fg="yellow", err=True)
    for warning in summary["warnings"]:
        typer.secho(f"warning    {warning}", fg="red", err=True)
    if not summary["ok"]:
        raise typer.Exit(1)


def _report(summary: dict[str, Any]) -> list[str]:
    shear, energy = summary["shear_angle_deg"], summary["energy"]
    lines = [
        f"study      {summary['study']}: {summary['cells']} cells, {summary['steps']} steps in {summary['wall_s']:.2f} s "
        f"({summary['ns_per_cell_step']:.3g} ns per cell per step, {_computed_on(summary)})",
        f"shear      largest {shear['max']:.2f} deg, mean {shear['mean']:.2f} deg",
    ]
    if "punch_force_N" in summary:
        draw = summary["draw_in_mm"]
        lines += [
            f"draw-in    {draw['edge_x']:.2f} mm on x, {draw['edge_y']:.2f} mm on y, {draw['corner']:.2f} mm at the corner",
            f"punch      {summary['punch_force_N']:.2f} N at {summary['stroke_mm']:.2f} mm",
        ]
    elif "force_N" in summary:
        lines.append(f"force      {summary['force_N']:.5g} N at {summary['displacement_mm']:.4g} mm")
    lines.append(
        f"energy     ledger closed within {100 * energy['balance_error']:.2g} %, kinetic at most "
        f"{100 * energy['kinetic_over_internal']:.2g} % of internal"
    )
    return lines


def _computed_on(summary: dict[str, Any]) -> str:
    if summary["device"] == "cuda":
        return f"on {summary['device_name']}"
    return f"{summary['threads']} thread{'s' if summary['threads'] > 1 else ''}"


class ProgressDisplay:
    """Progress bar with stroke, steps, speed and time left; plain silence where the output is no terminal."""

    def __init__(self, *, enabled: bool) -> None:
        from rich.console import Console

        self._console = Console(stderr=True)
        self.enabled = enabled and self._console.is_terminal
        self.watch: Watch | None = self._show if self.enabled else None
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> ProgressDisplay:
        if self.enabled:
            from rich.progress import BarColumn, Progress, TextColumn

            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(bar_width=30),
                TextColumn("{task.percentage:3.0f} %"),
                TextColumn("{task.fields[detail]}"),
                console=self._console,
                transient=True,
            )
            self._bar.start()
            self._task = self._bar.add_task("preparing", total=1.0, detail="")
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def _show(self, progress: Progress) -> None:
        if progress.compiling:
            self._bar.update(self._task, description="loading or compiling kernels (seconds, once)", completed=0.0)
            return
        left = f"{progress.seconds_left:.0f} s left" if progress.share > 0.02 else ""
        self._bar.update(
            self._task,
            description="running",
            completed=progress.share,
            detail=f"{progress.displacement:6.2f} mm  step {progress.steps:,}  "
            f"{progress.ns_per_cell_step:.3g} ns/cell  {left}",
        )
