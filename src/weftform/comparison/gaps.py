"""The gap between two outlines: along X, along Y, along the normal, and the Hausdorff distance (Sec. 5, Figs. 15, 16)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from weftform.comparison.outline import Pieces, Ring

Floats = NDArray[np.float64]

PIECES = 2000
"""Pieces of the measured outline at which the gap is taken."""
FACING = float(np.sqrt(0.5)) - 1e-9
"""The gap along an axis is taken where the normals of both outlines are within 45 degrees of it: an edge that runs along
the axis has none."""


@dataclass(frozen=True, eq=False)
class OutlineGap:
    """How far a measured outline lies from the simulated one; all positive where the measured one is outside.

    Attributes
    ----------
    measured, simulated
        In the axes of the press.
    pieces
        Of the measured outline, at whose middles the gaps are taken.
    normal
        Shortest distance to the simulated outline, which is along its normal [mm], shape [pieces].
    along_x, along_y
        Distance along the axis [mm], shape [pieces]; NaN where the outlines do not both face it.
    hausdorff
        Largest distance from any point of either outline to the other [mm].
    """

    measured: Ring
    simulated: Ring
    pieces: Pieces
    normal: Floats
    along_x: Floats
    along_y: Floats
    hausdorff: float

    def statistics(self, gaps: Floats) -> dict[str, Any]:
        """Largest and mean size and mean with its sign [mm], and where the largest is; empty where there is no gap."""
        if not np.isfinite(gaps).any():
            return {"max": None, "mean": None, "signed_mean": None, "at_mm": None}
        worst = int(np.nanargmax(np.abs(gaps)))
        return {
            "max": float(abs(gaps[worst])),
            "mean": self.pieces.mean(np.abs(gaps)),
            "signed_mean": self.pieces.mean(gaps),
            "at_mm": [float(v) for v in self.pieces.middles[worst]],
        }

    def as_dict(self) -> dict[str, Any]:
        """For ``comparison.json``."""
        return {
            "gap_mm": {
                "normal": self.statistics(self.normal),
                "x": self.statistics(self.along_x),
                "y": self.statistics(self.along_y),
            },
            "hausdorff_mm": self.hausdorff,
            "length_mm": {"measured": self.measured.line.length, "simulated": self.simulated.line.length},
            "area_mm2": {"measured": self.measured.polygon.area, "simulated": self.simulated.polygon.area},
        }


def outline_gap(measured: Ring, simulated: Ring) -> OutlineGap:
    """Gap between two outlines in the same axes."""
    pieces = measured.pieces(PIECES)
    feet, _ = simulated.segments.feet(pieces.middles)
    normal = simulated.signed(pieces.middles, np.linalg.norm(pieces.middles - feet, axis=1))
    return OutlineGap(
        measured,
        simulated,
        pieces,
        normal,
        _along(0, pieces, simulated),
        _along(1, pieces, simulated),
        max(_farthest(measured, simulated), _farthest(simulated, measured)),
    )


def _farthest(one: Ring, other: Ring) -> float:
    """Largest distance from a curve to another [mm], from points as near to each other as the gaps are taken."""
    points = shapely.get_coordinates(shapely.segmentize(one.line, one.line.length / PIECES))
    return float(np.linalg.norm(points - other.segments.feet(points)[0], axis=1).max())


def _along(axis: int, pieces: Pieces, simulated: Ring) -> Floats:
    """Way along an axis from the nearest point of the simulated outline that faces the same side."""
    gaps = np.full(len(pieces.lengths), np.nan)
    other = 1 - axis
    outward = simulated.segments.normals(simulated.line.is_ccw)[:, axis]
    facing = np.abs(outward) >= FACING
    outward, starts, along = outward[facing], simulated.segments.starts[facing], simulated.segments.along[facing]
    for k in np.flatnonzero(np.abs(pieces.normals[:, axis]) >= FACING):
        here, side = pieces.middles[k], np.sign(pieces.normals[k, axis])
        before = starts[:, other] - here[other]
        after = before + along[:, other]
        met = np.flatnonzero((before * after <= 0.0) & (before != after) & (outward * side > 0.0))
        if met.size:
            share = before[met] / (before[met] - after[met])
            way = side * (here[axis] - starts[met, axis] - share * along[met, axis])
            gaps[k] = way[np.abs(way).argmin()]
    return gaps
