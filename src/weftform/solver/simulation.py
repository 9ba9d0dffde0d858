"""A simulation: time loop, stable step and energy ledger. Knows no files."""

from __future__ import annotations

import math
import platform
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from weftform.errors import UnstableRun
from weftform.solver import energies, loop, survey
from weftform.solver import layout as at
from weftform.solver.bands import share_rows
from weftform.solver.interrupts import uninterrupted
from weftform.solver.layout import Layout, stride_for
from weftform.solver.machine import Machine
from weftform.solver.material import Material
from weftform.solver.problem import Ledger, Problem
from weftform.solver.sheet import Sheet, inertia_area
from weftform.solver.stepping import choose_holder_mass, fabric_step, holder_step
from weftform.solver.team import Team

if TYPE_CHECKING:
    from weftform.solver.cuda.driver import CudaDriver

Floats = NDArray[np.float64]

SURVEY_EVERY = 176
"""Most steps between surveys of the state (stiffness, contact search)."""
LEDGER_EVERY = 8
"""Surveys between entries of the energy ledger."""
CONTACT_MARGIN = 0.25
"""Share of the thickness within which a crossing always counts as touching."""


class Simulation:
    """Explicit central differences on the yarn grid.

    Parameters
    ----------
    problem
        What to simulate.
    threads
        Bands of rows computed in parallel; the result does not depend on it.
    device
        Where the steps are computed: ``cpu``, or ``cuda`` for a GPU (:mod:`weftform.solver.cuda`).

    Raises
    ------
    DeviceError
        A GPU was asked for and there is none that can be used.
    """

    def __init__(self, problem: Problem, threads: int = 1, device: Literal["cpu", "cuda"] = "cpu") -> None:
        grid, fabric = problem.grid, problem.fabric
        self.problem = problem
        self.device = device
        self.rows, self.columns = grid.shape
        self.bands = max(1, min(threads, self.rows // 4)) if device == "cpu" else 1
        self.density = fabric.areal_density * problem.settings.mass_scaling
        self.material = Material(fabric, grid, problem.settings.hourglass)
        self.layout = Layout(
            stride_for(self.columns),
            len(problem.tools),
            int(grid.has_half_cells),
            int(problem.driven is not None),
            *self.material.shapes,
        )
        self.sheet = Sheet(grid, self.layout, share_rows(problem, self.bands), fabric.thickness, self.density)
        self.machine = Machine(problem, self.sheet)
        self._driver: CudaDriver | None = None
        if device == "cuda":
            from weftform.solver.cuda.driver import CudaDriver

            self._driver = CudaDriver(problem, self.layout, self.material, self.sheet, self.machine, self.density)
        self.clock = np.zeros(loop.CLOCK_COLUMNS)
        self.clock[loop.C_INERTIA] = 1.0
        self.largest_inertia = 1.0
        self._inertia_work = 0.0
        self._surveys = 0
        self.last = self._survey()
        self._before = self.last
        self._enter_ledger()
        self._choose_step()
        choose_holder_mass(self.machine, self.step)
        self._loop = loop.compile_loop(self.layout)
        self._team = Team(self.bands)
        self._batch = np.zeros(loop.BATCH_COLUMNS)

    def _choose_step(self) -> None:
        settings = self.problem.settings
        step = settings.safety * fabric_step(self.problem, self.material, self.density, self._expected)
        scale = max(1.0, (settings.least_step / step) ** 2)
        if scale != self.clock[loop.C_INERTIA]:
            # heavier at the same speed: the energy that this adds is booked as work
            added = scale - self.clock[loop.C_INERTIA]
            self._inertia_work += 0.5 * self.density * added * float(self.last[survey.KINETIC])
            self.clock[loop.C_INERTIA] = scale
            self.largest_inertia = max(self.largest_inertia, scale)
        self.clock[loop.C_STEP] = min(step * math.sqrt(scale), settings.safety * holder_step(self.machine))

    @property
    def _expected(self) -> Floats:
        """The last survey, with what grew since the one before growing on: so fast straining does not outrun the step."""
        return self.last + np.maximum(self.last - self._before, 0.0)

    @property
    def viscosity(self) -> float:
        """Share of critical damping of the dashpots, times the area of a cell.

        They act on the initial length, so they grow with the square of the stretch; that much they are made weaker.
        """
        expected = self._expected
        stretch = 1.0 + max(expected[survey.WARP_STRAIN], expected[survey.WEFT_STRAIN], 0.0)
        return float(self.problem.settings.viscosity * self.problem.grid.cell_area / stretch**2)

    # -- running ---------------------------------------------------------------------------------------------------

    def advance_to(self, stop: float, watch: Callable[[Simulation], None] | None = None) -> None:
        """March to the time ``stop`` [s].

        Parameters
        ----------
        watch
            Called after each batch of steps; may raise to end the run.

        Raises
        ------
        UnstableRun
            A crossing left all bounds, or the steps are used up.
        """
        settings = self.problem.settings
        while self.time < stop * (1.0 - 1e-12):
            if self.steps >= settings.most_steps:
                raise UnstableRun(
                    f"stopped after {self.steps} steps at t = {self.time:.4g} s, before the end",
                    hint="raise solver.most_steps, or use mass scaling or a shorter duration",
                )
            # short batches at first: nothing is known yet about how fast the blank is strained
            most = min(SURVEY_EVERY, 8 + 4 * self._surveys)
            # up to the stop in batches of one size: a last one of a few steps costs as much around it as a long one
            ahead = (stop - self.time) / self.step
            with uninterrupted():
                self._advance(max(1, math.ceil(ahead / max(1.0, math.ceil(ahead / most)))), stop)
                self._surveys += 1
                self._before = self.last
                self.last = self._survey()
                if not self.last[survey.FINITE]:
                    self._report_blow_up()
                if self._surveys % LEDGER_EVERY == 0:
                    self._enter_ledger()
                self._choose_step()
            if watch is not None:
                watch(self)

    def _advance(self, steps: int, stop: float) -> int:
        if self._driver is not None:
            return self._driver.advance(self.clock, steps, stop, self.viscosity)
        self._batch[:] = steps, stop, self.viscosity
        return self._team.work(self._march)

    def _march(self, band: int, order: int) -> int:
        sheet, machine, material = self.sheet, self.machine, self.material
        return int(
            self._loop(
                sheet.state.reshape(-1), sheet.traits.reshape(-1), sheet.trait_rows, sheet.bounds, sheet.halo_to,
                sheet.halo_from, sheet.spans, sheet.edge, sheet.node, sheet.between, tuple(material.membrane),
                tuple(material.series), *material.loop_laws, material.ends, material.warp_inverse, material.weft_inverse,
                machine.tools, machine.poses, machine.pieces, machine.grip.reshape(-1), machine.reactions, machine.heats,
                machine.times, machine.values, machine.knots, machine.ramps,
                machine.nodes, machine.driven, machine.held, machine.modes, machine.mode_motion, machine.mode_kind,
                self.clock, self._batch, self.problem.settings.damping, self.density, self._team.gate, band, order,
            )
        )  # fmt: skip

    def _survey(self) -> Floats:
        layout, sheet, machine, material = self.layout, self.sheet, self.machine, self.material
        reach, margin = SURVEY_EVERY * self.clock[loop.C_STEP], self.search_margin
        if self._driver is not None:
            return self._driver.survey(reach, SURVEY_EVERY, margin)
        found: Floats = survey.survey(
            sheet.state.reshape(-1), sheet.traits.reshape(-1), sheet.trait_rows, sheet.row_index, sheet.spans,
            layout.stride, layout.fields, layout.traits, layout.half_cells, layout.tools,
            material.warp_inverse, material.weft_inverse, material.membrane[6], material.membrane[7], machine.tools, machine.poses,
            machine.pieces, reach, SURVEY_EVERY, margin,
        )  # fmt: skip
        return found

    @property
    def search_margin(self) -> float:
        """Gap below which a crossing counts as touching until the next survey, whatever its speed [mm].

        What a tool that starts now can push the fabric by is not in the speeds yet.
        """
        way = self.machine.longest_way(self.time, SURVEY_EVERY * float(self.clock[loop.C_STEP]))
        return CONTACT_MARGIN * self.problem.fabric.thickness + 2.0 * way

    def _enter_ledger(self) -> Floats:
        if self._driver is not None:
            self._entry = self._driver.enter_ledger()
            return self._entry
        layout, sheet, machine, material = self.layout, self.sheet, self.machine, self.material
        grid = self.problem.grid
        warp, weft, shear = material.laws
        self._entry = energies.enter_ledger(
            sheet.state.reshape(-1), sheet.memory.reshape(-1), sheet.traits.reshape(-1), sheet.trait_rows, sheet.row_index,
            layout.stride, layout.fields, layout.traits, layout.half_cells, layout.tools, self.density,
            material.membrane, tuple(material.series), warp, weft, shear, material.shapes,
            grid.warp_pitch, grid.weft_pitch, machine.tools, machine.poses, machine.grip,
        )  # fmt: skip
        return self._entry

    def _report_blow_up(self) -> None:
        row, column = int(self.last[survey.WORST_ROW]), int(self.last[survey.WORST_COLUMN])
        u, v = self.problem.grid.material[row, column]
        raise UnstableRun(
            f"the simulation blew up at step {self.steps}, t = {self.time:.4g} s, near the crossing "
            f"{u:.1f} mm along warp and {v:.1f} mm along weft from the centre",
            hint="lower solver.safety, lengthen loading.duration_s, or soften the contact "
            "(contact.*.stiffness_N_per_mm3)",
        )

    def compile(self) -> None:
        """Compile the time loop, or load it from the cache, by calling it for no step."""
        if self._driver is not None:
            self._driver.compile()
            return
        # by this thread alone: the others would only wait for it, and an interrupt for them
        self._batch[:] = 0.0
        self._team.try_out(self._march)

    def checkpoint(self) -> dict[str, Floats]:
        """Everything that :meth:`restore` needs to go on."""
        self._sync()
        return {
            "fields": self.sheet.state[self.sheet.row_index],
            "memory": self.sheet.memory[self.sheet.row_index],
            "poses": self.machine.poses.copy(),
            "clock": self.clock.copy(),
            "driven": self.machine.driven.copy(),
            "tools": self.machine.tools.copy(),
            "inertia": np.array([self.largest_inertia, self._inertia_work]),
            "surveys": np.array([float(self._surveys)]),
            "heats": self.machine.heats[self.sheet.row_index],
            "grip": self.machine.grip[self.sheet.row_index],
            "before": self._before,
        }

    def restore(self, saved: dict[str, Floats]) -> None:
        """Go on from a checkpoint, with any number of threads.

        Raises
        ------
        ValueError
            The checkpoint is of another problem.
        """
        fields, sheet = saved["fields"], self.sheet
        expected = (self.rows, *sheet.state.shape[1:])
        if fields.shape != expected:
            raise ValueError(f"its state has shape {fields.shape}, not {expected}")
        sheet.state[sheet.row_index] = fields
        sheet.memory[sheet.row_index] = saved["memory"]
        sheet.fill_halos()
        self.machine.poses[:] = saved["poses"]
        self.clock[:] = saved["clock"]
        self.machine.driven[:] = saved["driven"]
        self.machine.tools[:] = saved["tools"]
        self.largest_inertia, self._inertia_work = (float(v) for v in saved["inertia"])
        self._surveys = int(saved["surveys"][0])
        self.machine.heats[self.sheet.row_index] = saved["heats"]
        self.machine.grip[self.sheet.row_index] = saved["grip"]
        self._send()
        self._before = saved["before"]
        self.last = self._survey()

    def _sync(self, *parts: str) -> None:
        """Where a GPU computes, bring parts of sheet and machine up to date, or all."""
        if self._driver is not None:
            self._driver.sync(*parts)

    def _send(self) -> None:
        """Where a GPU computes, hand over what has changed here."""
        if self._driver is not None:
            self._driver.send()

    # -- looking ---------------------------------------------------------------------------------------------------

    @property
    def device_name(self) -> str:
        """What computes the steps: the processor's architecture, or the GPU."""
        return platform.machine() if self._driver is None else self._driver.gpu.name

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.clock[loop.C_TIME])

    @property
    def step(self) -> float:
        """Current time step [s]."""
        return float(self.clock[loop.C_STEP])

    @property
    def steps(self) -> int:
        """Steps made."""
        return int(self.clock[loop.C_STEPS_DONE])

    @property
    def positions(self) -> Floats:
        """Positions of the crossings [mm], shape [rows, columns, 3]; flat where they are not part of the blank."""
        self._sync("moving")
        places, grid = self.sheet.vectors(at.POSITION), self.problem.grid
        places[grid.outside] = grid.flat[grid.outside]
        return places

    @property
    def velocities(self) -> Floats:
        """Velocities of the crossings half a step ago [mm/s], shape [rows, columns, 3]."""
        self._sync("moving")
        return self.sheet.vectors(at.VELOCITY)

    @velocities.setter
    def velocities(self, values: Floats) -> None:
        self._sync()
        for c in range(3):
            self.sheet.state[self.sheet.row_index, at.VELOCITY + c, : self.columns] = values[..., c]
        self._send()

    @property
    def masses(self) -> Floats:
        """Mass of each crossing [tonne], shape [rows, columns]."""
        return self.density * float(self.clock[loop.C_INERTIA]) * inertia_area(self.problem.grid)

    @property
    def driven_forces(self) -> Floats:
        """Force that moves each driven crossing, as of the last step [N], shape [nodes, 3]; zero where it is free."""
        self._sync("kept")
        flat = self.sheet.state.reshape(-1)
        first = self.layout.force * self.layout.stride
        inner = np.stack([flat[self.machine.nodes + first + c * self.layout.stride] for c in range(3)], axis=-1)
        return np.where(self.machine.held, -inner, 0.0)

    def motion(self, index: int) -> float:
        """Value of a motion of the problem now."""
        return self.machine.motion(index, self.time)

    def tool_position(self, index: int) -> float:
        """Way of a tool along z since the start [mm]."""
        return float(self.machine.poses[index, loop.P_Z])

    def tool_reaction(self, index: int) -> float:
        """Axial force of a tool on the modelled part, upwards positive [N]."""
        return float(self.machine.poses[index, loop.P_REACTION])

    @property
    def contact_forces(self) -> Floats:
        """Force of all tools on each crossing [N], shape [rows, columns, 3]."""
        self._sync("moving", "grip")
        sheet = self.sheet
        rows = np.ascontiguousarray(sheet.state[sheet.row_index][:, :, : self.columns])
        forces: Floats = survey.contact_forces(
            rows, sheet.trait(at.AREA), self.machine.grip[sheet.row_index], self.machine.tools, self.machine.poses
        )
        return forces

    @property
    def penetration(self) -> float:
        """Largest penetration at the last survey [mm]."""
        return float(self.last[survey.PENETRATION])

    @property
    def largest_shear(self) -> float:
        """Largest angle by which two connectors that meet had closed or opened at the last :meth:`ledger` [rad]."""
        closed = min(float(self._entry[energies.CLOSED]), 1.0)
        return math.atan2(math.sqrt(closed), math.sqrt(1.0 - closed))

    def ledger(self) -> Ledger:
        """Energies now [mJ]."""
        entry = self._enter_ledger()
        self._sync("heats")
        tools = self.machine.poses
        mass = self.machine.tools[:, loop.T_MASS]
        tangential = self.machine.tools[:, loop.T_TANGENTIAL] * self.machine.tools[:, loop.T_STIFFNESS]
        heats = self.machine.heats[self.sheet.row_index].sum(axis=0)  # in the order of the grid, whatever the bands
        return Ledger(
            kinetic=float(
                self.clock[loop.C_INERTIA] * entry[energies.KINETIC]
                + 0.5 * (mass * tools[:, loop.P_VELOCITY] ** 2).sum()
            ),
            connectors=float(entry[energies.CONNECTORS]),
            membrane=float(entry[energies.MEMBRANE]),
            hourglass=float(entry[energies.HOURGLASS]),
            contact=float(entry[energies.CONTACT]),
            friction=float((heats[1:] / tangential).sum()),
            damping=float(heats[0] + tools[:, loop.P_DAMPED].sum()),
            work=float(tools[:, loop.P_WORK].sum() + self.clock[loop.C_DRIVE_WORK]) + self._inertia_work,
        )
