"""A finished (or interrupted) run, read back from its folder."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weftform.blank import Cell, YarnGrid
from weftform.errors import ResultError
from weftform.fabric import Fabric
from weftform.result.fields import Fields
from weftform.result.locate import bilinear, cell_corners, material_below
from weftform.result.outline import formed_outline
from weftform.study import Study

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Probe:
    """Values at a material point."""

    yarn_mm: tuple[float, float]
    position_mm: list[float]
    shear_angle_deg: float
    warp_direction: list[float]
    weft_direction: list[float]
    warp_strain: float
    weft_strain: float
    warp_force_N_per_mm: float
    weft_force_N_per_mm: float

    def as_dict(self) -> dict[str, Any]:
        return dict(self.__dict__)


@dataclass(frozen=True)
class Result:
    """A result folder.

    Attributes
    ----------
    folder
        Where it lies.
    study
        The study as it was run.
    """

    folder: Path
    study: Study

    @classmethod
    def open(cls, folder: str | Path) -> Result:
        """Open a result folder.

        Raises
        ------
        ResultError
            The folder is no result of weftform, or a file of it is missing or broken.
        """
        folder = Path(folder)
        if not folder.is_dir():
            raise ResultError("no such folder", file=folder, expected="a folder written by `weftform run`")
        for name in ("study.toml", "fields.vtkhdf"):
            if not (folder / name).exists():
                raise ResultError(f"{name} is missing", file=folder, expected="a folder written by `weftform run`")
        return cls(folder, Study.load(folder / "study.toml"))

    @property
    def grid(self) -> YarnGrid:
        return self.study.grid

    @property
    def fabric(self) -> Fabric:
        return self.study.fabric

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The summary, see ``summary.json``."""
        try:
            found: dict[str, Any] = json.loads((self.folder / "summary.json").read_text())
        except (OSError, ValueError) as problem:
            raise ResultError(f"cannot be read ({problem})", file=self.folder / "summary.json") from None
        return found

    @cached_property
    def history(self) -> dict[str, Floats]:
        """Columns of ``history.csv`` by name."""
        path = self.folder / "history.csv"
        try:
            with path.open(newline="") as file:
                rows = [row for row in csv.reader(file) if row]
            return {name: np.array([float(r[k]) for r in rows[1:]]) for k, name in enumerate(rows[0])}
        except (OSError, ValueError, IndexError) as problem:
            raise ResultError(f"cannot be read ({problem})", file=path) from None

    @cached_property
    def _series(self) -> tuple[Floats, Floats, Floats, Floats]:
        import h5py

        path = self.folder / "fields.vtkhdf"
        try:
            with h5py.File(path) as file:
                root = file["VTKHDF"]
                count = int(root["NumberOfPoints"][0])
                steps = int(root["Steps"].attrs["NSteps"])
                if steps == 0:
                    raise ResultError("holds no instant", file=path)
                points = root["Points"][: steps * count].reshape(steps, count, 3)
                contact = root["PointData/ContactForce_N"][: steps * count].reshape(steps, count, 3)
                return root["Steps/Values"][:steps], points, contact, file["displacement_mm"][:steps]
        except (OSError, KeyError, ValueError) as problem:
            raise ResultError(f"cannot be read ({problem})", file=path) from None

    @property
    def times(self) -> Floats:
        """Instants with fields [s]."""
        return self._series[0]

    @property
    def strokes(self) -> Floats:
        """Stroke (or displacement of the clamp) at each of those instants [mm]."""
        return self._series[3]

    def frame_at(self, stroke: float | None = None) -> int:
        """Index of the instant nearest to a stroke [mm]; the last one without."""
        if stroke is None:
            return len(self.times) - 1
        if not self.strokes.min() - 1e-6 <= stroke <= self.strokes.max() * (1 + 1e-9) + 1e-6:
            raise ResultError(
                "that stroke was not computed",
                key="stroke",
                expected=f"{self.strokes.min():g} to {self.strokes.max():g} mm",
                got=f"{stroke:g} mm",
            )
        return int(np.abs(self.strokes - stroke).argmin())

    def _on_grid(self, values: Floats) -> Floats:
        full = np.array(self.grid.flat)
        full[self.grid.active] = values
        return full

    def fields(self, frame: int = -1) -> Fields:
        """Fields at an instant."""
        return Fields(self.grid, self.fabric, self._on_grid(self._series[1][frame]))

    def contact_force(self, frame: int = -1) -> Floats:
        """Contact force on the crossings [N], shape [rows, columns, 3]."""
        full = np.zeros((*self.grid.shape, 3))
        full[self.grid.active] = self._series[2][frame]
        return full

    def outline(self, frame: int = -1) -> tuple[Floats, Floats]:
        """Flat (x, y) and formed (x, y, z) edge of the whole blank [mm], shapes [points, 2] and [points, 3]."""
        flat, formed, _ = formed_outline(self.grid, self.fields(frame).positions)
        return flat, formed

    def probe(self, points: list[tuple[float, float]], stroke: float | None = None) -> list[Probe]:
        """Values at material points.

        Parameters
        ----------
        points
            (U along warp, V along weft) from the centre of the blank [mm]; points of the whole blank, mirrored
            where the model is a part of it.
        stroke
            At the computed instant nearest to this stroke [mm]; the end without.

        Raises
        ------
        ResultError
            A point is outside the blank.
        """
        fields = self.fields(self.frame_at(stroke))
        return [_probe_one(fields, u, v) for u, v in points]

    def covers(self, u: float, v: float) -> bool:
        """Whether (U along warp, V along weft) [mm] is a material point of the whole blank."""
        folded, _ = self.grid.fold(np.array([u, v]))
        return _inside(self.grid, *_places(self.grid, folded))

    def material_below(self, x: float, y: float, stroke: float | None = None) -> tuple[float, float] | None:
        """Material point (U, V) [mm] of the whole blank that lies at (x, y) [mm] in plan view; None where there is none.

        The uppermost one where the part lies over itself.
        """
        return material_below(self.fields(self.frame_at(stroke)), x, y)


def _probe_one(fields: Fields, u: float, v: float) -> Probe:
    grid = fields.grid
    folded, mirrored = grid.fold(np.array([u, v]))
    i, j = _places(grid, folded)
    if not _inside(grid, i, j):
        raise ResultError(
            "that point is outside the blank",
            key=f"--yarn {u:g},{v:g}",
            expected="a point (U along warp, V along weft) of the blank, from its centre [mm]",
        )
    even = np.array([1.0, 1.0, 1.0])
    position = _bilinear_nodes(fields, i, j) * np.where([*mirrored, False], -even, even)
    warp_direction, weft_direction = fields.directions
    values = {
        "shear": fields.shear_angle,
        "warp_strain": fields.warp_strain,
        "weft_strain": fields.weft_strain,
        "warp_force": fields.warp_force,
        "weft_force": fields.weft_force,
        **{f"warp_{k}": warp_direction[..., k] for k in range(3)},
        **{f"weft_{k}": weft_direction[..., k] for k in range(3)},
    }
    found = _interpolate_cells(grid, values, u, v)
    warp = np.array([found[f"warp_{k}"] for k in range(3)])
    weft = np.array([found[f"weft_{k}"] for k in range(3)])
    return Probe(
        yarn_mm=(u, v),
        position_mm=[float(p) for p in position],
        shear_angle_deg=float(np.degrees(found["shear"])),
        warp_direction=[float(w) for w in warp / np.linalg.norm(warp)],
        weft_direction=[float(w) for w in weft / np.linalg.norm(weft)],
        warp_strain=found["warp_strain"],
        weft_strain=found["weft_strain"],
        warp_force_N_per_mm=found["warp_force"],
        weft_force_N_per_mm=found["weft_force"],
    )


def _places(grid: YarnGrid, folded: Floats) -> tuple[float, float]:
    """Grid coordinates of a material point of the modelled part."""
    i, j = folded / (grid.warp_pitch, grid.weft_pitch) + grid.centre
    return float(i), float(j)


def _inside(grid: YarnGrid, i: float, j: float) -> bool:
    rows, columns = grid.cells.shape
    tolerance = 1e-6
    for a in {int(np.floor(i - tolerance)), int(np.floor(i + tolerance))}:
        for b in {int(np.floor(j - tolerance)), int(np.floor(j + tolerance))}:
            if not (0 <= a < columns and 0 <= b < rows):
                continue
            kind, p, q = Cell(grid.cells[b, a]), i - a, j - b
            covers = {
                Cell.ABSENT: False,
                Cell.WHOLE: True,
                Cell.LACKS_00: p + q >= 1.0 - tolerance,
                Cell.LACKS_11: p + q <= 1.0 + tolerance,
                Cell.LACKS_10: q >= p - tolerance,
                Cell.LACKS_01: q <= p + tolerance,
            }[kind]
            if covers:
                return True
    return False


def _bilinear_nodes(fields: Fields, i: float, j: float) -> Floats:
    """Position at grid coordinates: bilinear in whole cells, linear in half cells."""
    grid = fields.grid
    rows, columns = grid.cells.shape
    a = int(np.clip(np.floor(i), 0, columns - 1))
    b = int(np.clip(np.floor(j), 0, rows - 1))
    # a point on a line of the grid may belong to the cell before it
    if grid.cells[b, a] == Cell.ABSENT and a > 0 and i - a < 1e-6:
        a -= 1
    if grid.cells[b, a] == Cell.ABSENT and b > 0 and j - b < 1e-6:
        b -= 1
    return bilinear(cell_corners(fields, a, b), i - a, j - b)


def _interpolate_cells(grid: YarnGrid, values: dict[str, Floats], u: float, v: float) -> dict[str, float]:
    """Bilinear interpolation between the centres of the four cells around a material point of the whole blank.

    Cells beyond a plane of symmetry are mirror images: directions are mirrored with them, and where yarns run
    along the planes the shear angle changes sign, while at 45 degrees warp and weft change places.
    """
    p = u / grid.warp_pitch + grid.centre[0] - 0.5
    q = v / grid.weft_pitch + grid.centre[1] - 0.5
    a, b = int(np.floor(p)), int(np.floor(q))
    total = dict.fromkeys(values, 0.0)
    weights = 0.0
    for da in (0, 1):
        for db in (0, 1):
            weight = (1.0 - abs(p - a - da)) * (1.0 - abs(q - b - db))
            cell = _cell_values(grid, values, a + da, b + db)
            if weight > 0.0 and cell is not None:
                weights += weight
                for name, value in cell.items():
                    total[name] += weight * value
    if weights == 0.0:
        # the point is nearest to the edge of the blank: take the cell that holds it
        cell = _cell_values(grid, values, round(p), round(q))
        if cell is None:
            raise ResultError("that point is outside the blank", key=f"--yarn {u:g},{v:g}")
        return cell
    return {name: value / weights for name, value in total.items()}


def _cell_values(grid: YarnGrid, values: dict[str, Floats], a: int, b: int) -> dict[str, float] | None:
    """Values of the cell (a, b) of the whole blank, mirrored into the modelled part where it lies beyond a plane
    of symmetry.
    """
    centre = np.array([a + 0.5 - grid.centre[0], b + 0.5 - grid.centre[1]])
    folded, mirrored = grid.fold(centre * np.array([grid.warp_pitch, grid.weft_pitch]))
    column = int(np.floor(folded[0] / grid.warp_pitch + grid.centre[0] + 1e-9))
    row = int(np.floor(folded[1] / grid.weft_pitch + grid.centre[1] + 1e-9))
    rows, columns = grid.cells.shape
    if not (0 <= row < rows and 0 <= column < columns) or grid.cells[row, column] == Cell.ABSENT:
        return None
    cell = {name: float(array[row, column]) for name, array in values.items()}
    flips = int(mirrored.sum())
    if grid.along_bias and flips % 2:
        for name in list(cell):
            if name.startswith("warp_"):
                other = "weft_" + name.removeprefix("warp_")
                cell[name], cell[other] = cell[other], cell[name]
    elif not grid.along_bias and flips % 2:
        cell["shear"] = -cell["shear"]
    for axis in np.flatnonzero(mirrored):
        for yarn in ("warp", "weft"):
            cell[f"{yarn}_{axis}"] = -cell[f"{yarn}_{axis}"]
    _point_along_yarns(grid, cell)
    return cell


def _point_along_yarns(grid: YarnGrid, cell: dict[str, float]) -> None:
    """Give mirrored yarn directions the sense they have on the flat blank."""
    c, s = grid.axes
    for yarn, (x, y) in (("warp", (c, s)), ("weft", (-s, c))):
        if cell[f"{yarn}_0"] * x + cell[f"{yarn}_1"] * y < 0.0:
            for k in range(3):
                cell[f"{yarn}_{k}"] = -cell[f"{yarn}_{k}"]
