"""Fields on the cells and crossings, computed from positions: the laws are functions of the state, so nothing else
is needed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from weftform.blank import Cell, YarnGrid
from weftform.fabric import Fabric
from weftform.fabric.fabric import TensionLaw

Floats = NDArray[np.float64]

STRAIN, FORCE = 0, 1
"""Quantities of a line of connectors: nominal strain, and force per width [N/mm]."""


@dataclass(frozen=True)
class Fields:
    """Fields of a blank at one instant.

    Attributes
    ----------
    grid, fabric
        What the positions belong to.
    positions
        Positions of the crossings [mm], shape [rows, columns, 3].
    """

    grid: YarnGrid
    fabric: Fabric
    positions: Floats

    @cached_property
    def _warp_edges(self) -> Floats:
        return self.positions[:, 1:] - self.positions[:, :-1]

    @cached_property
    def _weft_edges(self) -> Floats:
        return self.positions[1:] - self.positions[:-1]

    @cached_property
    def vectors(self) -> tuple[Floats, Floats]:
        """Mean yarn vectors of the cells per initial length, shape [rows - 1, columns - 1, 3] each."""
        lower, left = (w[..., None] for w in self.grid.edge_weights)
        warp, weft = self._warp_edges, self._weft_edges
        g1 = (lower * warp[:-1] + (1.0 - lower) * warp[1:]) / self.grid.warp_pitch
        g2 = (left * weft[:, :-1] + (1.0 - left) * weft[:, 1:]) / self.grid.weft_pitch
        share, signs = self.grid.mirrors
        if share.any():
            q = share[..., None]
            g1, g2 = (1.0 - q) * g1 + q * signs * g2, (1.0 - q) * g2 + q * signs * g1
        return g1, g2

    @cached_property
    def shear_angle(self) -> Floats:
        """Shear angle of the cells [rad], shape [rows - 1, columns - 1], positive where warp and weft close; NaN
        where none.
        """
        return np.where(self.grid.cells != Cell.ABSENT, _angle(*self.vectors), np.nan)

    @cached_property
    def corner_shear(self) -> Floats:
        """Angle by which the connectors that meet at each corner of a cell have closed [rad], shape [4, rows - 1, columns - 1].

        As the paper measures it (Sec. 3.6). Corners in the order (0,0), (1,0), (1,1), (0,1); NaN where a
        connector is missing.
        """
        dots, products = self._corners
        angles = np.arctan2(dots, np.sqrt(np.maximum(products - dots * dots, 0.0)))
        return np.where(self.grid.corners_known, angles, np.nan)

    @cached_property
    def _corners(self) -> tuple[Floats, Floats]:
        """Of the connectors that meet at each corner: scalar product, and product of squared lengths, shape as above."""
        # planes of components, because NumPy runs through them several times faster than through triples
        place = np.ascontiguousarray(np.moveaxis(self.positions, -1, 0))
        warp, weft = place[:, :, 1:] - place[:, :, :-1], place[:, 1:] - place[:, :-1]
        lower, upper, left, right = warp[:, :-1], warp[:, 1:], weft[:, :, :-1], weft[:, :, 1:]
        along = np.stack([lower, lower, upper, upper])
        across = np.stack([left, right, right, left])
        cut = self.grid.cut_cells
        if cut[0].size:
            # the legs that a half cell on a plane of symmetry lacks are mirror images of those it has
            own_lower, own_left = (w[cut] for w in self.grid.edge_weights)
            image = self.grid.mirrors[1][cut].T
            i, j = cut
            leg_warp = own_lower * lower[:, i, j] + (1.0 - own_lower) * upper[:, i, j]
            leg_weft = own_left * left[:, i, j] + (1.0 - own_left) * right[:, i, j]
            along[:2, :, i, j] = np.where(own_lower == 0.0, image * leg_weft, lower[:, i, j])
            along[2:, :, i, j] = np.where(own_lower == 1.0, image * leg_weft, upper[:, i, j])
            across[::3, :, i, j] = np.where(own_left == 0.0, image * leg_warp, left[:, i, j])
            across[1:3, :, i, j] = np.where(own_left == 1.0, image * leg_warp, right[:, i, j])
        return _dot(along, across), _dot(along, along) * _dot(across, across)

    @cached_property
    def node_shear(self) -> Floats:
        """Mean of the angles at a crossing [rad], shape [rows, columns]; NaN outside the blank.

        At a tip where only one connector ends it is that of the cells.
        """
        met = self._mean_at_crossings(self.corner_shear)
        lonely = self.grid.active & np.isnan(met)
        if lonely.any():
            cells = self._mean_at_crossings(np.broadcast_to(self.shear_angle, (4, *self.grid.cells.shape)))
            met[lonely] = cells[lonely]
        return met

    def _mean_at_crossings(self, corners: Floats) -> Floats:
        """Mean over the corners of cells that meet at each crossing, of those that are known."""
        total = np.zeros(self.grid.shape)
        count = np.zeros(self.grid.shape)
        rows, columns = self.grid.cells.shape
        for values, (di, dj) in zip(corners, ((0, 0), (1, 0), (1, 1), (0, 1)), strict=True):
            known = np.isfinite(values)
            total[dj : dj + rows, di : di + columns] += np.where(known, values, 0.0)
            count[dj : dj + rows, di : di + columns] += known
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)

    def _line(self, warp: bool) -> tuple[Floats, Floats]:
        """Nominal strain and force per width [N/mm] of the connectors of one direction."""
        edges = self._warp_edges if warp else self._weft_edges
        pitch = self.grid.warp_pitch if warp else self.grid.weft_pitch
        spacing = self.grid.weft_pitch if warp else self.grid.warp_pitch
        law: TensionLaw = self.fabric.warp if warp else self.fabric.weft
        strain = np.linalg.norm(edges, axis=-1) / pitch - 1.0
        line = law.line_law(spacing)
        force = line.value(np.maximum(strain, 0.0)) + law.slack_ratio * line.slope(0.0) * np.minimum(strain, 0.0)
        return strain, force / spacing

    @cached_property
    def _lines(self) -> dict[bool, tuple[Floats, Floats]]:
        """Of warp (True) and weft."""
        return {warp: self._line(warp) for warp in (True, False)}

    def _on_cells(self, quantity: int, warp: bool) -> Floats:
        """Mean over the connectors of a cell; on a plane of symmetry the mirror images of the other direction's count too."""
        own = self._mean_of_edges(self._lines[warp][quantity], warp)
        share = self.grid.mirrors[0]
        if not share.any():
            return own
        return (1.0 - share) * own + share * self._mean_of_edges(self._lines[not warp][quantity], not warp)

    def _mean_of_edges(self, values: Floats, warp: bool) -> Floats:
        lower, left = self.grid.edge_weights
        if warp:
            return lower * values[:-1] + (1.0 - lower) * values[1:]
        return left * values[:, :-1] + (1.0 - left) * values[:, 1:]

    @cached_property
    def warp_strain(self) -> Floats:
        """Nominal strain of the warp yarns, mean of a cell's connectors, shape [rows - 1, columns - 1]."""
        return self._on_cells(STRAIN, True)

    @cached_property
    def weft_strain(self) -> Floats:
        """Nominal strain of the weft yarns."""
        return self._on_cells(STRAIN, False)

    @cached_property
    def warp_force(self) -> Floats:
        """Tension of the warp per width [N/mm], shape [rows - 1, columns - 1]."""
        return self._on_cells(FORCE, True)

    @cached_property
    def weft_force(self) -> Floats:
        """Tension of the weft per width [N/mm]."""
        return self._on_cells(FORCE, False)

    @cached_property
    def directions(self) -> tuple[Floats, Floats]:
        """Unit warp and weft directions of the cells, shape [rows - 1, columns - 1, 3] each."""
        g1, g2 = self.vectors
        return g1 / _norm(g1), g2 / _norm(g2)

    @cached_property
    def membrane_stress(self) -> Floats:
        """Cauchy stress (xx, yy, xy) of the membrane [MPa], shape [rows - 1, columns - 1, 3].

        Components in the plane of the cell, in axes that are x and y turned by the smallest rotation that brings
        z onto the cell's normal; on a flat cell they are x and y.
        """
        g1, g2 = self.vectors
        f1, f2 = self.directions
        normal = np.cross(f1, f2)
        normal = normal / _norm(normal)
        e_x, e_y = _plane_axes(normal)
        card = self.fabric.card.membrane
        s1 = card.warp_modulus_MPa * np.log(_norm(g1)[..., 0])
        s2 = card.weft_modulus_MPa * np.log(_norm(g2)[..., 0])
        tau = self.fabric.shear.shear_stress(_angle(g1, g2))
        x1, y1, x2, y2 = (np.einsum("...i,...i", f, e) for f in (f1, f2) for e in (e_x, e_y))
        # Eq. 24: sigma12 / 2 in each of the two yarn frames, (f1, f1 turned +90) and (f2 turned -90, f2)
        along_x = s1 * x1 * x1 + s2 * x2 * x2 + tau * (x2 * y2 - x1 * y1)
        along_y = s1 * y1 * y1 + s2 * y2 * y2 + tau * (x1 * y1 - x2 * y2)
        shear = s1 * x1 * y1 + s2 * x2 * y2 + 0.5 * tau * (x1 * x1 - y1 * y1 + y2 * y2 - x2 * x2)
        return np.stack([along_x, along_y, shear], axis=-1)

    def cell_data(self) -> dict[str, Floats]:
        """Fields of the cells by the names of the result files, one row per cell that exists."""
        here = self.grid.cells != Cell.ABSENT
        warp_direction, weft_direction = self.directions
        thickness = self.fabric.thickness
        return {
            "ShearAngle_deg": np.degrees(self.shear_angle)[here],
            "WarpStrain": self.warp_strain[here],
            "WeftStrain": self.weft_strain[here],
            "WarpForce_N_per_mm": self.warp_force[here],
            "WeftForce_N_per_mm": self.weft_force[here],
            "WarpStress_MPa": self.warp_force[here] / thickness,
            "WeftStress_MPa": self.weft_force[here] / thickness,
            "WarpDirection": warp_direction[here],
            "WeftDirection": weft_direction[here],
            "MembraneStress_MPa": self.membrane_stress[here],
        }

    def largest_shear(self) -> float:
        """Largest angle by which two connectors that meet have closed or opened [degrees]."""
        dots, products = self._corners
        # the sine squared grows with the size of the angle; one arc tangent is enough
        sines = self.grid.corners_known * (dots * dots / np.maximum(products, 1e-300))
        place = np.unravel_index(int(sines.argmax()), sines.shape)
        dot, product = abs(float(dots[place])), float(products[place])
        return math.degrees(math.atan2(dot, math.sqrt(max(product - dot * dot, 0.0))))

    def shear_statistics(self) -> dict[str, float]:
        """Sizes of the shear angle [degrees]: largest between connectors that meet, and over the cells by area."""
        share = self.grid.cell_share
        here = share > 0.0
        sizes = np.degrees(np.abs(self.shear_angle[here]))
        order = np.argsort(sizes)
        weight = np.cumsum(share[here][order])
        return {
            "max": self.largest_shear(),
            "max_cell": float(sizes.max()),
            "p99": float(np.interp(0.99 * weight[-1], weight, sizes[order])),
            "mean": float((share[here] * np.degrees(np.abs(self.shear_angle[here]))).sum() / share.sum()),
        }


def _norm(vectors: Floats) -> Floats:
    return np.asarray(np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))


def _dot(a: Floats, b: Floats) -> Floats:
    """Scalar products of planes of components, shape [4, 3, rows - 1, columns - 1]."""
    return np.asarray(np.einsum("pcij,pcij->pij", a, b))


def _angle(a: Floats, b: Floats) -> Floats:
    """Angle by which two vectors, at right angles at first, have closed [rad]."""
    aa, bb, ab = (np.einsum("...k,...k", p, q) for p, q in ((a, a), (b, b), (a, b)))
    return np.asarray(np.arctan2(ab, np.sqrt(np.maximum(aa * bb - ab * ab, 0.0))))


def _plane_axes(normal: Floats) -> tuple[Floats, Floats]:
    """x and y turned by the smallest rotation that takes z to the normal (Rodrigues)."""
    nx, ny, nz = normal[..., 0], normal[..., 1], normal[..., 2]
    denominator = np.where(1.0 + nz < 1e-9, 1.0, 1.0 + nz)
    e_x = np.stack([1.0 - nx * nx / denominator, -nx * ny / denominator, -nx], axis=-1)
    e_y = np.stack([-nx * ny / denominator, 1.0 - ny * ny / denominator, -ny], axis=-1)
    return e_x, e_y
