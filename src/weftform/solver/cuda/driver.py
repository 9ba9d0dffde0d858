"""Steps, surveys and ledger on the GPU, for :class:`weftform.solver.Simulation`.

The state lives on the device. The host keeps what is small (clock, tools, driven crossings) and hands it over with each
batch of steps; positions and fields come back only when they are asked for.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import cuda
from numpy.typing import NDArray

from weftform.errors import DeviceError
from weftform.mechanics.motion import motion_value
from weftform.solver import energies, survey
from weftform.solver import layout as at
from weftform.solver.cuda import looking
from weftform.solver.cuda.functions import SIMULATED, python_function
from weftform.solver.cuda.gpu import find_gpu
from weftform.solver.cuda.interrupts import uninterrupted
from weftform.solver.cuda.launch import COMPILE_ONLY, S_TOOLS, Constants, Tile, tile_for
from weftform.solver.cuda.sweep import compile_sweep, start_driven
from weftform.solver.layout import Layout
from weftform.solver.loop import (
    C_DRIVE_WORK,
    C_INERTIA,
    C_LAST_STEP,
    C_STEP,
    C_STEPS_DONE,
    C_TIME,
    COSINE,
    P_LAST_Z,
    P_Z,
    SINE,
    T_MASS,
    T_MOTION,
)

Floats = NDArray[np.float64]

value_of_motion = python_function(motion_value)
"""Called a few times per step from Python, where calling a compiled function gains nothing over its compilation."""
MOVING = at.INVERSE_MASS
"""Fields that a step changes for every crossing: position and velocity, kept twice."""
LOOKING_THREADS = 128
"""Threads of a block that looks at a row."""
SIMULATOR_TILE = Tile(6, 3, 1)
"""Under the simulator, which starts an operating-system thread for every thread of a block."""


class CudaDriver:
    """State and kernels of one simulation on the GPU.

    Parameters
    ----------
    layout
        Where the fields lie.
    constants
        Laws, sizes.
    integrals
        Of the laws of warp and weft, for the ledger.
    fields
        Initial state, shape [rows, fields, stride]. One band: the rows of the grid in their order.
    motions
        (times, values, knots, ramp) of the motions, as the time loop takes them.
    driven
        (nodes in ``fields``, held, modes, motion of each mode, kind of each mode).
    viscosity, damping, density
        Dashpot [mm2], mass damping [1/s], mass per area [tonne/mm2] (:meth:`Simulation._advance`).
    tile
        Elements and threads of a block; chosen without.

    Raises
    ------
    DeviceError
        No usable GPU, or not enough memory on it.
    """

    def __init__(
        self,
        layout: Layout,
        constants: Constants,
        integrals: tuple[Floats, Floats],
        fields: Floats,
        motions: tuple[Floats, Floats, NDArray[np.int64], float],
        driven: tuple[NDArray[np.int64], NDArray[np.bool_], Floats, NDArray[np.int64], NDArray[np.int64]],
        *,
        viscosity: float,
        damping: float,
        density: float,
        tile: Tile | None = None,
    ) -> None:
        self.gpu = find_gpu()
        self.layout, self.constants = layout, constants
        self.rows, self.columns = constants.rows, constants.columns
        self._motions, self._mode_motion, self._mode_kind = motions, driven[3], driven[4]
        self._viscosity, self._damping, self._density = viscosity, damping, density
        needed = fields.nbytes + 2 * 8 * self.rows * MOVING * layout.stride
        if needed > self.gpu.memory:
            raise DeviceError(
                "the blank does not fit into the memory of the GPU",
                key="--device",
                expected=f"{needed / 2**20:.0f} MiB free",
                got=f"{self.gpu.memory / 2**20:.0f} MiB",
                hint="take longer cells (blank.cell_length_mm), or run with --device cpu",
            )
        sums = layout.tools + layout.driven
        self.tile = tile or (SIMULATOR_TILE if SIMULATED else tile_for(sums))
        self._look_threads = SIMULATOR_TILE.threads if SIMULATED else LOOKING_THREADS
        self._blocks = self.tile.grid(self.rows, self.columns)
        self._shared = self.tile.shared_bytes(sums)
        self._sweep = compile_sweep(layout, constants, self.tile)
        self._survey = looking.compile_survey(layout, constants, self._look_threads)
        self._ledger = looking.compile_ledger(layout, constants, self._look_threads)
        self._integrals = tuple(cuda.to_device(np.ascontiguousarray(i)) for i in integrals)
        self._partial = cuda.to_device(np.zeros((max(sums, 1), self._blocks[0] * self._blocks[1])))
        self._finished = cuda.to_device(np.zeros(1, np.int32))
        self._touching = cuda.to_device(np.full((max(layout.tools, 1), self.rows), survey.TOUCHING, np.int8))
        self._lay_out_driven(*driven[:3])
        self.send(fields)

    def _lay_out_driven(self, nodes: NDArray[np.int64], held: NDArray[np.bool_], modes: Floats) -> None:
        row, column = np.divmod(nodes, self.layout.row)
        place = np.full((self.rows, self.columns), -1, np.int32)
        place[row, column] = np.arange(len(nodes))
        self._driven_count = len(nodes)
        self._driven_place, self._driven_nodes, self._held, self._modes = _on_device(
            place, row * MOVING * self.layout.stride + column, held.astype(np.int8), modes
        )

    # -- state -------------------------------------------------------------------------------------------------------

    def send(self, fields: Floats) -> None:
        """Replace the state on the device by ``fields``, shape [rows, fields, stride]."""
        moving = np.ascontiguousarray(fields[:, :MOVING]).reshape(-1)
        self._now, self._new = cuda.to_device(moving), cuda.to_device(moving)
        self._fields = cuda.to_device(np.ascontiguousarray(fields).reshape(-1))
        self._moving_ahead = self._fields_ahead = False

    def fetch_moving(self, fields: Floats) -> None:
        """Bring positions and velocities in ``fields`` up to date."""
        if self._moving_ahead:
            fields[:, :MOVING] = self._now.copy_to_host().reshape(self.rows, MOVING, -1)
            self._moving_ahead = False

    def fetch(self, fields: Floats) -> None:
        """Bring all of ``fields`` up to date."""
        if self._fields_ahead:
            kept = fields[:, :MOVING].copy()
            self._fields.copy_to_host(fields.reshape(-1))
            fields[:, :MOVING] = kept
            self._fields_ahead = False
        self.fetch_moving(fields)

    # -- steps -------------------------------------------------------------------------------------------------------

    def advance(
        self, clock: Floats, steps: int, stop: float, tools: Floats, poses: Floats, driven_state: Floats
    ) -> int:
        """Make at most ``steps`` steps, up to the time ``stop``; returns the number made.

        ``clock``, ``poses`` and ``driven_state`` are brought up to date, as by the time loop of the processor.
        """
        with uninterrupted():
            return self._advance(clock, steps, stop, tools, poses, driven_state)

    def _advance(
        self, clock: Floats, steps: int, stop: float, tools: Floats, poses: Floats, driven_state: Floats
    ) -> int:
        plan = self._schedule(clock, steps, stop, tools, poses)
        made = len(plan) - 1
        if made == 0:
            return 0
        schedule, table, pose, state, work = _on_device(plan, tools, poses, driven_state, np.zeros(1))
        if self._driven_count:
            start_driven[-(-self._driven_count // 64), min(self._driven_count, 64)](
                self._now, schedule, self.layout.stride, S_TOOLS + self.layout.tools, self._driven_nodes, self._held,
                self._modes, state,
            )  # fmt: skip
        for s in range(made):
            self._launch(s, schedule, table, pose, state, work)
            self._now, self._new = self._new, self._now
        cuda.synchronize()  # type: ignore[no-untyped-call]  # who measures the time of steps shall see it
        if len(poses):
            poses[:] = pose.copy_to_host()
        if len(driven_state):
            driven_state[:] = state.copy_to_host()
            clock[C_DRIVE_WORK] += work.copy_to_host()[0]
        self._moving_ahead = self._fields_ahead = True
        return made

    def compile(self, tools: Floats, poses: Floats, driven_state: Floats) -> None:
        """Compile the kernel of a step; those that look have been used by the first survey."""
        self._launch(COMPILE_ONLY, *_on_device(np.zeros((1, S_TOOLS)), tools, poses, driven_state, np.zeros(1)))

    def _launch(self, s: int, schedule: Any, tools: Any, poses: Any, driven_state: Any, work: Any) -> None:
        """One step, from ``_now`` to ``_new``."""
        self._sweep[self._blocks, self.tile.threads, 0, self._shared](
            self._now, self._new, self._fields, tools, poses, self._touching, schedule, s, self._partial,
            self._finished, self._driven_place, self._held, self._modes, driven_state, work,
        )  # fmt: skip

    def _schedule(self, clock: Floats, steps: int, stop: float, tools: Floats, poses: Floats) -> Floats:
        """What changes from step to step and is known before (``S_`` constants); moves the clock.

        One row per step and an empty one behind the last.
        """
        times, values, knots, ramp = self._motions
        step, last_step, inertia = (float(clock[c]) for c in (C_STEP, C_LAST_STEP, C_INERTIA))
        viscosity = self._viscosity * self._density * inertia / step
        rows: list[list[float]] = []
        while len(rows) < steps and clock[C_TIME] < stop:
            time = float(clock[C_TIME])
            mean = 0.5 * (step + last_step)
            loss = 0.5 * self._damping * mean
            keep = (1.0 - loss) / (1.0 + loss)
            kick = mean / ((1.0 + loss) * inertia)
            damping = 0.25 * self._damping * self._density * inertia * mean
            row = [step, last_step, kick, keep, damping, viscosity, 1.0 / (step * keep)]
            for k, tool in enumerate(tools):
                motion = int(tool[T_MOTION])
                at_time = time if tool[T_MASS] > 0.0 else time + step
                row.append(
                    value_of_motion(times[motion], values[motion], knots[motion], ramp, at_time)
                    if motion >= 0
                    else float(poses[k, P_Z])
                )
            for motion, kind in zip(self._mode_motion, self._mode_kind, strict=True):
                value = value_of_motion(times[motion], values[motion], knots[motion], ramp, time + step)
                row.append(math.cos(value) - 1.0 if kind == COSINE else math.sin(value) if kind == SINE else value)
            rows.append(row)
            clock[C_TIME] = time + step
            last_step = step
        clock[C_LAST_STEP] = last_step
        clock[C_STEPS_DONE] += len(rows)
        width = S_TOOLS + len(tools) + len(self._mode_motion)
        return np.array([*rows, [0.0] * width])

    # -- looking -----------------------------------------------------------------------------------------------------

    def survey(self, tools: Floats, poses: Floats, reach: float, ahead: int, margin: float) -> Floats:
        """What :func:`weftform.solver.survey.survey` returns; classes of the rows stay on the device."""
        entries = looking.R_TOOLS + 2 * len(tools)
        result = cuda.to_device(np.zeros((self.rows, entries)))
        self._survey[self.rows, self._look_threads, 0, 8 * entries * self._look_threads](
            self._now, self._fields, *_on_device(tools, poses), result,
        )  # fmt: skip
        found = result.copy_to_host()
        self._inertia_sum = float(found[:, looking.R_INERTIA].sum())
        out = np.zeros(survey.ENTRIES)
        out[survey.FINITE] = 1.0
        worst = found[:, looking.R_WORST]
        if worst.any():
            row = int(np.flatnonzero(worst)[0])
            out[survey.FINITE] = 0.0
            out[survey.WORST_ROW], out[survey.WORST_COLUMN] = row, worst[row] - 1.0
            return out
        # a row without crossings of the blank has found minus infinity
        largest = np.maximum(found.max(axis=0), 0.0)
        out[survey.FASTEST] = math.sqrt(largest[looking.R_FASTEST])
        out[survey.WARP_STRAIN] = math.sqrt(largest[looking.R_WARP]) - 1.0
        out[survey.WEFT_STRAIN] = math.sqrt(largest[looking.R_WEFT]) - 1.0
        shortest = -float(found[:, looking.R_SHORTEST].max())
        out[survey.SLACKEST] = math.sqrt(shortest) - 1.0 if shortest < math.inf else 0.0
        out[survey.HALF_TANGENT] = largest[looking.R_HALF_TANGENT]
        touching = np.full((max(len(tools), 1), self.rows), survey.CLEAR, np.int8)
        for k, pose in enumerate(poses):
            gaps, edges = -found[:, looking.R_TOOLS + 2 * k], -found[:, looking.R_TOOLS + 2 * k + 1]
            way = 2.0 * (out[survey.FASTEST] * reach + abs(pose[P_Z] - pose[P_LAST_Z]) * ahead) + margin
            near = np.where(edges > way, survey.ON_FACE, survey.TOUCHING)
            touching[k] = np.where(gaps < way, near, survey.CLEAR)
            out[survey.PENETRATION] = max(out[survey.PENETRATION], -float(gaps.min()))
        self._touching = cuda.to_device(touching)
        return out

    def kinetic_energy(self, density: float) -> float:
        """Kinetic energy of the fabric at the last survey [mJ], for a mass per area ``density`` [tonne/mm2]."""
        return 0.5 * density * self._inertia_sum

    def enter_ledger(self, tools: Floats, poses: Floats, density: float) -> Floats:
        """What :func:`weftform.solver.energies.enter_ledger` returns."""
        result = cuda.to_device(np.zeros((self.rows, energies.ENTRIES)))
        self._ledger[self.rows, self._look_threads, 0, 8 * energies.ENTRIES * self._look_threads](
            self._now, self._fields, *_on_device(tools, poses), *self._integrals, result,
        )  # fmt: skip
        self._fields_ahead = True
        entry: Floats = result.copy_to_host().sum(axis=0)
        entry[energies.KINETIC] *= density
        return entry


def _on_device(*arrays: NDArray[Any]) -> tuple[Any, ...]:
    """Copies on the device."""
    return tuple(cuda.to_device(_filled_up(array)) for array in arrays)


def _filled_up(values: NDArray[Any]) -> NDArray[Any]:
    """An empty array as zeros of one element in each empty direction: the device has no empty arrays."""
    if values.size:
        return np.ascontiguousarray(values)
    return np.zeros(tuple(max(n, 1) for n in values.shape), values.dtype)
