"""The arrays of the blank that the time loop works on: state, traits, bands and scratch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from weftform.blank import YarnGrid
from weftform.solver import layout as at
from weftform.solver.layout import Layout
from weftform.solver.spans import row_spans

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

OUT_OF_THE_WAY = 1.0e5
"""Height of crossings that are not part of the blank [mm]."""
CACHE_LINE = 64
"""Bytes; arrays begin on a multiple, so that the widest vectors never straddle two."""
APART = 8
"""Bands begin at a multiple of so many local rows, so that what is kept per row shares no cache line between threads, and
so many rows are left free between them, so that what one thread fetches ahead is not what another is changing."""


def aligned(shape: tuple[int, ...]) -> Floats:
    """Zeros that begin on a cache line."""
    size = int(np.prod(shape))
    raw = np.zeros(size + CACHE_LINE // 8)
    skip = -raw.ctypes.data % CACHE_LINE // 8
    return raw[skip : skip + size].reshape(shape)


class Sheet:
    """State of a blank on its grid, in bands of rows.

    Each band holds its own rows and a copy of the row beside it at each end (halo).

    Parameters
    ----------
    grid
        The blank.
    layout
        Where the fields lie.
    edges
        Where bands of rows begin and end, shape [bands + 1] (:func:`weftform.solver.bands.share_rows`).
    volume
        Thickness [mm].
    density
        Mass per area, mass scaling included [tonne/mm2].

    Attributes
    ----------
    state
        shape [local rows, fields, stride].
    memory
        Of the ledger, shape [local rows, layout.MEMORY, stride].
    traits, trait_rows
        Rows of traits, shape [distinct rows, trait fields, stride], and which of them a local row has.
    row_index
        Local row of each row of the grid.
    bounds
        First and last local row of each band, shape [bands, 2].
    halo_to, halo_from
        Local rows that are copies, and of which.
    spans
        Of each local row (:func:`weftform.solver.spans.row_spans`).
    edge, node, between
        Scratch of each band.
    """

    def __init__(self, grid: YarnGrid, layout: Layout, edges: Ints, volume: float, density: float) -> None:
        self.grid, self.layout, self.bands = grid, layout, len(edges) - 1
        self.rows, self.columns = grid.shape
        self._lay_out_bands(edges)
        self.state = aligned((self.local_rows, layout.fields, layout.stride))
        self.memory = aligned((self.local_rows, at.MEMORY, layout.stride))
        self._place_crossings()
        self._traits = self._describe(volume, density)
        self._share_traits()
        self.spans: Ints = self._spread(row_spans(grid.active))
        self.edge = aligned((self.bands, layout.edge_scratch))
        self.node = aligned((self.bands, layout.node_scratch))
        self.between = aligned((self.bands, at.BETWEEN * at.PIECE))

    def _lay_out_bands(self, edges: Ints) -> None:
        bands = self.bands
        self.row_index = np.zeros(self.rows, np.int64)
        self.bounds = np.zeros((bands, 2), np.int64)
        local = 0
        halos = []
        for band in range(bands):
            first = edges[band] - (1 if band > 0 else 0)
            last = edges[band + 1] - 1 + (1 if band < bands - 1 else 0)
            local = -(-local // APART) * APART + (APART if band else 0)
            self.bounds[band] = local, local + last - first
            for row in range(first, last + 1):
                if edges[band] <= row < edges[band + 1]:
                    self.row_index[row] = local
                else:
                    halos.append((local, row))
                local += 1
        self.local_rows = local
        self.halo_to: Ints = np.array([to for to, _ in halos], np.int64)
        self.halo_row: Ints = np.array([row for _, row in halos], np.int64)
        self.halo_from: Ints = self.row_index[self.halo_row] if halos else np.zeros(0, np.int64)

    def _spread(self, values: Ints) -> Ints:
        """From rows of the grid to local rows."""
        out = np.zeros((self.local_rows, *values.shape[1:]), values.dtype)
        out[self.row_index] = values
        out[self.halo_to] = values[self.halo_row]
        return out

    def _place_crossings(self) -> None:
        # Padding and crossings outside the blank keep the flat grid's distances, so that no vector loop divides by
        # zero, and lie where no crossing of the blank can run into them.
        grid, columns = self.grid, self.columns
        u = (np.arange(self.layout.stride) - grid.centre[0]) * grid.warp_pitch
        v = (np.arange(self.rows) - grid.centre[1]) * grid.weft_pitch
        plan = grid.plan(np.stack(np.broadcast_arrays(u[None, :], v[:, None]), axis=-1))
        for c in range(2):
            place = plan[..., c].copy()
            place[:, :columns][grid.on_plane[..., c]] = 0.0
            self.state[self.row_index, at.POSITION + c] = place
        height = np.full((self.rows, self.layout.stride), OUT_OF_THE_WAY)
        height[:, :columns][grid.active] = 0.0
        self.state[self.row_index, at.POSITION + 2] = height
        self.fill_halos()

    def fill_halos(self) -> None:
        """Copy the rows that bands share."""
        self.state[self.halo_to] = self.state[self.halo_from]

    def _describe(self, thickness: float, density: float) -> Floats:
        """Traits of every row of the grid, shape [rows, trait fields, stride]."""
        grid, layout, columns = self.grid, self.layout, self.columns
        traits = np.zeros((self.rows, layout.traits, layout.stride))
        inertia = inertia_area(grid)
        with np.errstate(divide="ignore"):
            inverse = np.where(grid.active, 1.0 / (density * inertia), 0.0)
        for c in range(3):
            traits[:, at.INVERSE_MASS + c, :columns] = inverse
        for c in range(2):
            traits[:, at.INVERSE_MASS + c, :columns][grid.on_plane[..., c]] = 0.0
        traits[:, at.AREA, :columns] = grid.node_area
        traits[:, at.INERTIA, :columns] = inertia
        traits[:, at.WARP_LINE, : columns - 1] = grid.warp_lines
        traits[:-1, at.WEFT_LINE, :columns] = grid.weft_lines
        traits[:-1, at.VOLUME, : columns - 1] = grid.cell_share * grid.cell_area * thickness
        if layout.half_cells:
            lower, left = grid.edge_weights
            mirror, signs = grid.mirrors
            traits[:, at.LOWER_WEIGHT] = 0.5
            traits[:, at.LEFT_WEIGHT] = 0.5
            traits[:-1, at.LOWER_WEIGHT, : columns - 1] = lower
            traits[:-1, at.LEFT_WEIGHT, : columns - 1] = left
            traits[:-1, at.MIRROR, : columns - 1] = mirror
            traits[:-1, at.MIRROR_Z, : columns - 1] = mirror * signs[..., 2]
        return traits

    def _share_traits(self) -> None:
        """Keep one of the rows that are alike."""
        found: dict[bytes, int] = {}
        kept: list[int] = []
        which = np.zeros(self.rows, np.int64)
        for j, row in enumerate(self._traits):
            key = row.tobytes()
            if key not in found:
                found[key] = len(kept)
                kept.append(j)
            which[j] = found[key]
        self.traits = aligned((len(kept), self.layout.traits, self.layout.stride))
        self.traits[:] = self._traits[kept]
        self.trait_rows: Ints = self._spread(which)
        del self._traits

    def hold(self, rows: Ints, columns: Ints, held: NDArray[np.bool_]) -> None:
        """Take mass and inertia from crossings whose motion is prescribed.

        Parameters
        ----------
        rows, columns
            Of the crossings.
        held
            Which of their components are, shape [crossings, 3].
        """
        self._traits = self.traits[self.trait_rows[self.row_index]]
        for c in range(3):
            self._traits[rows[held[:, c]], at.INVERSE_MASS + c, columns[held[:, c]]] = 0.0
        # its inertia and damping come from the machine that moves it, not from the fabric's ledger
        whole = held.all(axis=1)
        self._traits[rows[whole], at.INERTIA, columns[whole]] = 0.0
        self._share_traits()

    def trait(self, field: int) -> Floats:
        """A trait of every crossing, shape [rows, columns]."""
        return self.traits[self.trait_rows[self.row_index], field, : self.columns]

    def vectors(self, first: int) -> Floats:
        """Three fields of the state, shape [rows, columns, 3]."""
        vectors = np.empty((len(self.row_index), self.columns, 3))
        for c in range(3):
            vectors[..., c] = self.state[self.row_index, first + c, : self.columns]
        return vectors


def inertia_area(grid: YarnGrid) -> Floats:
    """Area whose mass each crossing carries [mm2], shape [rows, columns].

    A yarn on a free edge is a whole yarn (Eq. 11 counts n + 1 lines) but only half a cell of fabric belongs
    to it. It is given the mass of a whole yarn, or the one edge would set the stable step of the blank.
    """
    warp = np.zeros(grid.shape)
    warp[:, 1:] += grid.warp_lines
    warp[:, :-1] += grid.warp_lines
    weft = np.zeros(grid.shape)
    weft[1:] += grid.weft_lines
    weft[:-1] += grid.weft_lines
    lines = np.maximum(warp, weft)
    if grid.along_bias:
        # of a crossing on a plane of symmetry half is modelled, and its warp lines go on as weft lines beyond
        lines = np.where(grid.on_plane.any(axis=-1), 0.5 * (warp + weft), lines)
    return np.where(grid.active, np.maximum(grid.node_area, 0.5 * grid.cell_area * lines), 0.0)
