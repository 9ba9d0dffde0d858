"""The blank: a window on a structured grid of yarn crossings, with half cells along the bias and planes of symmetry."""

from weftform.blank.building import build_grid
from weftform.blank.grid import Cell, YarnGrid
from weftform.blank.outline import disc, polygon, rectangle

__all__ = ["Cell", "YarnGrid", "build_grid", "disc", "polygon", "rectangle"]
