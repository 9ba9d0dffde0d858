"""Before the first simulation: studies, curves, folder; what cannot work is refused here."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from weftform.errors import CardError, IdentificationError, ResultError
from weftform.fabric.fabric import merge_tables
from weftform.identification.evaluations import LOG
from weftform.identification.loading import shear_angle_at, shortened, travel
from weftform.identification.targets import Curve, Target, Weighting, read_target
from weftform.laboratory.markers import MarkerTracking
from weftform.laboratory.specimen import Reading
from weftform.study.study import Study

SUMMARY = "identification.json"
CARD = "card.toml"
FIGURES = ("current.png", "curves.png", "shear-law.png", "correlation.png")


def studies_of(main: Study, name: str, targets: Sequence[Target]) -> tuple[list[Study], list[int]]:
    """The studies to simulate, each once and with the card of ``main``, and which of them each target belongs to.

    Parameters
    ----------
    name
        Under which ``main`` was asked for, so that a target may name it too.

    Raises
    ------
    IdentificationError
        A study has no force against displacement.
    """
    studies: list[Study] = []
    names: list[object] = []
    homes = []
    for target in targets:
        wanted: object = target.study
        if wanted is None or wanted is main or str(wanted) == name:
            wanted, made = name, main
        elif wanted in names:
            made = main
        else:
            made = _with_card_of(main, wanted if isinstance(wanted, Study) else Study.load(str(wanted)))
        if wanted not in names:
            travel(made)
            studies.append(made)
            names.append(wanted)
        homes.append(names.index(wanted))
    return studies, homes


def _with_card_of(main: Study, other: Study) -> Study:
    """Another test of the same fabric: card, variant and changes of ``main``, below the changes of its own."""
    choice = main.model.fabric
    card = choice.card
    if main.file is not None and card.endswith(".toml"):
        card = str((main.file.parent / card).resolve())
    override = merge_tables(choice.override, other.model.fabric.override)
    fabric = choice.model_copy(update={"card": card, "override": override})
    made = replace(other, model=other.model.model_copy(update={"fabric": fabric}))
    made.check()
    return made


def compared_curves(
    targets: Sequence[Target],
    studies: Sequence[Study],
    homes: Sequence[int],
    *,
    reading: Reading,
    weighting: Weighting,
    until_slip: bool,
    tracking: Sequence[MarkerTracking],
) -> tuple[list[Curve], list[str]]:
    """The curves of all targets, and what was done to them.

    Raises
    ------
    MeasurementError, IdentificationError
        A file cannot be used, or is given twice for one study.
    """
    curves: list[Curve] = []
    notes: list[str] = []
    seen: set[tuple[str, int, str]] = set()
    for target, home in zip(targets, homes, strict=True):
        found, said = read_target(
            target,
            studies[home],
            home,
            reading=reading,
            weighting=weighting,
            until_slip=until_slip,
            tracking=tracking,
        )
        for curve in found:
            identity = (curve.specimen.sha256, home, curve.specimen.name)
            if identity in seen:
                raise IdentificationError("the same curve twice for one study", file=target.curve, key="--target")
            seen.add(identity)
        curves += found
        notes += said
    return curves, notes


def covered_angle(curves: Sequence[Curve], studies: Sequence[Study]) -> float | None:
    """Largest kinematic shear angle of the curves [degrees]; None where no test has one."""
    angles = [shear_angle_at(studies[c.study], float(c.displacement[-1])) for c in curves]
    known = [float(np.degrees(a)) for a in angles if a is not None]
    return max(known) if known else None


def simulated_until(study: Study, index: int, curves: Sequence[Curve]) -> Study:
    """The study, over soon after the last point that one of its curves compares."""
    return shortened(study, max(float(c.displacement[-1]) for c in curves if c.study == index))


def check_output(card: Path, of_card: bool) -> None:
    """Refuse a card that could not be written in the end.

    Raises
    ------
    CardError
        It is no TOML file, or its folder does not exist.
    IdentificationError
        Nothing of a card is fitted.
    """
    if not of_card:
        raise IdentificationError("nothing of the card is fitted, so there is no card to write", key="--output")
    if card.suffix != ".toml":
        raise CardError("a card is a TOML file", file=card, expected="a name ending in .toml")
    if not card.parent.is_dir():
        raise CardError(f"the folder {card.parent} does not exist", file=card)


def claim(folder: Path, *, resume: bool) -> None:
    """Create the folder, or take over a former identification in it.

    Raises
    ------
    ResultError
        It holds other files, an identification that was interrupted (without ``resume``), none (with it), or
        cannot be written.
    """
    log = folder / LOG
    if resume:
        if not log.exists():
            raise ResultError(
                "nothing to resume: there is no log of evaluations", file=folder, hint="identify without --resume"
            )
    elif log.exists() and log.stat().st_size > 0 and not (folder / SUMMARY).exists():
        raise ResultError(
            "the folder holds an identification that was interrupted",
            file=folder,
            hint="go on with --resume, or choose another with --out",
        )
    elif folder.is_dir() and any(folder.iterdir()) and not log.exists():
        raise ResultError(
            "the folder holds other files", file=folder, expected="a new or empty folder, or a former identification"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in (SUMMARY, CARD, *FIGURES, *(() if resume else (LOG,))):
            (folder / name).unlink(missing_ok=True)
    except OSError as problem:
        raise ResultError(
            f"the folder cannot be written ({problem.strerror})", file=folder, hint="choose another with --out"
        ) from None


def jobs_for(wanted: int | None, useful: int) -> int:
    """Processes to use: those asked for, or one per processor as long as there is work for them.

    Raises
    ------
    IdentificationError
        Less than one.
    """
    if wanted is not None:
        if wanted < 1:
            raise IdentificationError("no processes", key="--jobs", expected="1 at least", got=str(wanted))
        return wanted
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(available, useful))
