"""Grids of laboratory specimens: their edges run along yarns or along the bias, and their centre is the centre of
the grid.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from shapely.geometry import Polygon

from weftform.blank import YarnGrid, build_grid
from weftform.blank.building import LARGEST_GRID
from weftform.errors import StudyError
from weftform.study.schema import BiasModel, ElementModel

if TYPE_CHECKING:
    from weftform.study.schema import StudyModel


def specimen_grid(model: StudyModel, outline: Polygon) -> YarnGrid:
    """The yarn grid of a laboratory specimen.

    Raises
    ------
    StudyError
        A bias specimen without a zone of pure shear, or one that its cells cannot meet.
    """
    if isinstance(model, ElementModel):
        side = model.element.side_mm
        return YarnGrid(np.ones((1, 1), np.int8), side, side, (0.5, 0.5), 0.0, (), side * side)
    if isinstance(model, BiasModel):
        return _bias_grid(model, outline)
    assert model.kind != "forming"
    return build_grid(outline, cell_length=model.specimen.cell_length_mm, warp_angle=0.0)


def _bias_grid(model: BiasModel, outline: Polygon) -> YarnGrid:
    specimen = model.specimen
    ratio = specimen.length_mm / specimen.width_mm
    if ratio < 2.0:
        raise StudyError(
            "the specimen has no zone of pure shear: yarns would run from clamp to clamp",
            key="specimen.length_mm",
            expected=f"a length of at least twice the width, {2 * specimen.width_mm:g} mm",
            got=f"{specimen.length_mm:g} mm (H/W = {ratio:.3g})",
        )
    if outline.area > 2.0 * LARGEST_GRID * specimen.cell_length_mm**2:
        raise StudyError("the specimen would have too many cells", key="specimen.cell_length_mm")
    across = max(2, round(specimen.width_mm / (math.sqrt(2.0) * specimen.cell_length_mm)))
    grid = build_grid(
        outline,
        cell_length=specimen.width_mm / (math.sqrt(2.0) * across),
        warp_angle=math.pi / 4,
    )
    if abs(grid.area / grid.requested_area - 1.0) > 1e-6:
        raise StudyError(
            "no square cells near that length meet all four edges of the specimen along their diagonals",
            key="specimen.cell_length_mm",
            expected="length and width with a common measure, such as 150 x 50 or 160 x 70 mm",
            got=f"{specimen.length_mm:g} x {specimen.width_mm:g} mm with cells of {specimen.cell_length_mm:g} mm",
            hint="choose a cell length of which sqrt(2) divides both length and width",
        )
    return grid
