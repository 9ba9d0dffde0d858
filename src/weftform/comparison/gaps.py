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
    starts, along = simulated.segments.starts[facing], simulated.segments.along[facing]
    asked = np.flatnonzero(np.abs(pieces.normals[:, axis]) >= FACING)
    if not (facing.any() and asked.size):
        return gaps
    here = pieces.middles[asked]
    rays = np.repeat(here[:, None, :], 2, axis=1)
    rays[:, 0, axis], rays[:, 1, axis] = starts[:, axis].min() - 1e9, starts[:, axis].max() + 1e9
    tree = shapely.STRtree(shapely.linestrings(np.stack([starts, starts + along], axis=1)))
    ray, segment = tree.query(shapely.linestrings(rays))
    side = np.sign(pieces.normals[asked[ray], axis])
    same = outward[facing][segment] * side > 0.0
    ray, segment, side = ray[same], segment[same], side[same]
    # a segment that faces the axis runs across the ray, so it is met where their boxes meet
    share = (here[ray, other] - starts[segment, other]) / along[segment, other]
    way = side * (here[ray, axis] - starts[segment, axis] - share * along[segment, axis])
    order = np.argsort(-np.abs(way), kind="stable")  # the nearest is written last
    gaps[asked[ray[order]]] = way[order]
    return gaps
