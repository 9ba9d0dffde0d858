"""What a simulation needs to know and what it says about energy."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from weftform.blank import YarnGrid
from weftform.fabric import Fabric
from weftform.tooling import RigidTool

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """A value that passes through knots in time, soft at each (:func:`weftform.mechanics.motion.motion_value`)."""

    times: tuple[float, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class Driven:
    """Crossings that follow prescribed motions.

    Attributes
    ----------
    nodes
        Flat indices (row * columns + column), shape [nodes].
    held
        Which of the components x, y, z follow, shape [nodes, 3]; the others are free.
    modes
        Displacement [mm] per unit of each amplitude, shape [modes, nodes, 3].
    motions
        Index of the motion behind each mode, shape [modes].
    kinds
        How it enters: ``loop.IDENTITY``, ``loop.COSINE`` or ``loop.SINE``, shape [modes].
    """

    nodes: NDArray[np.int64]
    held: NDArray[np.bool_]
    modes: Floats
    motions: tuple[int, ...]
    kinds: tuple[int, ...]


@dataclass(frozen=True)
class Settings:
    """Numerical settings; see ``study.schema.SolverTable``."""

    ramp: float = 0.2
    end_ramp: float | None = None
    """Like ``ramp`` without."""
    mass_scaling: float = 1.0
    damping: float = 0.0
    viscosity: float = 0.06
    """Dashpot along each connector, as a share of the critical damping of the highest mode of the net."""
    hourglass: float = 0.01
    safety: float = 0.85
    least_step: float = 0.0
    """Below this step [s] the mass of the fabric is scaled up, uniformly and only as long as it takes."""
    most_steps: int = 20_000_000

    @property
    def ramps(self) -> tuple[float, float]:
        """Shares of a motion's time in which it gathers and loses speed."""
        return self.ramp, self.ramp if self.end_ramp is None else self.end_ramp


@dataclass(frozen=True)
class Problem:
    """Everything a simulation needs."""

    grid: YarnGrid
    fabric: Fabric
    tools: tuple[RigidTool, ...] = ()
    motions: tuple[Motion, ...] = ()
    stroke: int = -1
    """Motion of the tools that make the stroke."""
    holding: int = -1
    """Motion (0 to 1) that scales the forces of the tools that are pushed."""
    driven: Driven | None = None
    settings: Settings = field(default_factory=Settings)


@dataclass(frozen=True)
class Ledger:
    """Energies [mJ] of the modelled part at one instant."""

    kinetic: float
    connectors: float
    membrane: float
    hourglass: float
    contact: float
    friction: float
    damping: float
    work: float

    @property
    def internal(self) -> float:
        """Energy stored in the fabric and its contacts."""
        return self.connectors + self.membrane + self.hourglass

    @property
    def imbalance(self) -> float:
        """Work done minus all that it turned into [mJ]."""
        return self.work - self.kinetic - self.internal - self.contact - self.friction - self.damping
