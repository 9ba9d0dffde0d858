"""Closed curves with known gaps."""

from __future__ import annotations

import numpy as np


def circle(radius, count=720):
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def square(half, per_side=1):
    corners = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    share = np.linspace(0.0, 1.0, per_side, endpoint=False)[:, None]
    return np.vstack([a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])


def lopsided(count=160):
    """A smooth curve without any symmetry."""
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    radius = 70.0 + 9.0 * np.cos(2 * turn) + 5.0 * np.cos(3 * turn + 0.7) + 2.0 * np.sin(turn)
    return radius[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def moved(points, degrees=0.0, shift=(0.0, 0.0), scale=1.0):
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    return scale * points @ turn.T + np.asarray(shift)
