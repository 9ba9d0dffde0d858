"""What a kind of study has to answer."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weftform.result.fields import Fields
from weftform.solver import Problem, Settings, Simulation
from weftform.study.study import Study

Floats = NDArray[np.float64]
Row = dict[str, float]


class Case(ABC):
    """A study about to be run.

    Parameters
    ----------
    study
        A study of the kind.
    """

    noisy_force = False
    """Whether contact makes the force flutter, so that a row of the history holds its mean since the row before."""

    columns: tuple[str, ...] = ()
    """Columns of ``history.csv`` beyond those of every study, see :mod:`weftform.execution`."""

    def __init__(self, study: Study) -> None:
        self.study = study
        self.grid = study.grid
        self.fabric = study.fabric

    @abstractmethod
    def problem(self) -> Problem:
        """What the solver advances."""

    @property
    def begin(self) -> float:
        """When the loading proper begins [s]; the first kept instant."""
        return 0.0

    @property
    @abstractmethod
    def end(self) -> float:
        """When the study ends [s]."""

    @abstractmethod
    def displacement(self, simulation: Simulation) -> float:
        """Stroke or displacement so far [mm]."""

    @abstractmethod
    def force(self, simulation: Simulation) -> float:
        """Force now on the punch or the moving clamp [N], of the whole blank."""

    def row(self, simulation: Simulation, fields: Fields, force: float) -> Row:
        """Values of :attr:`columns` at an instant."""
        return {}

    @abstractmethod
    def summary(self, rows: list[Row], fields: Fields) -> dict[str, Any]:
        """Entries of ``summary.json`` beyond those of every study."""

    def warnings(self) -> list[str]:
        """What the user should know before the study is run."""
        return []

    def settings(self, ramp: float, end_ramp: float | None = None) -> Settings:
        """Numerical settings of the study."""
        solver = self.study.model.solver
        return Settings(
            ramp=ramp,
            end_ramp=end_ramp,
            mass_scaling=solver.mass_scaling,
            damping=solver.damping_per_s,
            viscosity=solver.viscosity,
            hourglass=solver.hourglass,
            safety=solver.safety,
            least_step=solver.least_step_s,
            most_steps=solver.most_steps,
        )
