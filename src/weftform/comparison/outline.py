"""Outlines in plan view: closed curves as measured, with what can be wrong about them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from weftform.errors import MeasurementError
from weftform.laboratory.presets import Quantity
from weftform.laboratory.specimen import Reading
from weftform.laboratory.table import MeasuredTable, read_table

Floats = NDArray[np.float64]

OPEN_FROM = 3.0
"""An outline is open where the way from its last point to its first is so many times its longest step."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """Short straight pieces of a closed curve.

    Attributes
    ----------
    middles
        Their middles [mm], shape [pieces, 2].
    lengths
        [mm], shape [pieces].
    normals
        Unit normals out of the enclosed area, shape [pieces, 2].
    """

    middles: Floats
    lengths: Floats
    normals: Floats

    def mean(self, values: Floats) -> float:
        """Mean over the length of the curve of values at the middles, NaN left out; NaN where there is none."""
        known = np.isfinite(values)
        total = float(self.lengths[known].sum())
        return float((self.lengths * np.where(known, values, 0.0)).sum() / total) if total > 0.0 else float("nan")


@dataclass(frozen=True, eq=False)
class Ring:
    """A closed curve in plan view.

    Attributes
    ----------
    points
        In order around it [mm], shape [n, 2], the first not repeated.
    """

    points: Floats

    @cached_property
    def line(self) -> Any:
        """As a ring of shapely."""
        return shapely.LinearRing(self.points)

    @cached_property
    def polygon(self) -> Any:
        """The area inside; a curve that crosses itself encloses what it goes around."""
        polygon = shapely.Polygon(self.points)
        return polygon if polygon.is_valid else polygon.buffer(0.0)

    @cached_property
    def centre(self) -> Floats:
        """Centroid of the curve [mm], shape [2]; it does not depend on how the points lie along it."""
        return np.array(self.line.centroid.coords[0])

    @cached_property
    def size(self) -> float:
        """Radius of the circle of the same length [mm]."""
        return float(self.line.length / (2.0 * np.pi))

    @cached_property
    def segments(self) -> _Segments:
        return _Segments(self.points)

    def pieces(self, count: int) -> Pieces:
        """The segments divided evenly into pieces, none longer than a ``count``-th of the curve.

        No piece goes around a corner, so neither the first point nor the sense of the points changes them.
        """
        cut = shapely.get_coordinates(shapely.segmentize(self.line, self.line.length / count))
        along = np.diff(cut, axis=0)
        lengths = np.linalg.norm(along, axis=1)
        along, start, lengths = along[lengths > 0.0], cut[:-1][lengths > 0.0], lengths[lengths > 0.0]
        sense = 1.0 if self.line.is_ccw else -1.0
        normals = sense * np.stack([along[:, 1], -along[:, 0]], axis=1) / lengths[:, None]
        return Pieces(start + 0.5 * along, lengths, normals)

    def signed(self, points: Floats, distances: Floats) -> Floats:
        """Distances with the sign of the side: positive outside, shape [n]."""
        shapely.prepare(self.polygon)
        inside = shapely.contains_xy(self.polygon, points[:, 0], points[:, 1])
        return np.where(inside, -distances, distances)


class _Segments:
    """The segments of a ring, ready to be asked for the nearest one."""

    def __init__(self, points: Floats) -> None:
        self.starts = points
        self.along = np.roll(points, -1, axis=0) - points
        self._squares = np.maximum((self.along**2).sum(axis=1), 1e-300)
        self._tree = shapely.STRtree(shapely.linestrings(np.stack([points, points + self.along], axis=1)))

    def normals(self, counterclockwise: bool) -> Floats:
        """Unit normals out of the enclosed area, shape [n, 2]."""
        sense = 1.0 if counterclockwise else -1.0
        across = np.stack([self.along[:, 1], -self.along[:, 0]], axis=1)
        return np.asarray(sense * across / np.sqrt(self._squares)[:, None])

    def feet(self, points: Floats) -> tuple[Floats, Floats]:
        """Nearest points of the ring [mm] and unit normals of the segments they lie on, shapes [n, 2]."""
        nearest = self._tree.nearest(shapely.points(points))
        start, along = self.starts[nearest], self.along[nearest]
        share = np.clip(((points - start) * along).sum(axis=1) / self._squares[nearest], 0.0, 1.0)
        return start + share[:, None] * along, self.normals(True)[nearest]


@dataclass(frozen=True, eq=False)
class MeasuredOutline:
    """An outline as measured, in its own axes.

    Attributes
    ----------
    file, sha256
        Where it came from.
    ring
        The closed curve in plan view.
    warnings
        What was done to read it.
    """

    file: Path
    sha256: str
    ring: Ring
    warnings: tuple[str, ...]


def read_outline(file: Path | str, reading: Reading = Reading()) -> MeasuredOutline:  # noqa: B008 (frozen)
    """Read the outline of a formed part: its points in order around it, either way, from any of them on.

    Columns ``x_mm`` and ``y_mm`` (other units in the header); ``z_mm`` may be there, the outline is taken in plan view.

    Raises
    ------
    MeasurementError
        The table cannot be read, has fewer than three different points, or the outline is open or crosses itself.
    """
    table = read_table(
        file, [Quantity.X, Quantity.Y], preset=reading.preset, columns=reading.columns, units=reading.units
    )
    points = np.stack([table.values[Quantity.X], table.values[Quantity.Y]], axis=1)
    fresh = np.append(True, np.linalg.norm(np.diff(points, axis=0), axis=1) > 0.0) if len(points) else np.zeros(0, bool)
    points, lines = points[fresh], table.lines[fresh]
    closed = len(points) > 1 and bool((points[0] == points[-1]).all())
    if closed:
        points, lines = points[:-1], lines[:-1]
    if len(np.unique(points, axis=0)) < 3:
        raise MeasurementError(
            "too few points for an outline",
            file=table.file,
            line=int(lines[0]) if len(lines) else None,
            expected="three different points at least, in order around the part",
            got=f"{len(np.unique(points, axis=0))}",
        )
    if not closed:
        _refuse_open(table, points, lines)
    _refuse_crossing(table, points, lines)
    return MeasuredOutline(table.file, table.sha256, Ring(points), table.warnings)


def _refuse_open(table: MeasuredTable, points: Floats, lines: np.ndarray) -> None:
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    closing = float(np.linalg.norm(points[0] - points[-1]))
    if closing > OPEN_FROM * steps.max():
        raise MeasurementError(
            f"the outline is open: {closing:.4g} mm from its last point to its first",
            file=table.file,
            line=int(lines[-1]),
            expected=f"a closed curve; its longest step is {steps.max():.4g} mm",
            got=f"the first point at ({points[0, 0]:g}, {points[0, 1]:g}) mm, "
            f"the last at ({points[-1, 0]:g}, {points[-1, 1]:g}) mm",
            hint="measure the whole edge; where its last side is straight, end with the first point again",
        )


def _refuse_crossing(table: MeasuredTable, points: Floats, lines: np.ndarray) -> None:
    from shapely.validation import explain_validity

    polygon = shapely.Polygon(points)
    if polygon.is_valid and polygon.area > 0.0:
        return
    words = explain_validity(polygon)
    line, place = None, ""
    if "[" in words:
        x, y = (float(v) for v in words[words.index("[") + 1 : words.index("]")].split()[:2])
        line = int(lines[np.linalg.norm(points - (x, y), axis=1).argmin()])
        place = f" near ({x:.4g}, {y:.4g}) mm"
    raise MeasurementError(
        f"the outline crosses or touches itself{place}",
        file=table.file,
        line=line,
        expected="points in order around the part",
        got=words.split("[")[0] or f"an area of {polygon.area:g} mm2",
        hint="are the points in order, and of one part?",
    )
