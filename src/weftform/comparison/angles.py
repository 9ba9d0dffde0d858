"""Shear angles measured at points of the formed part, beside those of the simulation (Sec. 5, Fig. 16c)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from weftform.comparison.placement import Placement
from weftform.errors import MeasurementError
from weftform.laboratory.presets import FORMED, Quantity
from weftform.laboratory.specimen import Reading
from weftform.laboratory.table import MeasuredTable, read_table

if TYPE_CHECKING:
    from weftform.result import Result

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class AngleAtPoint:
    """Shear angle at one point [deg].

    Attributes
    ----------
    name
        As in the file.
    yarn_mm
        Material point (U along warp, V along weft).
    position_mm
        Its place on the simulated part.
    measured, simulated
        Sizes of the angles, unless signs were asked for.
    scatter
        Of the measurement; NaN where none is given.
    """

    name: str
    yarn_mm: tuple[float, float]
    position_mm: tuple[float, float, float]
    measured: float
    simulated: float
    scatter: float

    @property
    def difference(self) -> float:
        """Simulated less measured [deg]."""
        return self.simulated - self.measured

    def as_dict(self) -> dict[str, Any]:
        """For ``comparison.json``."""
        return {
            "name": self.name,
            "yarn_mm": list(self.yarn_mm),
            "position_mm": list(self.position_mm),
            "measured_deg": self.measured,
            "simulated_deg": self.simulated,
            "difference_deg": self.difference,
            "scatter_deg": self.scatter if np.isfinite(self.scatter) else None,
        }


@dataclass(frozen=True)
class AngleComparison:
    """Shear angles at all points.

    Attributes
    ----------
    file, sha256
        Where the measured ones came from.
    points
        In the order of the file.
    signed
        Whether signs count.
    warnings
        What was done to read it.
    """

    file: Path
    sha256: str
    points: tuple[AngleAtPoint, ...]
    signed: bool
    warnings: tuple[str, ...]

    @property
    def differences(self) -> Floats:
        """Simulated less measured [deg], shape [points]."""
        return np.array([p.difference for p in self.points])

    def as_dict(self) -> dict[str, Any]:
        """For ``comparison.json``."""
        sizes = np.abs(self.differences)
        return {
            "file": str(self.file),
            "sha256": self.sha256,
            "signed": self.signed,
            "points": [p.as_dict() for p in self.points],
            "difference_deg": {
                "max": float(sizes.max()),
                "mean": float(sizes.mean()),
                "signed_mean": float(self.differences.mean()),
                "at": self.points[int(sizes.argmax())].name,
            },
        }


def compare_angles(
    result: Result,
    file: Path | str,
    placement: Placement,
    *,
    stroke: float | None = None,
    signed: bool = False,
    reading: Reading = Reading(),  # noqa: B008 (frozen)
) -> AngleComparison:
    """Set measured shear angles beside those that ``probe`` gives at the same material points.

    Parameters
    ----------
    file
        Columns ``name``, ``angle_deg``, and either ``u_mm`` and ``v_mm`` (material point from the centre of the blank)
        or ``x_mm`` and ``y_mm`` (place on the formed part in plan view); ``scatter_deg`` may be there.
    placement
        Of the places x and y.
    stroke
        See :meth:`Result.probe`.
    signed
        Compare with signs, positive where warp and weft close; without, sizes are compared, because what a camera sees
        has the sign of the corner that was looked at.

    Raises
    ------
    MeasurementError
        The table cannot be read, says no place, names a point twice, or a point is outside the blank.
    """
    table = read_table(
        file,
        [Quantity.MARKER, Quantity.SHEAR_ANGLE],
        optional=[Quantity.U, Quantity.V, Quantity.X, Quantity.Y, Quantity.SCATTER],
        may_miss=[Quantity.SCATTER],
        preset=FORMED,
        columns=reading.columns,
        units=reading.units,
    )
    names = table.names[Quantity.MARKER]
    refuse_repeated(table, names)
    if not names:
        raise MeasurementError("no point with an angle", file=table.file, expected="one row per point")
    yarns = _material_points(result, table, placement, stroke)
    probes = result.probe(yarns, stroke)
    scatter = table.values.get(Quantity.SCATTER, np.full(len(names), np.nan))
    points = []
    for name, yarn, probe, angle, spread in zip(
        names, yarns, probes, table.values[Quantity.SHEAR_ANGLE], scatter, strict=True
    ):
        pair = (float(angle), probe.shear_angle_deg)
        measured, simulated = pair if signed else (abs(pair[0]), abs(pair[1]))
        x, y, z = probe.position_mm
        points.append(AngleAtPoint(name, yarn, (x, y, z), measured, simulated, float(spread)))
    return AngleComparison(table.file, table.sha256, tuple(points), signed, table.warnings)


def refuse_repeated(table: MeasuredTable, names: tuple[str, ...]) -> None:
    """Refuse a table that names a point twice."""
    seen: dict[str, int] = {}
    for name, line in zip(names, table.lines, strict=True):
        if name in seen:
            raise MeasurementError(
                f'"{name}" stands twice',
                file=table.file,
                line=int(line),
                expected="one row per point",
                got=f"the first in line {seen[name]}",
            )
        seen[name] = int(line)


def refuse_outside(result: Result, table: MeasuredTable, row: int, name: str, u: float, v: float) -> None:
    """Refuse a material point that the blank does not have."""
    if result.covers(u, v):
        return
    reach = np.abs(result.grid.material_at(result.outline(0)[0])).max(axis=0)
    raise MeasurementError(
        f'point "{name}" is outside the blank',
        file=table.file,
        line=int(table.lines[row]),
        expected=f"U along warp and V along weft from the centre; the blank reaches {reach[0]:.4g} and {reach[1]:.4g} mm",
        got=f"U = {u:g} mm, V = {v:g} mm",
    )


def _material_points(
    result: Result, table: MeasuredTable, placement: Placement, stroke: float | None
) -> list[tuple[float, float]]:
    names = table.names[Quantity.MARKER]
    if {Quantity.U, Quantity.V} <= table.values.keys():
        found = [(float(u), float(v)) for u, v in zip(table.values[Quantity.U], table.values[Quantity.V], strict=True)]
        for row, (u, v) in enumerate(found):
            refuse_outside(result, table, row, names[row], u, v)
        return found
    if not {Quantity.X, Quantity.Y} <= table.values.keys():
        raise MeasurementError(
            "where the points are is not said",
            file=table.file,
            expected="columns u_mm and v_mm (material point), or x_mm and y_mm (place on the formed part)",
            got=", ".join(table.headers.values()),
        )
    measured = np.stack([table.values[Quantity.X], table.values[Quantity.Y]], axis=1)
    placed = placement.apply(measured)
    found = []
    for row, (x, y) in enumerate(placed):
        material = result.material_below(float(x), float(y), stroke)
        if material is None:
            raise MeasurementError(
                f'point "{names[row]}" is outside the formed part',
                file=table.file,
                line=int(table.lines[row]),
                expected="a place on the part in plan view",
                got=f"({measured[row, 0]:g}, {measured[row, 1]:g}) mm as measured, ({x:.4g}, {y:.4g}) mm in the press",
                hint=None if placement.by != "none" else "the places were taken as they are; --outline places them",
            )
        found.append(material)
    return found
