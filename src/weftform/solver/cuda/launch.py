"""What is fixed before a launch: numbers compiled into the kernels, tiles, and the schedule of a batch of steps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from weftform.solver import layout as at
from weftform.solver.layout import Layout
from weftform.solver.material import Material

MOVING = at.FIRST_OPTIONAL
"""Fields that a step changes for every crossing: position and velocity, kept twice."""
SHARED_BYTES = 48 * 1024
"""Shared memory that a block may have on every GPU without asking."""
SLOTS = 10
"""Numbers that an element leaves in shared memory: forces on three of its corners, and the heat of its dashpots."""

# columns of the schedule: what changes from step to step and is known before, one row per step of a batch
S_STEP = 0
S_LAST_STEP = 1
S_KICK = 2
S_KEEP = 3
S_DAMPING = 4
S_VISCOSITY = 5
S_SHARE = 6
"""1 / (step x keep): velocity before the kick per way that driven crossings have to make; 0 behind the last step."""
S_TOOLS = 7
"""One column per tool: the force that pushes it now or where it will be, then one per mode of driven crossings."""


COMPILE_ONLY = -1
"""Step that is none: the kernel does nothing."""


def kept_fields(layout: Layout) -> int:
    """Fields that a step does not move: the ledger's memory, and the force where crossings are driven."""
    return at.MEMORY + layout.fields - MOVING


@dataclass(frozen=True, eq=False)
class Constants:
    """Numbers compiled into the kernels: laws and sizes.

    A law is (coefficients, degree, pieces, width, end slope, slack slope); the coefficients of a polynomial are a
    tuple, those of many pieces an array. ``membrane`` is for mean edge vectors: (1 / warp pitch, 1 / weft pitch,
    E warp, E weft, hourglass, mirror signs x, y).
    """

    warp_law: tuple[Any, ...]
    weft_law: tuple[Any, ...]
    shear_law: tuple[Any, ...]
    series: tuple[float, ...]
    membrane: tuple[float, ...]
    columns: int
    rows: int
    modes: int

    @staticmethod
    def of(material: Material, layout: Layout, rows: int, columns: int, modes: int) -> Constants:
        """Of a material on a grid, with so many modes of driven crossings."""
        warp, weft, shear = (
            (law, *material.shapes[2 * k : 2 * k + 2], *material.ends[k].tolist())
            for k, law in enumerate(material.loop_laws)
        )
        return Constants(
            warp_law=warp,
            weft_law=weft,
            shear_law=shear,
            series=tuple(material.series.tolist()),
            membrane=(material.warp_inverse, material.weft_inverse, *material.membrane[3:].tolist()),
            columns=columns,
            rows=rows,
            modes=modes,
        )

    @cached_property
    def _key(self) -> tuple[Any, ...]:
        laws = (self.warp_law, self.weft_law, self.shear_law)
        numbers = (self.series, self.membrane, self.columns, self.rows, self.modes)
        return *((np.asarray(law[0]).tobytes(), *law[1:]) for law in laws), *numbers

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Constants) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@dataclass(frozen=True)
class Tile:
    """Elements of a block, and the threads that work on them."""

    columns: int
    rows: int
    threads: int

    def grid(self, rows: int, columns: int) -> tuple[int, int]:
        """Blocks along both directions; each owns one column and one row of crossings less than it has elements."""
        return -(-columns // (self.columns - 1)), -(-rows // (self.rows - 1))

    def shared_bytes(self, sums: int) -> int:
        """Shared memory of a block that sums so many forces."""
        return 8 * (SLOTS * self.columns * self.rows + sums * self.threads + 1)


def tile_for(sums: int) -> Tile:
    """The tile of a GPU: a warp wide, so that reads of a row are whole lines, as high as shared memory allows."""
    for rows in (16, 12, 8, 4):
        tile = Tile(32, rows, 128)
        if tile.shared_bytes(sums) <= SHARED_BYTES:
            return tile
    return Tile(32, 2, 32)
