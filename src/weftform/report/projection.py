"""A camera and a lamp for pictures drawn with matplotlib alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """Perspective view of the origin from afar.

    Attributes
    ----------
    azimuth, elevation
        Direction towards the camera [degrees]: from the x axis about z, and above the plane of the blank.
    distance
        From the target to the camera [mm].
    target
        Point looked at [mm].
    """

    azimuth: float
    elevation: float
    distance: float
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def axes(self) -> tuple[Floats, Floats, Floats]:
        """Unit vectors to the right, up, and towards the camera."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        towards = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
        right = np.array([-math.sin(a), math.cos(a), 0.0])
        return right, np.cross(towards, right), towards

    def project(self, points: Floats) -> tuple[Floats, Floats]:
        """Place on the picture [mm at the target], shape [..., 2], and nearness to the camera [mm], shape [...]."""
        right, up, towards = self.axes
        from_target = points - np.array(self.target)
        near = from_target @ towards
        scale = self.distance / (self.distance - near)
        plane = np.stack([from_target @ right, from_target @ up], axis=-1)
        return plane * scale[..., None], near


def shade(colours: Floats, normals: Floats, camera: Camera) -> Floats:
    """Light faces from above the camera's left shoulder.

    Parameters
    ----------
    colours
        RGB in 0 to 1, shape [faces, 3].
    normals
        Unit normals, shape [faces, 3]; a face is lit on the side that is seen.

    Returns
    -------
    RGB, shape [faces, 3].
    """
    right, up, towards = camera.axes
    lamp = towards + 0.75 * up - 0.65 * right
    lamp = lamp / np.linalg.norm(lamp)
    half = (lamp + towards) / np.linalg.norm(lamp + towards)
    seen = normals * np.where(normals @ towards < 0.0, -1.0, 1.0)[:, None]
    diffuse = np.clip(seen @ lamp, 0.0, 1.0)
    gleam = np.clip(seen @ half, 0.0, 1.0) ** 16
    lit = colours * (0.52 + 0.56 * diffuse)[:, None]
    return np.asarray(np.clip(lit + 0.07 * gleam[:, None] * (1.0 - lit), 0.0, 1.0))
