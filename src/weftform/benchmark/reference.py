"""The yardstick: the same physics in C, compiled for this machine and called in this process."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weftform.errors import WeftformError
from weftform.solver import Simulation, loop
from weftform.solver import layout as at
from weftform.solver.sheet import aligned, inertia_area
from weftform.solver.simulation import SURVEY_EVERY

Floats = NDArray[np.float64]

FLAGS = (
    "-O3",
    "-march=native",
    "-fopenmp-simd",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-ffinite-math-only",
    "-fno-signed-zeros",
    "-ffp-contract=fast",
    "-mprefer-vector-width=512",
)
TOOLS = 3


class ReferenceMissing(WeftformError):
    """The reference cannot be built here; the message says why."""


def source_file() -> Path:
    """The C source: beside this file in an installed package, under ``benchmarks`` in a checkout."""
    here = Path(__file__).resolve()
    for file in (here.with_name("sheet.c"), here.parents[3] / "benchmarks" / "reference" / "sheet.c"):
        if file.exists():
            return file
    raise ReferenceMissing("the C source of the reference is missing from this installation")


class _Sheet(ctypes.Structure):
    """As in ``sheet.c``."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("rows", "columns")),
        *(
            (name, ctypes.c_void_p)
            for name in (
                "state", "grip", "inverse_mass", "inertia", "area", "warp_line", "weft_line",
                "warp", "weft", "shear", "series",
            )
        ),
        ("warp_end", ctypes.c_double * 3),
        ("weft_end", ctypes.c_double * 3),
        ("shear_end", ctypes.c_double * 2),
        *(
            (name, ctypes.c_double)
            for name in (
                "warp_pitch", "weft_pitch", "warp_modulus", "weft_modulus", "hourglass", "volume",
                "density", "damping", "viscous",
            )
        ),
        *((name, ctypes.c_void_p) for name in ("tools", "poses", "touching", "times", "values", "knots")),
        ("most_knots", ctypes.c_int64),
        *((name, ctypes.c_double) for name in ("ramp", "end_ramp", "time", "step", "last_step", "inertia_factor", "damped")),
        ("slipped", ctypes.c_double * 3),
    )  # fmt: skip


class Reference:
    """The C program, started from the state of a simulation of a full square blank with whole polynomials as laws.

    Parameters
    ----------
    simulation
        Where to start; it is not changed.
    everywhere
        Evaluate contact everywhere, not only on the pieces of rows that can touch.
    flags
        Of the compiler.

    Raises
    ------
    ReferenceMissing
        No compiler, or a problem that the reference does not know.
    """

    def __init__(self, simulation: Simulation, everywhere: bool = False, flags: tuple[str, ...] = FLAGS) -> None:
        layout, grid = simulation.layout, simulation.problem.grid
        material, machine = simulation.material, simulation.machine
        warp, weft, shear = material.warp, material.weft, material.shear
        if layout.half_cells or layout.driven or layout.tools not in (0, TOOLS) or not grid.active.all():
            raise ReferenceMissing("the reference knows whole rectangular blanks with three tools or none")
        if warp.pieces * weft.pieces * shear.pieces != 1:
            raise ReferenceMissing("the reference knows laws of one polynomial")
        self.rows, self.columns = simulation.rows, simulation.columns
        self.cells = (self.rows - 1) * (self.columns - 1)
        self.stride = -(-(self.columns + 1) // 8) * 8 + 8
        if self.stride % 64 == 0:
            self.stride += 8
        self.tools = layout.tools
        self._margin = simulation.search_margin
        saved = simulation.checkpoint()
        self._library = _compile(
            flags,
            STRIDE=self.stride, TOOLS=self.tools, WARP_DEGREE=warp.degree, WEFT_DEGREE=weft.degree,
            SHEAR_DEGREE=shear.degree, SERIES=len(material.series), RESTRICT=int(not everywhere),
        )  # fmt: skip
        fields = saved["fields"]
        self.state = aligned((self.rows, 6, self.stride))
        self.grip = aligned((self.rows, self.tools, 3, self.stride))
        self.grip[..., : self.columns] = saved["grip"][..., : self.columns]
        # padding keeps the distances of the flat grid
        self.state[:, 0] = (np.arange(self.stride) * grid.warp_pitch)[None, :] + 1.0e4
        self.state[:, 1] = (np.arange(self.rows) * grid.weft_pitch)[:, None]
        self.state[:, 2] = 1.0e5
        self.state[:, :6, : self.columns] = fields[:, at.POSITION : at.POSITION + 6, : self.columns]
        clock = saved["clock"]
        density = simulation.density
        area = self._profile(grid.node_area)
        inertia = self._profile(inertia_area(grid))
        with np.errstate(divide="ignore"):
            inverse_mass = np.where(inertia > 0.0, 1.0 / (density * inertia), 0.0)
        column = np.arange(self.stride)
        fabric = simulation.problem.fabric
        settings = simulation.problem.settings
        ends = material.ends
        self._tool_table = saved["tools"].copy()
        self._poses = saved["poses"].copy()
        self._touching = np.zeros((self.rows, at.blocks_for(self.columns)), np.int8)
        self._kept: list[Any] = []
        self._found = np.zeros(8)
        self._sheet = _Sheet(
            rows=self.rows, columns=self.columns, state=self._address(self.state), grip=self._address(self.grip),
            inverse_mass=self._address(inverse_mass), inertia=self._address(inertia), area=self._address(area),
            warp_line=self._address((column < self.columns - 1).astype(float)),
            weft_line=self._address((column < self.columns).astype(float)),
            warp=self._address(warp.coefficients), weft=self._address(weft.coefficients),
            shear=self._address(shear.coefficients), series=self._address(material.series),
            warp_end=tuple(ends[0]), weft_end=tuple(ends[1]), shear_end=tuple(ends[2][:2]),
            warp_pitch=grid.warp_pitch, weft_pitch=grid.weft_pitch,
            warp_modulus=material.moduli[0], weft_modulus=material.moduli[1], hourglass=material.membrane[5],
            volume=grid.cell_area * fabric.thickness,
            density=density, damping=settings.damping, viscous=simulation.viscosity,
            tools=self._address(self._tool_table), poses=self._address(self._poses), touching=self._address(self._touching),
            times=self._address(machine.times), values=self._address(machine.values),
            knots=self._address(machine.knots), most_knots=machine.times.shape[1],
            ramp=machine.ramps[0], end_ramp=machine.ramps[1], time=clock[loop.C_TIME],
            step=clock[loop.C_STEP], last_step=clock[loop.C_LAST_STEP],
            inertia_factor=clock[loop.C_INERTIA],
        )  # fmt: skip
        self.survey()
        self._start = [(a, a.copy()) for a in (self.state, self.grip, self._tool_table, self._poses, self._touching)]
        self._start_time = self._sheet.time

    def restart(self) -> None:
        """Back to where it began."""
        for array, start in self._start:
            array[:] = start
        self._sheet.time = self._start_time

    def _profile(self, field: Floats) -> Floats:
        """First row and second row of a field that is the same on all rows but the first and last, padded."""
        out = np.zeros((2, self.stride))
        out[:, : self.columns] = field[:2]
        return out

    def _address(self, array: NDArray[Any]) -> int:
        assert array.flags.c_contiguous
        self._kept.append(array)
        return array.ctypes.data

    def survey(self) -> Floats:
        """Look at the whole state, and find the rows that each tool can touch."""
        self._library.survey(
            ctypes.byref(self._sheet), self._found.ctypes.data_as(ctypes.c_void_p), ctypes.c_int64(SURVEY_EVERY),
            ctypes.c_double(self._margin),
        )  # fmt: skip
        return self._found

    def advance(self, steps: int) -> None:
        """Make steps of the present length."""
        self._library.advance(ctypes.byref(self._sheet), ctypes.c_int64(steps))

    def advance_surveyed(self, steps: int) -> None:
        """Make steps with a survey after every :data:`SURVEY_EVERY`, as the package does."""
        while steps > 0:
            self.advance(min(steps, SURVEY_EVERY))
            self.survey()
            steps -= SURVEY_EVERY

    def follow(self, simulation: Simulation) -> None:
        """Take over the length of the step, the mass scaling, the dashpots and the margin of the contact search."""
        self._sheet.step = simulation.step
        self._sheet.viscous = simulation.viscosity
        self._margin = simulation.search_margin
        self._sheet.inertia_factor = simulation.clock[loop.C_INERTIA]

    @property
    def positions(self) -> Floats:
        """Positions of the crossings [mm], shape [rows, columns, 3]."""
        return self.state[:, :3, : self.columns].transpose(0, 2, 1)

    @property
    def damped(self) -> float:
        """Heat of damping since the start [mJ]."""
        return float(self._sheet.damped)

    @property
    def friction(self) -> float:
        """Heat of friction of all tools since the start [mJ]."""
        shares = (self._tool_table[k, [loop.T_STIFFNESS, loop.T_TANGENTIAL]].prod() for k in range(self.tools))
        return float(sum(slipped / share for slipped, share in zip(self._sheet.slipped, shares, strict=False)))

    @property
    def reactions(self) -> Floats:
        """Axial force of each tool [N]."""
        return self._poses[:, loop.P_REACTION]


def multiply_add() -> Callable[[Floats, int], None]:
    """Multiply-adds in C on 512 numbers, 16 on each per repeat.

    Raises
    ------
    ReferenceMissing
        No compiler.
    """
    library = _compile(FLAGS, STRIDE=16, TOOLS=0, WARP_DEGREE=1, WEFT_DEGREE=1, SHEAR_DEGREE=1, SERIES=2, RESTRICT=0)

    def work(values: Floats, repeats: int) -> None:
        library.multiply_add(values.ctypes.data_as(ctypes.c_void_p), ctypes.c_int64(repeats))

    return work


def _compile(flags: tuple[str, ...], **macros: int) -> ctypes.CDLL:
    compiler = shutil.which("gcc")
    if compiler is None:
        raise ReferenceMissing("no gcc on this machine", hint="Debian: apt-get install gcc")
    return _library((compiler, *flags, *(f"-D{name}={value}" for name, value in macros.items())))


@cache
def _library(command: tuple[str, ...]) -> ctypes.CDLL:
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "sheet.so"
        done = subprocess.run(
            [*command, "-shared", "-fPIC", "-o", str(library), str(source_file()), "-lm"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            raise ReferenceMissing(f"gcc failed: {done.stderr.strip()[-500:]}")
        return ctypes.CDLL(str(library))
