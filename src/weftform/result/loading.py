"""The part of a force curve along which a machine loads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def loading_curve(displacement: Floats, force: Floats) -> tuple[Floats, Floats]:
    """Displacement and force up to the first largest displacement, one row for each displacement.

    A press may rest at first, while the holder closes: the last row of a displacement is its force. Rows in which the
    displacement falls back and those that are not finite are left out.

    Parameters
    ----------
    displacement, force
        Rows of a history [mm], [N], shape [n].

    Returns
    -------
    displacement, force
        Increasing displacements [mm] and the force at each [N]; the same shape, maybe shorter.
    """
    finite = np.isfinite(displacement) & np.isfinite(force)
    way, newtons = displacement[finite], force[finite]
    if not way.size:
        return way, newtons
    top = int(way.argmax()) + 1
    way, newtons = way[:top], newtons[:top]
    # from the end on, so that of several rows at one displacement the last is found
    further = np.maximum.accumulate(way)
    at_top = np.flatnonzero(way == further)
    _, last = np.unique(way[at_top][::-1], return_index=True)
    chosen = at_top[::-1][last]
    return way[chosen], newtons[chosen]
