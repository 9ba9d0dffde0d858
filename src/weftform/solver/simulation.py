"""A simulation: state, time loop, stable step and energy ledger. Knows no files."""

from __future__ import annotations

import math
import platform
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from weftform.blank import YarnGrid
from weftform.errors import UnstableRun
from weftform.fabric import Fabric
from weftform.fabric.piecewise import PiecewiseLaw, pack_law, pack_shear
from weftform.mechanics import stable_step as stability
from weftform.mechanics.motion import motion_value
from weftform.solver import energies, loop, survey
from weftform.solver import layout as at
from weftform.solver.layout import Layout, stride_for
from weftform.solver.spans import row_spans
from weftform.tooling import RigidTool

if TYPE_CHECKING:
    from weftform.solver.cuda.driver import CudaDriver

Floats = NDArray[np.float64]

SURVEY_EVERY = 64
"""Steps between surveys of the state (stiffness, contact search)."""
LEDGER_EVERY = 4
"""Surveys between entries of the energy ledger."""
CONTACT_MARGIN = 0.25
"""Share of the thickness within which a row always counts as touching."""
OUT_OF_THE_WAY = 1.0e5
"""Height of crossings that are not part of the blank [mm]."""
LOG_RANGE = 2.6
"""Largest stretch (and inverse of the smallest) for which the series of the logarithm is fitted."""
LOG_TERMS = 14
"""Terms of that series: error below 1e-10 over the range."""
HOLDER_PERIODS = 20.0
"""Automatic mass of a force-driven tool: one radian of its bounce on the contact takes this many initial steps."""


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
    mass_scaling: float = 1.0
    damping: float = 0.0
    viscosity: float = 0.06
    """Dashpot along each connector, as a share of the critical damping of the highest mode of the net."""
    hourglass: float = 0.01
    safety: float = 0.85
    least_step: float = 0.0
    """Below this step [s] the mass of the fabric is scaled up, uniformly and only as long as it takes."""
    most_steps: int = 20_000_000


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
        self._driver: CudaDriver | None = None
        self.rows, self.columns = grid.shape
        self.bands = max(1, min(threads, self.rows // 4)) if device == "cpu" else 1
        self.density = fabric.areal_density * problem.settings.mass_scaling
        warp = pack_law(fabric.warp.line_law(grid.weft_pitch), 1.5)
        weft = pack_law(fabric.weft.line_law(grid.warp_pitch), 1.5)
        shear = pack_shear(fabric.shear.stress)
        self._packed = warp, weft, shear
        self._laws = (
            _law_arguments(warp, fabric.warp.slack_ratio),
            _law_arguments(weft, fabric.weft.slack_ratio),
            _law_arguments(shear, 0.0),
        )
        self._series = _log_series()
        # polynomials go to the time loop as tuples: values, not memory, so they cannot overlap what the loop writes
        self._loop_laws = tuple(
            tuple(law[0]) if packed.pieces == 1 else law[0]
            for law, packed in zip(self._laws, self._packed, strict=True)
        )
        self._loop_ends = np.array([law[2:] for law in self._laws])
        self._loop_series = tuple(self._series)
        self.layout = Layout(
            stride=stride_for(self.columns),
            tools=len(problem.tools),
            half_cells=int(grid.has_half_cells),
            driven=int(problem.driven is not None),
            warp_degree=warp.degree,
            warp_pieces=warp.pieces,
            weft_degree=weft.degree,
            weft_pieces=weft.pieces,
            shear_degree=shear.degree,
            shear_pieces=shear.pieces,
        )
        card = fabric.card.membrane
        stabilise = problem.settings.hourglass * 0.5 * (card.warp_modulus_MPa + card.weft_modulus_MPa)
        self._membrane = np.array(
            [
                1.0 / grid.warp_pitch,
                1.0 / grid.weft_pitch,
                card.warp_modulus_MPa,
                card.weft_modulus_MPa,
                stabilise / grid.cell_area,
                *_mirror_signs(grid),
            ]
        )
        self._lay_out_bands()
        self._fill_state()
        self._place_tools()
        self._drive_crossings()
        if device == "cuda":
            self._driver = self._start_driver()
        self.clock = np.zeros(loop.CLOCK_COLUMNS)
        self.clock[loop.C_INERTIA] = 1.0
        self.largest_inertia = 1.0
        self._inertia_work = 0.0
        self._surveys = 0
        self.last = self._survey()
        self._before = self.last
        self._enter_ledger()
        self._choose_step()
        self._choose_holder_mass()
        self._loop = loop.compile_loop(self.layout, self.bands > 1)

    # -- setting up ------------------------------------------------------------------------------------------------

    def _lay_out_bands(self) -> None:
        edges = np.linspace(0, self.rows, self.bands + 1).round().astype(int)
        self._row_index = np.zeros(self.rows, np.int64)
        self._bounds = np.zeros((self.bands, 2), np.int64)
        local = 0
        halos = []
        for band in range(self.bands):
            first = edges[band] - (1 if band > 0 else 0)
            last = edges[band + 1] - 1 + (1 if band < self.bands - 1 else 0)
            self._bounds[band] = local, local + last - first
            for row in range(first, last + 1):
                if edges[band] <= row < edges[band + 1]:
                    self._row_index[row] = local
                else:
                    halos.append((local, row))
                local += 1
        self._local_rows = local
        self._halo_to = np.array([to for to, _ in halos], np.int64)
        self._halo_row = np.array([row for _, row in halos], np.int64)
        self._halo_from = self._row_index[self._halo_row] if halos else np.zeros(0, np.int64)

    def _fill_state(self) -> None:
        grid, fabric, layout = self.problem.grid, self.problem.fabric, self.layout
        rows, columns = self.rows, self.columns
        self._host_state = np.zeros((self._local_rows, layout.fields, layout.stride))
        fields = np.zeros((rows, layout.fields, layout.stride))
        # Padding and crossings outside the blank keep the flat grid's distances, so that no vector loop divides by
        # zero, and lie where no crossing of the blank can run into them.
        u = (np.arange(layout.stride) - grid.centre[0]) * grid.warp_pitch
        v = (np.arange(rows) - grid.centre[1]) * grid.weft_pitch
        plan = grid.plan(np.stack(np.broadcast_arrays(u[None, :], v[:, None]), axis=-1))
        fields[:, at.POSITION] = plan[..., 0]
        fields[:, at.POSITION + 1] = plan[..., 1]
        fields[:, at.POSITION : at.POSITION + 2, :columns][
            np.broadcast_to(grid.on_plane.transpose(0, 2, 1), (rows, 2, columns))
        ] = 0.0
        fields[:, at.POSITION + 2] = OUT_OF_THE_WAY
        fields[:, at.POSITION + 2, :columns][grid.active] = 0.0
        inertia = self.inertia_area
        with np.errstate(divide="ignore"):
            inverse = np.where(grid.active, 1.0 / (self.density * inertia), 0.0)
        for c in range(3):
            fields[:, at.INVERSE_MASS + c, :columns] = inverse
        for c in range(2):
            fields[:, at.INVERSE_MASS + c, :columns][grid.on_plane[..., c]] = 0.0
        fields[:, at.AREA, :columns] = grid.node_area
        fields[:, at.INERTIA, :columns] = inertia
        fields[:, at.WARP_LINE, : columns - 1] = grid.warp_lines
        fields[:-1, at.WEFT_LINE, :columns] = grid.weft_lines
        fields[:-1, at.VOLUME, : columns - 1] = grid.cell_share * grid.cell_area * fabric.thickness
        if layout.half_cells:
            lower, left = grid.edge_weights
            mirror, signs = grid.mirrors
            fields[:, layout.edge_weight : layout.edge_weight + 2] = 0.5
            fields[:-1, layout.edge_weight + 2, : columns - 1] = mirror
            fields[:-1, layout.edge_weight + 3, : columns - 1] = mirror * signs[..., 2]
            fields[:-1, layout.edge_weight, : columns - 1] = lower
            fields[:-1, layout.edge_weight + 1, : columns - 1] = left
        self._state[self._row_index] = fields
        if self._halo_to.size:
            self._state[self._halo_to] = fields[self._halo_row]
        spans = row_spans(grid.active)
        self._spans = np.zeros((self._local_rows, spans.shape[1]), np.int64)
        self._spans[self._row_index] = spans
        if self._halo_to.size:
            self._spans[self._halo_to] = spans[self._halo_row]
        self._edge = np.zeros((self.bands, 4 * layout.block))
        self._node = np.zeros((self.bands, 3 * layout.block))

    @cached_property
    def inertia_area(self) -> Floats:
        """Area whose mass each crossing carries [mm2], shape [rows, columns].

        A yarn on a free edge is a whole yarn (Eq. 11 counts n + 1 lines) but only half a cell of fabric belongs
        to it. It is given the mass of a whole yarn, or the one edge would set the stable step of the blank.
        """
        grid = self.problem.grid
        warp = np.zeros(grid.shape)
        warp[:, 1:] += grid.warp_lines
        warp[:, :-1] += grid.warp_lines
        weft = np.zeros(grid.shape)
        weft[1:] += grid.weft_lines
        weft[:-1] += grid.weft_lines
        lines = np.maximum(warp, weft)
        if grid.along_bias:
            # of a crossing on a plane of symmetry half is modelled, and its warp lines go on as weft lines beyond
            lines = np.where(grid.on_plane.any(axis=-1), 0.5 * (warp + weft), lines)
        return np.where(grid.active, np.maximum(grid.node_area, 0.5 * grid.cell_area * lines), 0.0)

    def _place_tools(self) -> None:
        tools = self.problem.tools
        half = 0.5 * self.problem.fabric.thickness
        self._tool_table = np.zeros((len(tools), loop.TOOL_COLUMNS))
        self._poses = np.zeros((len(tools), loop.POSE_COLUMNS))
        for row, tool in zip(self._tool_table, tools, strict=True):
            row[:5] = tool.side_s, tool.s0, tool.side_z, tool.z0, tool.radius
            row[5:9] = half, tool.stiffness, tool.friction, tool.tangential_ratio
            row[loop.T_MOTION] = self.problem.stroke if tool.motion == "stroke" else -1
        motions = list(self.problem.motions)
        for row, tool in zip(self._tool_table, tools, strict=True):
            if tool.motion == "force":
                share = motions[self.problem.holding]
                force = tool.up * tool.force / self.problem.grid.copies
                row[loop.T_MOTION] = len(motions)
                motions.append(Motion(share.times, tuple(force * v for v in share.values)))
                row[loop.T_MASS] = tool.mass / self.problem.grid.copies if tool.mass else np.nan
            elif tool.motion == "stroke" and tool.up < 0:
                stroke = motions[self.problem.stroke]
                row[loop.T_MOTION] = len(motions)
                motions.append(Motion(stroke.times, tuple(-v for v in stroke.values)))
        knots = max([len(m.times) for m in motions], default=1)
        self._motion_times = np.zeros((max(len(motions), 1), knots))
        self._motion_values = np.zeros_like(self._motion_times)
        self._motion_knots = np.ones(max(len(motions), 1), np.int64)
        for k, motion in enumerate(motions):
            n = len(motion.times)
            self._motion_times[k, :n] = motion.times
            self._motion_values[k, :n] = motion.values
            self._motion_knots[k] = n
        self._touching = np.full((len(tools), self._local_rows), survey.TOUCHING, np.int8)
        self._reactions = np.zeros((len(tools), self._local_rows))

    def _drive_crossings(self) -> None:
        driven = self.problem.driven
        layout = self.layout
        if driven is None:
            self._driven_nodes = np.zeros(0, np.int64)
            self._driven_state = np.zeros((0, 6))
            self._driven_held = np.zeros((0, 3), np.bool_)
            self._driven_modes = np.zeros((0, 0, 3))
            self._mode_motion = np.zeros(0, np.int64)
            self._mode_kind = np.zeros(0, np.int64)
            return
        row, column = np.divmod(driven.nodes, self.columns)
        local = self._row_index[row]
        self._driven_nodes = local * layout.row + column
        self._driven_state = np.zeros((len(driven.nodes), 6))
        for c in range(3):
            self._driven_state[:, c] = self._state[local, at.POSITION + c, column]
            held = driven.held[:, c]
            self._state[local[held], at.INVERSE_MASS + c, column[held]] = 0.0
        # a prescribed crossing takes its inertia and damping from the machine that moves it, not from the fabric's ledger
        whole = driven.held.all(axis=1)
        self._state[local[whole], at.INERTIA, column[whole]] = 0.0
        self._driven_held = np.ascontiguousarray(driven.held)
        self._driven_modes = np.ascontiguousarray(driven.modes)
        self._mode_motion = np.asarray(driven.motions, np.int64)
        self._mode_kind = np.asarray(driven.kinds, np.int64)

    def _start_driver(self) -> CudaDriver:
        """Hand the state over to a GPU."""
        from weftform.solver.cuda.driver import CudaDriver
        from weftform.solver.cuda.launch import Constants

        settings, layout = self.problem.settings, self.layout
        warp, weft, shear = (
            (coefficients, packed.degree, packed.pieces, *(float(v) for v in ends))
            for coefficients, packed, ends in zip(self._loop_laws, self._packed, self._loop_ends, strict=True)
        )
        constants = Constants(
            warp_law=warp,
            weft_law=weft,
            shear_law=shear,
            series=self._loop_series,
            membrane=tuple(self._membrane.tolist()),
            columns=self.columns,
            rows=self.rows,
            modes=len(self._mode_motion),
        )
        return CudaDriver(
            layout,
            constants,
            (self._laws[0][1], self._laws[1][1]),
            self._host_state,
            (self._motion_times, self._motion_values, self._motion_knots, settings.ramp),
            (self._driven_nodes, self._driven_held, self._driven_modes, self._mode_motion, self._mode_kind),
            viscosity=settings.viscosity * self.problem.grid.cell_area,
            damping=settings.damping,
            density=self.density,
        )

    @property
    def _state(self) -> Floats:
        """State on the host, shape [local rows, fields, stride]; where a GPU computes, brought up to date."""
        if self._driver is not None:
            self._driver.fetch(self._host_state)
        return self._host_state

    def _choose_step(self) -> None:
        s, grid, membrane = self.last, self.problem.grid, self._membrane
        warp, weft, shear = self._packed
        # Tangents at the largest strains of the whole blank: safe wherever a law stiffens, and never far from the
        # truth.
        # and as far ahead as they moved since the last survey, so that fast straining does not outrun the step
        ahead = s + np.maximum(s - self._before, 0.0)
        _, warp_slope = _largest(warp, ahead[survey.WARP_STRAIN])
        _, weft_slope = _largest(weft, ahead[survey.WEFT_STRAIN])
        k_warp, k_weft = warp_slope / grid.warp_pitch, weft_slope / grid.weft_pitch
        t = min(ahead[survey.HALF_TANGENT], 1.0)
        sine = 2.0 * t / (1.0 + t * t)
        ratio, ratio_slope = _largest(shear, t)
        modulus = 0.5 * (ratio + t * ratio_slope) * (1.0 + t * t) + t * ratio
        aspect = grid.cell_area / min(grid.warp_pitch, grid.weft_pitch) ** 2
        cell = self.problem.fabric.thickness * aspect * (modulus / max(1.0 - sine, 1e-3) + membrane[2] + membrane[3])
        crossing = stability.crossing_stiffness(k_warp, k_weft, cell, sine)
        contact = sum(t.stiffness for t in self.problem.tools) * grid.cell_area
        settings = self.problem.settings
        step = settings.safety * stability.stable_step(
            crossing, contact, self.density * grid.cell_area, settings.viscosity
        )
        scale = max(1.0, (settings.least_step / step) ** 2)
        if scale != self.clock[loop.C_INERTIA]:
            # heavier at the same speed: the energy that this adds is booked as work
            self._inertia_work += self._kinetic_energy() * (scale / self.clock[loop.C_INERTIA] - 1.0)
            self.clock[loop.C_INERTIA] = scale
            self.largest_inertia = max(self.largest_inertia, scale)
        self.clock[loop.C_STEP] = step * math.sqrt(scale)

    def _kinetic_energy(self) -> float:
        """Kinetic energy of the fabric [mJ]."""
        if self._driver is not None:
            return self._driver.kinetic_energy(self.density * float(self.clock[loop.C_INERTIA]))
        speeds = np.einsum("jik,jik->ji", self.velocities, self.velocities)
        inertia = self._state[self._row_index, at.INERTIA, : self.columns]
        return 0.5 * self.density * float(self.clock[loop.C_INERTIA]) * float((inertia * speeds).sum())

    def _choose_holder_mass(self) -> None:
        area = float(self.problem.grid.node_area.sum())
        for row in self._tool_table:
            if row[loop.T_MASS] == 0.0:
                continue
            spring = row[loop.T_STIFFNESS] * area
            if np.isnan(row[loop.T_MASS]):
                row[loop.T_MASS] = spring * (HOLDER_PERIODS * self.clock[loop.C_STEP]) ** 2
            # half of critical damping of the bounce on the contact
            row[loop.T_DAMPING] = math.sqrt(spring / row[loop.T_MASS])

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
            made = self._advance(min(SURVEY_EVERY, 8 + 4 * self._surveys), stop)
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
            if made == 0:
                break

    def _advance(self, steps: int, stop: float) -> int:
        settings = self.problem.settings
        if self._driver is not None:
            return self._driver.advance(self.clock, steps, stop, self._tool_table, self._poses, self._driven_state)
        if self.bands > 1:
            import numba

            # more bands than processors wait for each other; the result is the same
            numba.set_num_threads(min(self.bands, int(vars(numba.config)["NUMBA_NUM_THREADS"])))
        return int(
            self._loop(
                self._state.reshape(-1), self._bounds, self._halo_to, self._halo_from, self._spans,
                self._edge, self._node, tuple(self._membrane), self._loop_series, *self._loop_laws, self._loop_ends,
                self._membrane[0], self._membrane[1],
                self._tool_table, self._poses, self._touching, self._reactions,
                self._motion_times, self._motion_values, self._motion_knots, settings.ramp,
                self._driven_nodes, self._driven_state, self._driven_held, self._driven_modes, self._mode_motion,
                self._mode_kind, self.clock, steps, stop, settings.damping, self.density,
                settings.viscosity * self.problem.grid.cell_area,
            )
        )  # fmt: skip

    def _survey(self) -> Floats:
        layout, grid = self.layout, self.problem.grid
        reach, margin = SURVEY_EVERY * self.clock[loop.C_STEP], CONTACT_MARGIN * self.problem.fabric.thickness
        if self._driver is not None:
            return self._driver.survey(self._tool_table, self._poses, reach, SURVEY_EVERY, margin)
        found: Floats = survey.survey(
            self._state.reshape(-1), self._row_index, self.columns, layout.stride, layout.fields,
            layout.half_cells, layout.edge_weight, layout.tools, grid.warp_pitch, grid.weft_pitch,
            self._tool_table, self._poses, self._touching, reach, SURVEY_EVERY, margin,
        )  # fmt: skip
        return found

    def _enter_ledger(self) -> Floats:
        layout, grid = self.layout, self.problem.grid
        if self._driver is not None:
            return self._driver.enter_ledger(self._tool_table, self._poses, self.density)
        entry: Floats = energies.enter_ledger(
            self._state.reshape(-1), self._row_index, self.columns, layout.stride, layout.fields,
            layout.half_cells, layout.edge_weight, layout.tool, layout.tools, self.density,
            self._membrane, self._series, *self._laws,
            (layout.warp_degree, layout.warp_pieces, layout.weft_degree, layout.weft_pieces,
             layout.shear_degree, layout.shear_pieces),
            grid.warp_pitch, grid.weft_pitch, self._tool_table, self._poses,
        )  # fmt: skip
        return entry

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
            self._driver.compile(self._tool_table, self._poses, self._driven_state)
            return
        clock = self.clock.copy()
        self._advance(0, 0.0)
        self.clock[:] = clock

    def checkpoint(self) -> dict[str, Floats]:
        """Everything that :meth:`restore` needs to go on."""
        return {
            "fields": self._state[self._row_index],
            "poses": self._poses.copy(),
            "clock": self.clock.copy(),
            "driven": self._driven_state.copy(),
            "tools": self._tool_table.copy(),
            "inertia": np.array([self.largest_inertia, self._inertia_work]),
            "surveys": np.array([float(self._surveys)]),
            "before": self._before,
        }

    def restore(self, saved: dict[str, Floats]) -> None:
        """Go on from a checkpoint, with any number of threads.

        Raises
        ------
        ValueError
            The checkpoint is of another problem.
        """
        fields = saved["fields"]
        if fields.shape != self._state[self._row_index].shape:
            raise ValueError(f"its state has shape {fields.shape}, not {self._state[self._row_index].shape}")
        self._state[self._row_index] = fields
        if self._halo_to.size:
            self._state[self._halo_to] = fields[self._halo_row]
        self._state_changed()
        self._poses[:] = saved["poses"]
        self.clock[:] = saved["clock"]
        self._driven_state[:] = saved["driven"]
        self._tool_table[:] = saved["tools"]
        self.largest_inertia, self._inertia_work = (float(v) for v in saved["inertia"])
        self._surveys = int(saved["surveys"][0])
        self._before = saved["before"]
        self.last = self._survey()

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

    def _state_changed(self) -> None:
        """The host has changed the state."""
        if self._driver is not None:
            self._driver.send(self._host_state)

    def _grid_field(self, first: int) -> Floats:
        if self._driver is not None:
            self._driver.fetch_moving(self._host_state)
        rows = self._host_state[self._row_index]
        return np.ascontiguousarray(rows[:, first : first + 3, : self.columns].transpose(0, 2, 1))

    @property
    def positions(self) -> Floats:
        """Positions of the crossings [mm], shape [rows, columns, 3]; flat where they are not part of the blank."""
        grid = self.problem.grid
        return np.where(grid.active[..., None], self._grid_field(at.POSITION), grid.flat)

    @property
    def velocities(self) -> Floats:
        """Velocities of the crossings half a step ago [mm/s], shape [rows, columns, 3]."""
        return self._grid_field(at.VELOCITY)

    @velocities.setter
    def velocities(self, values: Floats) -> None:
        for c in range(3):
            self._state[self._row_index, at.VELOCITY + c, : self.columns] = values[..., c]
        self._state_changed()

    @property
    def masses(self) -> Floats:
        """Mass of each crossing [tonne], shape [rows, columns]."""
        return self.density * float(self.clock[loop.C_INERTIA]) * self.inertia_area

    @property
    def driven_forces(self) -> Floats:
        """Force that moves each driven crossing, as of the last step [N], shape [nodes, 3]; zero where it is free."""
        flat = self._state.reshape(-1)
        first = self.layout.force * self.layout.stride
        inner = np.stack([flat[self._driven_nodes + first + c * self.layout.stride] for c in range(3)], axis=-1)
        return np.where(self._driven_held, -inner, 0.0)

    def motion(self, index: int) -> float:
        """Value of a motion of the problem now."""
        return float(
            motion_value(
                self._motion_times[index],
                self._motion_values[index],
                self._motion_knots[index],
                self.problem.settings.ramp,
                self.time,
            )
        )

    def tool_position(self, index: int) -> float:
        """Way of a tool along z since the start [mm]."""
        return float(self._poses[index, loop.P_Z])

    def tool_reaction(self, index: int) -> float:
        """Axial force of a tool on the modelled part, upwards positive [N]."""
        return float(self._poses[index, loop.P_REACTION])

    @property
    def contact_forces(self) -> Floats:
        """Force of all tools on each crossing [N], shape [rows, columns, 3]."""
        rows = np.ascontiguousarray(self._state[self._row_index][:, :, : self.columns])
        forces: Floats = survey.contact_forces(rows, self.layout.tool, self._tool_table, self._poses)
        return forces

    @property
    def penetration(self) -> float:
        """Largest penetration at the last survey [mm]."""
        return float(self.last[survey.PENETRATION])

    def ledger(self) -> Ledger:
        """Energies now [mJ]."""
        entry = self._enter_ledger()
        tools = self._poses
        mass = self._tool_table[:, loop.T_MASS]
        return Ledger(
            kinetic=float(
                self.clock[loop.C_INERTIA] * entry[energies.KINETIC]
                + 0.5 * (mass * tools[:, loop.P_VELOCITY] ** 2).sum()
            ),
            connectors=float(entry[energies.CONNECTORS]),
            membrane=float(entry[energies.MEMBRANE]),
            hourglass=float(entry[energies.HOURGLASS]),
            contact=float(entry[energies.CONTACT]),
            friction=float(entry[energies.FRICTION]),
            damping=float(entry[energies.DAMPED] + tools[:, loop.P_DAMPED].sum()),
            work=float(tools[:, loop.P_WORK].sum() + self.clock[loop.C_DRIVE_WORK]) + self._inertia_work,
        )


def _mirror_signs(grid: YarnGrid) -> tuple[float, float]:
    """Signs along x and y of the mirror images of half cells, the same on both planes of symmetry (1, 1 without)."""
    share, signs = grid.mirrors
    found = signs[share > 0.0]
    return (float(found[0, 0]), float(found[0, 1])) if len(found) else (1.0, 1.0)


def _law_arguments(law: PiecewiseLaw, slack_ratio: float) -> tuple[Floats, Floats, float, float, float]:
    initial = float(law.coefficients[law.degree - 1]) if law.degree else 0.0
    return law.coefficients, law.integrals, law.width, law.end_slope, slack_ratio * initial


def _largest(law: PiecewiseLaw, x: float) -> tuple[float, float]:
    """Largest value and largest slope of a packed law on 0..x, sampled."""
    found: tuple[float, float] = survey.largest_on(
        law.coefficients, law.degree, law.pieces, law.width, law.end_slope, max(x, 0.0)
    )
    return found


def _log_series() -> Floats:
    """Coefficients of ``ln(l) / y`` in powers of ``y^2``, ``y = (l^2 - 1)/(l^2 + 1)``, highest power first."""
    largest = (LOG_RANGE**2 - 1.0) / (LOG_RANGE**2 + 1.0)
    nodes = 0.5 * largest**2 * (1.0 - np.cos(np.pi * (np.arange(200) + 0.5) / 200))
    ratio = np.arctanh(np.sqrt(nodes)) / np.sqrt(nodes)
    fit = np.polynomial.Chebyshev.fit(nodes, ratio, LOG_TERMS - 1, domain=[0.0, largest**2])
    powers = fit.convert(kind=np.polynomial.Polynomial, domain=[-1, 1], window=[-1, 1]).coef
    return np.ascontiguousarray(powers[::-1])
