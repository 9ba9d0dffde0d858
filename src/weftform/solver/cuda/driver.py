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
from weftform.solver import energies, survey
from weftform.solver import layout as at
from weftform.solver.cuda import looking
from weftform.solver.cuda.functions import SIMULATED
from weftform.solver.cuda.gpu import find_gpu
from weftform.solver.cuda.launch import COMPILE_ONLY, MOVING, S_TOOLS, Constants, Tile, kept_fields, tile_for
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
from weftform.solver.machine import Machine, value_of_motion
from weftform.solver.material import Material
from weftform.solver.problem import Problem
from weftform.solver.sheet import Sheet

Floats = NDArray[np.float64]

ALL_PARTS = ("moving", "kept", "grip", "heats")
"""What lives on the device, see :meth:`CudaDriver.sync`."""
LOOKING_THREADS = 128
"""Threads of a block that looks at a row."""
SIMULATOR_TILE = Tile(6, 3, 1)
"""Under the simulator, which starts an operating-system thread for every thread of a block."""


class CudaDriver:
    """State and kernels of one simulation on the GPU.

    Parameters
    ----------
    problem
        For its settings.
    layout, material
        Where the fields lie, and the laws.
    sheet, machine
        What the device starts from, and what :meth:`sync` brings up to date: state, friction tractions and heats. One
        band: the local rows are the rows of the grid. Tools and driven crossings are kept up to date.
    density
        Mass per area [tonne/mm2].

    Raises
    ------
    DeviceError
        No usable GPU, or not enough memory on it.
    """

    def __init__(
        self, problem: Problem, layout: Layout, material: Material, sheet: Sheet, machine: Machine, density: float
    ) -> None:
        self.gpu = find_gpu()
        settings = problem.settings
        self.layout, self.sheet, self.machine = layout, sheet, machine
        self.rows, self.columns = sheet.rows, sheet.columns
        self._damping, self._density = settings.damping, density
        sums = layout.tools + layout.driven
        self.tile = SIMULATOR_TILE if SIMULATED else tile_for(sums)
        self._look_threads = SIMULATOR_TILE.threads if SIMULATED else LOOKING_THREADS
        self._blocks = self.tile.grid(self.rows, self.columns)
        self._shared = self.tile.shared_bytes(sums)
        self._accounts = self._blocks[0] * self._blocks[1] * self.tile.threads
        self._check_memory()
        constants = Constants.of(material, layout, self.rows, self.columns, len(machine.mode_motion))
        self._sweep = compile_sweep(layout, constants, self.tile)
        self._survey = looking.compile_survey(layout, constants, self._look_threads)
        self._ledger = looking.compile_ledger(layout, constants, self._look_threads)
        self._integrals = _on_device(*(integrals for _, integrals, *_ in material.laws[:2]))
        self._traits, self._trait_rows = _on_device(sheet.traits.reshape(-1), sheet.trait_rows)
        self._partial, self._finished, self._touching = _on_device(
            np.zeros((max(sums, 1), self._blocks[0] * self._blocks[1])),
            np.zeros(1, np.int32),
            np.full((layout.tools, self.rows), survey.TOUCHING, np.int8),
        )
        self._lay_out_driven()
        self.send()

    def _check_memory(self) -> None:
        sheet, heats = self.sheet, 8 * self._accounts * (1 + self.layout.tools)
        moving = sheet.state[:, :MOVING].nbytes
        needed = (
            sheet.state.nbytes + sheet.memory.nbytes + moving + sheet.traits.nbytes + self.machine.grip.nbytes + heats
        )
        if needed > self.gpu.memory:
            raise DeviceError(
                "the blank does not fit into the memory of the GPU",
                key="--device",
                expected=f"{needed / 2**20:.0f} MiB free",
                got=f"{self.gpu.memory / 2**20:.0f} MiB",
                hint="take longer cells (blank.cell_length_mm), or run with --device cpu",
            )

    def _lay_out_driven(self) -> None:
        machine = self.machine
        row, column = np.divmod(machine.nodes, self.layout.row)
        place = np.full((self.rows, self.columns), -1, np.int32)
        place[row, column] = np.arange(len(machine.nodes))
        self._driven_place, self._driven_nodes, self._held, self._modes = _on_device(
            place, row * MOVING * self.layout.stride + column, machine.held.astype(np.int8), machine.modes
        )

    # -- state -------------------------------------------------------------------------------------------------------

    def send(self) -> None:
        """Replace what is on the device by what the host has."""
        state = self.sheet.state
        moving = state[:, :MOVING].reshape(-1)
        kept = np.concatenate([self.sheet.memory, state[:, MOVING:]], axis=1).reshape(-1)
        self._now, self._new, self._kept, self._grip = _on_device(moving, moving, kept, self.machine.grip.reshape(-1))
        self._clear_heats()
        self._ahead: set[str] = set()

    def _clear_heats(self) -> None:
        self._heats = cuda.to_device(np.zeros((1 + self.layout.tools, self._accounts)))

    def sync(self, *parts: str) -> None:
        """Bring the host up to date.

        Parameters
        ----------
        parts
            ``moving`` (positions and velocities), ``kept`` (forces where crossings are driven, and the ledger's memory),
            ``grip``, ``heats``; all of them without.
        """
        for part in self._ahead & set(parts or ALL_PARTS):
            self._ahead.discard(part)
            if part == "moving":
                self.sheet.state[:, :MOVING] = self._now.copy_to_host().reshape(self.rows, MOVING, -1)
            elif part == "kept":
                kept = self._kept.copy_to_host().reshape(self.rows, kept_fields(self.layout), -1)
                self.sheet.memory[:], self.sheet.state[:, MOVING:] = kept[:, : at.MEMORY], kept[:, at.MEMORY :]
            elif part == "grip" and self.layout.tools:
                self._grip.copy_to_host(self.machine.grip.reshape(-1))
            elif part == "heats":
                # booked on the first row of each row of blocks, on top of what there was before
                found = self._heats.copy_to_host().reshape(1 + self.layout.tools, self._blocks[1], -1)
                self.machine.heats[:: self.tile.rows - 1] += found.sum(axis=2).T
                self._clear_heats()

    # -- steps -------------------------------------------------------------------------------------------------------

    def advance(self, clock: Floats, steps: int, stop: float, viscosity: float) -> int:
        """Make at most ``steps`` steps, up to the time ``stop``; returns the number made.

        ``viscosity`` is that of the dashpots times the area of a cell [mm2].
        Clock, tools and driven crossings are brought up to date, as by the time loop of the processor.
        """
        machine = self.machine
        plan = self._schedule(clock, steps, stop, viscosity)
        made = len(plan) - 1
        if made == 0:
            return 0
        small = _on_device(plan, machine.tools, machine.poses, machine.driven, np.zeros(1))
        schedule, _, poses, driven, work = small
        count = len(machine.nodes)
        if count:
            start_driven[-(-count // 64), min(count, 64)](
                self._now, schedule, self.layout.stride, S_TOOLS + self.layout.tools, self._driven_nodes, self._held,
                self._modes, driven,
            )  # fmt: skip
        for s in range(made):
            self._launch(s, *small)
            self._now, self._new = self._new, self._now
        cuda.synchronize()  # type: ignore[no-untyped-call]  # who measures the time of steps shall see it
        if self.layout.tools:
            machine.poses[:] = poses.copy_to_host()
        if count:
            machine.driven[:] = driven.copy_to_host()
            clock[C_DRIVE_WORK] += work.copy_to_host()[0]
        self._ahead.update(ALL_PARTS)
        return made

    def compile(self) -> None:
        """Compile the kernel of a step; those that look have been used by the first survey."""
        machine = self.machine
        small = _on_device(np.zeros((1, S_TOOLS)), machine.tools, machine.poses, machine.driven, np.zeros(1))
        self._launch(COMPILE_ONLY, *small)

    def _launch(self, s: int, schedule: Any, tools: Any, poses: Any, driven: Any, work: Any) -> None:
        """One step, from ``_now`` to ``_new``."""
        self._sweep[self._blocks, self.tile.threads, 0, self._shared](
            self._now, self._new, self._kept, self._traits, self._trait_rows, self._grip, self._heats, tools, poses,
            self._touching, schedule, s, self._partial, self._finished, self._driven_place, self._held, self._modes,
            driven, work,
        )  # fmt: skip

    def _schedule(self, clock: Floats, steps: int, stop: float, viscosity: float) -> Floats:
        """What changes from step to step and is known before (``S_`` constants); moves the clock.

        One row per step and an empty one behind the last.
        """
        machine = self.machine
        times, values, knots, ramps = machine.times, machine.values, machine.knots, machine.ramps
        step, last_step, inertia = (float(clock[c]) for c in (C_STEP, C_LAST_STEP, C_INERTIA))
        drag = viscosity * self._density * inertia / step
        rows: list[list[float]] = []
        while len(rows) < steps and clock[C_TIME] < stop:
            time = float(clock[C_TIME])
            mean = 0.5 * (step + last_step)
            loss = 0.5 * self._damping * mean
            keep = (1.0 - loss) / (1.0 + loss)
            kick = mean / ((1.0 + loss) * inertia)
            damping = 0.25 * self._damping * self._density * inertia * mean
            row = [step, last_step, kick, keep, damping, drag, 1.0 / (step * keep)]
            for k, tool in enumerate(machine.tools):
                motion = int(tool[T_MOTION])
                at_time = time if tool[T_MASS] > 0.0 else time + step
                row.append(
                    value_of_motion(times[motion], values[motion], knots[motion], ramps, at_time)
                    if motion >= 0
                    else float(machine.poses[k, P_Z])
                )
            for mode, kind in zip(machine.mode_motion, machine.mode_kind, strict=True):
                value = value_of_motion(times[mode], values[mode], knots[mode], ramps, time + step)
                row.append(math.cos(value) - 1.0 if kind == COSINE else math.sin(value) if kind == SINE else value)
            rows.append(row)
            clock[C_TIME] = time + step
            last_step = step
        clock[C_LAST_STEP] = last_step
        clock[C_STEPS_DONE] += len(rows)
        width = S_TOOLS + len(machine.tools) + len(machine.mode_motion)
        return np.array([*rows, [0.0] * width])

    # -- looking -----------------------------------------------------------------------------------------------------

    def survey(self, reach: float, ahead: int, margin: float) -> Floats:
        """What :func:`weftform.solver.survey.survey` returns; classes of the rows stay on the device."""
        tools, poses = self.machine.tools, self.machine.poses
        entries = looking.R_TOOLS + 2 * len(tools)
        result = cuda.to_device(np.zeros((self.rows, entries)))
        self._survey[self.rows, self._look_threads, 0, 8 * entries * self._look_threads](
            self._now, self._traits, self._trait_rows, *_on_device(tools, poses), result,
        )  # fmt: skip
        found = result.copy_to_host()
        out = np.zeros(survey.ENTRIES)
        out[survey.KINETIC] = found[:, looking.R_INERTIA].sum()
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
        touching = np.full((len(tools), self.rows), survey.CLEAR, np.int8)
        for k, pose in enumerate(poses):
            gaps, edges = -found[:, looking.R_TOOLS + 2 * k], -found[:, looking.R_TOOLS + 2 * k + 1]
            way = 2.0 * (out[survey.FASTEST] * reach + abs(pose[P_Z] - pose[P_LAST_Z]) * ahead) + margin
            near = np.where(edges > way, survey.ON_FACE, survey.TOUCHING)
            touching[k] = np.where(gaps < way, near, survey.CLEAR)
            out[survey.PENETRATION] = max(out[survey.PENETRATION], -float(gaps.min()))
        (self._touching,) = _on_device(touching)
        return out

    def enter_ledger(self) -> Floats:
        """What :func:`weftform.solver.energies.enter_ledger` returns."""
        result = cuda.to_device(np.zeros((self.rows, energies.ENTRIES)))
        self._ledger[self.rows, self._look_threads, 0, 8 * energies.ENTRIES * self._look_threads](
            self._now, self._kept, self._traits, self._trait_rows, self._grip,
            *_on_device(self.machine.tools, self.machine.poses), *self._integrals, result,
        )  # fmt: skip
        self._ahead.add("kept")
        rows = result.copy_to_host()
        entry: Floats = rows.sum(axis=0)
        entry[energies.CLOSED] = rows[:, energies.CLOSED].max()
        entry[energies.KINETIC] *= self._density
        return entry


def _on_device(*arrays: NDArray[Any]) -> tuple[Any, ...]:
    """Copies on the device."""
    return tuple(cuda.to_device(_filled_up(array)) for array in arrays)


def _filled_up(values: NDArray[Any]) -> NDArray[Any]:
    """An empty array as zeros of one element in each empty direction: the device has no empty arrays."""
    if values.size:
        return np.ascontiguousarray(values)
    return np.zeros(tuple(max(n, 1) for n in values.shape), values.dtype)
