"""The optimiser's side: residuals and derivatives by evaluating points, least squares and the global search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from weftform.errors import IdentificationError
from weftform.fabric.laws import Floats
from weftform.identification.evaluations import Evaluations, Point
from weftform.identification.fits import Parameter
from weftform.identification.targets import Curve
from weftform.identification.worker import Outcome
from weftform.study.schema import FormingModel
from weftform.study.study import Study

STEP = 0.01
"""Change of a coordinate for a derivative. The force of an explicit run carries vibrations of some 1e-4 of it that
change with any parameter; a step of 1 % keeps them out, and the force is nearly linear in a stiffness."""
CONTACT_STEP = 0.1
"""The same where contact makes the force flutter by per cents: a smaller one would see the flutter only."""
COST_TOLERANCE = 1.0e-4
"""Relative change of the sum of squares below which the fit has ended."""
STEP_TOLERANCE = 1.0e-4
"""Relative change of the coordinates below which it has."""
BATCH = 8
"""Points of the global search between two looks at their outcomes. A constant: were it the number of processes,
the search would depend on the machine."""


@dataclass(frozen=True, eq=False)
class Iterate:
    """A point that the optimiser has accepted.

    Attributes
    ----------
    number
        0 is the start.
    values
        Of the parameters.
    misfit
        Root mean square of the relative errors, over the curves by their weights.
    outcomes
        The simulated curve of each study.
    """

    number: int
    values: Point
    misfit: float
    outcomes: tuple[Outcome, ...]


Watch = Callable[[Iterate], None]


def step_for(studies: Sequence[Study]) -> float:
    """Change of a coordinate for a derivative: larger where one of the studies has contact."""
    return CONTACT_STEP if any(isinstance(study.model, FormingModel) for study in studies) else STEP


class Objective:
    """Residuals of the curves as a function of the coordinates of the parameters."""

    def __init__(
        self,
        evaluations: Evaluations,
        curves: Sequence[Curve],
        parameters: Sequence[Parameter],
        watch: Watch,
        step: float = STEP,
    ) -> None:
        self.evaluations = evaluations
        self.curves = tuple(curves)
        self.parameters = tuple(parameters)
        self.watch = watch
        self.step = step
        self.iterates: list[Iterate] = []
        self.total_weight = sum(c.weight for c in curves)
        self.count = sum(len(c.force) for c in curves)

    def point(self, x: Floats) -> Point:
        """Values at coordinates."""
        return tuple(p.value(float(v)) for p, v in zip(self.parameters, x, strict=True))

    def residuals_of(self, outcomes: Sequence[Outcome]) -> Floats:
        """Residuals of all curves, shape [N]; infinite where a study could not be run to its end."""
        if any(outcome.failure for outcome in outcomes):
            return np.full(self.count, np.inf)
        arrays = [(np.array(o.displacement_mm), np.array(o.force_N)) for o in outcomes]
        return np.concatenate([curve.residuals(*arrays[curve.study]) for curve in self.curves])

    def misfit_of(self, residuals: Floats) -> float:
        """Root mean square of the relative errors."""
        with np.errstate(over="ignore"):
            return float(np.sqrt(residuals @ residuals / self.total_weight))

    def residuals(self, x: Floats) -> Floats:
        """Residuals at coordinates; what scipy calls."""
        return self.residuals_of(self.evaluations.at([self.point(x)])[0])

    def jacobian(self, x: Floats) -> Floats:
        """Derivatives by one-sided differences, all columns side by side, shape [N, p].

        A step that leads out of the bounds, or to a law that a card refuses, is made to the other side.
        """
        base = self.point(x)
        outcomes = self.evaluations.at([base])[0]
        centre = self.residuals_of(outcomes)
        self.accept(base, centre, outcomes)
        columns = np.full((self.count, len(x)), np.nan)
        left = list(range(len(x)))
        for side in (1.0, -1.0):
            tried = [(k, other) for k in left if (other := self._beside(x, k, side)) is not None]
            found = self.evaluations.at([self.point(other) for _, other in tried])
            for (k, other), outcome in zip(tried, found, strict=True):
                there = self.residuals_of(outcome)
                if np.isfinite(there).all():
                    columns[:, k] = (there - centre) / (other[k] - x[k])
                    left.remove(k)
        if left:
            raise IdentificationError(
                f"the study runs to neither side of {self.parameters[left[0]].name} = {base[left[0]]:.6g}",
                key="--fit",
                hint="a law may be at the edge of what a card allows: start elsewhere, or fit fewer parameters",
            )
        return columns

    def _beside(self, x: Floats, k: int, side: float) -> Floats | None:
        """Coordinates with one of them changed; None where that leads out of its bounds."""
        parameter = self.parameters[k]
        low, high = parameter.normalised(parameter.lower), parameter.normalised(parameter.upper)
        other = np.array(x, float)
        # no more than half the way between the bounds, so that one side is always within
        other[k] += side * min(self.step, 0.49 * (high - low))
        return other if low <= other[k] <= high else None

    def accept(self, values: Point, residuals: Floats, outcomes: Sequence[Outcome]) -> None:
        """Enter a point that the optimiser goes on from, unless it is the last one already."""
        if self.iterates and self.iterates[-1].values == values:
            return
        iterate = Iterate(len(self.iterates), values, self.misfit_of(residuals), tuple(outcomes))
        self.iterates.append(iterate)
        self.watch(iterate)


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the optimiser ended.

    Attributes
    ----------
    values, outcomes
        Of the best point, and the simulated curve of each study there.
    residuals, jacobian
        There, shapes [N] and [N, p].
    converged, message
        Whether it ended by its tolerances, and how.
    """

    values: Point
    outcomes: tuple[Outcome, ...]
    residuals: Floats
    jacobian: Floats
    converged: bool
    message: str


def least_squares(objective: Objective, start: Floats, most_iterations: int) -> Solution:
    """Bounded least squares by a trust region (Branch, Coleman and Li 1999, in scipy).

    Raises
    ------
    IdentificationError
        The study cannot be run at the start.
    """
    from scipy.optimize import least_squares as solve

    low = [p.normalised(p.lower) for p in objective.parameters]
    high = [p.normalised(p.upper) for p in objective.parameters]
    first = objective.evaluations.at([objective.point(start)])[0]
    failure = next((outcome.failure for outcome in first if outcome.failure), "")
    if failure:
        raise IdentificationError(
            f"the study cannot be run at the start: {failure}",
            key="--fit",
            got=", ".join(
                f"{p.name} = {p.value(float(x)):.6g}" for p, x in zip(objective.parameters, start, strict=True)
            ),
            hint="give another start: --fit NAME=START",
        )
    found = solve(
        objective.residuals,
        start,
        jac=objective.jacobian,
        bounds=(low, high),
        method="trf",
        x_scale=1.0,
        ftol=COST_TOLERANCE,
        xtol=STEP_TOLERANCE,
        gtol=1e-10,
        max_nfev=most_iterations,
    )
    values = objective.point(found.x)
    outcomes = objective.evaluations.at([values])[0]
    words = {
        0: f"stopped after {most_iterations} steps",
        1: "the gradient vanishes",
        2: "the misfit changes no more",
        3: "the parameters change no more",
        4: "misfit and parameters change no more",
    }
    return Solution(
        values,
        tuple(outcomes),
        objective.residuals_of(outcomes),
        np.asarray(found.jac),
        bool(found.success),
        words.get(int(found.status), str(found.message)),
    )


def global_search(objective: Objective, trials: int, seed: int) -> Floats:
    """Best of so many points between the bounds, chosen by a tree-structured Parzen estimator (Bergstra et al. 2011).

    The start is the first of them; least squares goes on from the best.

    Raises
    ------
    IdentificationError
        optuna is not installed, or no point could be run.
    """
    require_optuna()
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    distributions: dict[str, optuna.distributions.BaseDistribution] = {
        str(k): optuna.distributions.FloatDistribution(p.normalised(p.lower), p.normalised(p.upper))
        for k, p in enumerate(objective.parameters)
    }
    sampler = optuna.samplers.TPESampler(seed=seed, n_startup_trials=min(2 * BATCH, max(trials // 2, 1)))
    study = optuna.create_study(sampler=sampler)
    study.enqueue_trial(dict.fromkeys(distributions, 0.0))
    left = trials
    best = np.inf
    while left > 0:
        batch = [study.ask(distributions) for _ in range(min(BATCH, left))]
        places = [np.array([trial.params[str(k)] for k in range(len(distributions))]) for trial in batch]
        points = [objective.point(place) for place in places]
        for trial, point, outcomes in zip(batch, points, objective.evaluations.at(points), strict=True):
            residuals = objective.residuals_of(outcomes)
            misfit = objective.misfit_of(residuals)
            if np.isfinite(misfit):
                study.tell(trial, misfit)
            else:
                study.tell(trial, state=optuna.trial.TrialState.FAIL)
            if misfit < best:
                best = misfit
                objective.accept(point, residuals, outcomes)
        left -= len(batch)
    if not np.isfinite(best):
        raise IdentificationError(
            f"the study could be run at none of {trials} points between the bounds",
            key="--fit",
            hint="narrow the bounds, or raise --trials",
        )
    return np.array([study.best_params[str(k)] for k in range(len(distributions))])


def require_optuna() -> None:
    """Refuse a global search without the package that makes it.

    Raises
    ------
    IdentificationError
        optuna is not installed.
    """
    try:
        import optuna  # noqa: F401
    except ImportError:
        raise IdentificationError(
            "the global search needs optuna, which is not installed",
            key="--method",
            expected='least-squares, or pip install "weftform[search]"',
        ) from None
