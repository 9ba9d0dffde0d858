"""Outlines of a blank in the plane of the press, as shapely polygons centred where the study says."""

from __future__ import annotations

import math

import numpy as np
from shapely.affinity import scale
from shapely.geometry import Point, Polygon, box

DISC_SEGMENTS = 720
"""Chords that stand for a circle; the area they miss (1.3e-5) is far below that of the cells."""


def rectangle(width: float, height: float) -> Polygon:
    """Rectangle ``width`` along x by ``height`` along y [mm], centred on the axis of the press."""
    return box(-0.5 * width, -0.5 * height, 0.5 * width, 0.5 * height)


def disc(diameter: float) -> Polygon:
    """Disc [mm], centred on the axis of the press."""
    return Point(0.0, 0.0).buffer(0.5 * diameter, quad_segs=DISC_SEGMENTS // 4)


def polygon(points: list[tuple[float, float]]) -> Polygon:
    """Polygon through points (x, y) [mm] in the plane of the press."""
    return Polygon(points)


def symmetric(outline: Polygon, plane: str) -> bool:
    """Whether an outline is its own image in the plane ``"x"`` (normal x, x = 0) or ``"y"``."""
    image = scale(outline, -1.0 if plane == "x" else 1.0, -1.0 if plane == "y" else 1.0, origin=(0.0, 0.0))
    return float(outline.symmetric_difference(image).area) <= 1.0e-9 * float(outline.area)


def kept_part(outline: Polygon, planes: tuple[str, ...]) -> Polygon:
    """The part of an outline on the positive side of the planes of symmetry."""
    x0, y0, x1, y1 = outline.bounds
    clip = box(0.0 if "x" in planes else x0 - 1.0, 0.0 if "y" in planes else y0 - 1.0, x1 + 1.0, y1 + 1.0)
    return outline.intersection(clip)


def fit_along_yarns(length: float, target: float, even: bool) -> tuple[int, float]:
    """Number of cells and cell length that divide ``length`` exactly, nearest to ``target`` [mm]."""
    step = 2 if even else 1
    count = max(step, step * round(length / (step * target)))
    return count, length / count


def fit_along_bias(width: float, height: float, target: float, even: bool) -> float:
    """Cell length [mm] near ``target`` for which both sides of a rectangle run along cell diagonals.

    A side of length ``L`` spans ``n`` diagonals of ``sqrt(2) l0``, and both counts must be whole. Where width and
    height have no such common measure within 15 % of the target, the length that misses the sides by least is
    returned.
    """
    step = 2 if even else 1
    best = (math.inf, math.inf, target)
    first = max(step, int(width / (math.sqrt(2.0) * 1.15 * target)))
    for across in range(first, int(width / (math.sqrt(2.0) * 0.85 * target)) + step + 1):
        if across % step:
            continue
        length = width / (math.sqrt(2.0) * across)
        along = height / (math.sqrt(2.0) * length)
        miss = abs(along - step * round(along / step)) / along
        if abs(length / target - 1.0) > 0.15 and best[0] < math.inf:
            continue
        candidate = (round(miss, 9), abs(length / target - 1.0), length)
        if candidate < best:
            best = candidate
    return best[2]


def diagonal_angle(outline: Polygon) -> float:
    """Polar angle [rad] of the corner of the outline's bounding box in the first quadrant."""
    _, _, x1, y1 = outline.bounds
    return math.atan2(y1, x1)


def bounds_along(outline: Polygon, angle: float) -> tuple[float, float, float, float]:
    """Bounds (u0, v0, u1, v1) [mm] of an outline in axes turned by ``angle`` [rad]."""
    points = np.asarray(outline.exterior.coords)
    c, s = math.cos(angle), math.sin(angle)
    u = points[:, 0] * c + points[:, 1] * s
    v = -points[:, 0] * s + points[:, 1] * c
    return float(u.min()), float(v.min()), float(u.max()), float(v.max())
