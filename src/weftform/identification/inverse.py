"""Inverse identification: parameters of card and study whose simulation meets measured curves (Sec. 3.6)."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from weftform.errors import IdentificationError
from weftform.fabric import Fabric
from weftform.identification.evaluations import Evaluations, Point
from weftform.identification.fits import Fit, Parameter
from weftform.identification.laws import Family, changed, changes_of, families_of
from weftform.identification.optimising import (
    Iterate,
    Objective,
    Solution,
    global_search,
    least_squares,
    require_optuna,
    step_for,
)
from weftform.identification.preparing import (
    CARD,
    check_output,
    claim,
    compared_curves,
    covered_angle,
    jobs_for,
    simulated_until,
    studies_of,
)
from weftform.identification.statistics import Uncertainty, uncertainty
from weftform.identification.targets import Curve, Target, Weighting
from weftform.laboratory.markers import MarkerTracking
from weftform.laboratory.specimen import Reading
from weftform.study.study import Study

Method = Literal["least-squares", "global"]
BETWEEN_PICTURES = 3.0
"""Seconds between two pictures of the current curve, so that quick simulations do not wait for them."""


@dataclass(frozen=True)
class Progress:
    """Where an identification stands.

    Attributes
    ----------
    evaluations, reused
        Simulations made so far, and those found in the log of an interrupted identification.
    iterate
        The last accepted point; None before the first.
    best
        Smallest misfit so far.
    accepted
        Whether ``iterate`` is new.
    """

    evaluations: int
    reused: int
    iterate: Iterate | None
    best: float
    accepted: bool
    names: tuple[str, ...]


Watch = Callable[[Progress], None]


@dataclass(frozen=True, eq=False)
class Identification:
    """What an identification found.

    Attributes
    ----------
    folder
        Holds the log, the summary, the figures and, unless asked otherwise, the card.
    card
        The card written; None where nothing of the card was fitted.
    study
        The identified study with the values found.
    studies, curves
        The simulated tests and the measured curves.
    families, parameters
        What was fitted.
    values
        Found, in the units of the parameters, shape [p].
    uncertainty
        Intervals, correlations, warnings.
    iterates
        Accepted points from the start on.
    solution
        Residuals and Jacobian at the end, and whether the optimiser converged.
    misfit
        Root mean square of the relative errors.
    covered_deg
        Largest kinematic shear angle of the compared curves [degrees]; None where no test has one.
    notes
        What was done to the curves.
    warnings
        What to know before trusting the values.
    evaluations, reused, seconds
        Simulations made, simulations found in the log, wall time.
    """

    folder: Path
    card: Path | None
    study: Study
    studies: tuple[Study, ...]
    curves: tuple[Curve, ...]
    families: tuple[Family, ...]
    parameters: tuple[Parameter, ...]
    values: Point
    uncertainty: Uncertainty
    iterates: tuple[Iterate, ...]
    solution: Solution
    misfit: float
    covered_deg: float | None
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    evaluations: int
    reused: int
    seconds: float

    @property
    def fabric(self) -> Fabric:
        """The fabric with the values found."""
        return self.study.fabric

    @property
    def runs_ok(self) -> bool:
        """Whether the simulations at the end passed their own checks of quality."""
        return not any(outcome.warnings for outcome in self.solution.outcomes)

    @property
    def ok(self) -> bool:
        """Whether the optimiser converged and the simulations at the end passed their checks."""
        return self.solution.converged and self.runs_ok


def identify(
    study: Study | str | Path,
    targets: Sequence[Target | Path | str],
    fit: Sequence[Fit | str],
    *,
    out: Path | str,
    changes: Mapping[str, Any] | Sequence[str] = (),
    output: Path | str | None = None,
    until_slip: bool = False,
    tracking: Sequence[MarkerTracking] = (),
    weighting: Weighting = "relative",
    reading: Reading = Reading(),  # noqa: B008 (frozen)
    method: Method = "least-squares",
    trials: int = 64,
    seed: int = 0,
    jobs: int | None = None,
    most_iterations: int = 40,
    resume: bool = False,
    figures: bool = True,
    watch: Watch | None = None,
) -> Identification:
    """Change parameters until the simulation of the tests meets the measured curves.

    Parameters
    ----------
    study
        The study whose card (and keys) are identified; it simulates every target that names no other.
    targets
        Curves of force against displacement. Studies of other targets are run with the card of ``study``.
    fit
        What to fit, see :class:`weftform.identification.Fit`.
    out
        Folder for the log of evaluations, the summary, the card and the figures.
    changes
        Changes of ``study``, as for :meth:`weftform.Study.load`.
    output
        Card to write or update; ``out/card.toml`` without.
    until_slip, tracking
        Compare bias-extension curves up to the onset of slip only, seen in markers or a column of angles.
    weighting
        ``relative``: errors count as shares of the force (of at least 2 % of the largest); ``uniform``: as shares of
        the largest force.
    method, trials, seed
        ``global`` looks at ``trials`` points between the bounds first (needs optuna) and goes on from the best.
    jobs
        Simulations side by side, each in a process of its own; as many as pay without. The result does not depend
        on it.
    most_iterations
        Steps of the least squares.
    resume
        Go on with an identification in ``out`` that was interrupted: what its log holds is not run again.
    watch
        Called after every simulation and for every accepted point.

    Raises
    ------
    IdentificationError, MeasurementError, StudyError, CardError, ResultError
        Nothing was run, or (a full disk, a start that cannot be run) what was run is in the log.
    KeyboardInterrupt
        What was run is in the log; ``resume`` goes on.

    Examples
    --------
    >>> from weftform import identify
    >>> found = identify("bias-extension", ["curve.csv"], ["shear.G12"], out="results/G12")  # doctest: +SKIP
    """
    begun = time.perf_counter()
    folder = Path(out)
    if method == "global":
        require_optuna()
        if trials < 1:
            raise IdentificationError("no trials", key="--trials", expected="1 at least", got=str(trials))
    if most_iterations < 1:
        raise IdentificationError("no steps", key="--max-iterations", expected="1 at least", got=str(most_iterations))
    main = study if isinstance(study, Study) else Study.load(study, changes)
    if isinstance(study, Study) and changes:
        raise IdentificationError("changes go with a study by name", hint="Study.load(name, changes)")
    asked = [t if isinstance(t, Target) else Target(t) for t in targets]
    if not asked:
        raise IdentificationError("no curve to meet", key="--target", expected="one file at least")
    studies, homes = studies_of(main, str(study), asked)
    curves, notes = compared_curves(
        asked, studies, homes, reading=reading, weighting=weighting, until_slip=until_slip, tracking=tracking
    )
    covered = covered_angle(curves, studies)
    families = families_of([f if isinstance(f, Fit) else Fit.parse(f) for f in fit], main, covered)
    parameters = tuple(p for family in families for p in family.parameters)
    count = sum(len(c.force) for c in curves)
    if count < len(parameters) + 2:
        raise IdentificationError(
            f"{count} points cannot determine {len(parameters)} parameters",
            expected=f"{len(parameters) + 2} points at least",
            got=str(count),
            hint="fit fewer parameters, widen --range, or add curves",
        )
    card_file = Path(output) if output is not None else folder / CARD
    of_card = bool(changes_of(families, tuple(p.start for p in parameters)).card)
    if output is not None:
        check_output(card_file, of_card)
    claim(folder, resume=resume)
    simulated = [simulated_until(s, k, curves) for k, s in enumerate(studies)]
    names = tuple(p.name for p in parameters)

    def tell(accepted: bool) -> None:
        if watch is not None:
            last = objective.iterates[-1] if objective.iterates else None
            best = min((i.misfit for i in objective.iterates), default=np.inf)
            watch(Progress(evaluations.done, evaluations.reused, last, best, accepted, names))

    drawn = -np.inf

    def accept(_: Iterate) -> None:
        nonlocal drawn
        if figures and time.perf_counter() - drawn > BETWEEN_PICTURES:
            from weftform.identification.figures import draw_current

            draw_current(objective, studies, folder / "current.png")
            drawn = time.perf_counter()
        tell(True)

    workers = jobs_for(jobs, len(parameters) * len(studies))
    with Evaluations(simulated, families, folder, workers, lambda *_: tell(False)) as evaluations:
        objective = Objective(evaluations, curves, parameters, accept, step_for(simulated))
        start = np.zeros(len(parameters))
        if method == "global":
            start = global_search(objective, trials, seed)
        solution = least_squares(objective, start, most_iterations)
    lengths = np.cumsum([len(c.force) for c in curves])[:-1]
    sure = uncertainty(
        solution.jacobian,
        np.split(solution.residuals, lengths),
        [c.weight for c in curves],
        parameters,
        solution.values,
    )
    warnings = [f"{s.name}: {w}" for s, o in zip(studies, solution.outcomes, strict=True) for w in o.warnings]
    if not solution.converged:
        warnings.append(f"the fit has not converged ({solution.message}): raise --max-iterations and --resume")
    found = Identification(
        folder=folder,
        card=card_file if of_card else None,
        study=changed(main, changes_of(families, solution.values)),
        studies=tuple(studies),
        curves=tuple(curves),
        families=families,
        parameters=parameters,
        values=solution.values,
        uncertainty=sure,
        iterates=tuple(objective.iterates),
        solution=solution,
        misfit=objective.misfit_of(solution.residuals),
        covered_deg=covered,
        notes=tuple(notes),
        warnings=(*warnings, *sure.warnings),
        evaluations=evaluations.done,
        reused=evaluations.reused,
        seconds=time.perf_counter() - begun,
    )
    from weftform.identification.record import write_identified_card, write_summary

    if of_card:
        write_identified_card(found, own=output is None)
    write_summary(found)
    if figures:
        from weftform.identification.figures import draw_identification

        draw_identification(found)
    return found
