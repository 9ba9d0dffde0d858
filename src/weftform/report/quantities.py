"""Fields that can be shown on the whole part, by the names of the command line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from weftform.errors import ResultError
from weftform.report.whole import MOST_DRAWN, WholePart, whole_part
from weftform.result.fields import Fields

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Quantity:
    """A field of the cells.

    Attributes
    ----------
    name
        As on the command line.
    title
        What it is, for people.
    symbol, unit
        Of the colour bar.
    of
        The values of the cells, shape [rows - 1, columns - 1].
    across_bias
        The values of the image in one plane of symmetry where yarns lie at 45 degrees to it, since warp and weft change
        places there; the same values without.
    """

    name: str
    title: str
    symbol: str
    unit: str
    of: Callable[[Fields], Floats]
    across_bias: Callable[[Fields], Floats] | None = None

    @property
    def label(self) -> str:
        """Label of the colour bar."""
        words = f"{self.title}  {self.symbol}" if self.symbol else self.title
        return f"{words}  [{self.unit}]" if self.unit else words

    def on_whole_part(self, fields: Fields, positions: Floats | None = None, most: int = MOST_DRAWN) -> WholePart:
        """The field on the whole part.

        Parameters
        ----------
        positions
            Where to draw the crossings [mm], shape [rows, columns, 3]; where they are without.
        most
            See :func:`weftform.report.whole.patches`.
        """
        grid = fields.grid
        image = self.across_bias(fields) if self.across_bias is not None and grid.along_bias else None
        return whole_part(
            grid,
            fields.positions if positions is None else positions,
            self.of(fields),
            mirrored=image,
            most=most,
        )


def _shear(fields: Fields) -> Floats:
    # the size: where yarns run along a plane of symmetry the sign changes beyond it
    return np.asarray(np.degrees(np.abs(fields.shear_angle)))


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("shear", "Shear angle", "|γ|", "°", _shear),
        Quantity("warp-force", "Warp tension", "", "N/mm", lambda f: f.warp_force, lambda f: f.weft_force),
        Quantity("weft-force", "Weft tension", "", "N/mm", lambda f: f.weft_force, lambda f: f.warp_force),
        Quantity(
            "warp-strain", "Warp strain", "", "%", lambda f: 100.0 * f.warp_strain, lambda f: 100.0 * f.weft_strain
        ),
        Quantity(
            "weft-strain", "Weft strain", "", "%", lambda f: 100.0 * f.weft_strain, lambda f: 100.0 * f.warp_strain
        ),
    )
}
"""Known quantities by name."""


def quantity(name: str) -> Quantity:
    """A quantity by name.

    Raises
    ------
    ResultError
        There is none of that name.
    """
    if name not in QUANTITIES:
        raise ResultError(
            f'no field named "{name}"', key="--field", expected="one of " + ", ".join(QUANTITIES), got=name
        )
    return QUANTITIES[name]
