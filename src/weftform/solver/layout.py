"""Where each field of a crossing lies in the state array.

The state is one flat array of rows; a row holds, one after the other, the fields of all crossings of one weft
index, each padded to ``stride`` numbers. Fields of the cell (i, j) and of the connectors that start at a crossing
lie with the crossing (i, j). Row length and stride are constants of the compiled loop, so that LLVM can prove
that fields do not overlap.
"""

from __future__ import annotations

from dataclasses import dataclass

POSITION = 0
VELOCITY = 3
FIRST_OPTIONAL = 6

MEMORY = 4
"""Fields of the ledger's memory, an array beside the state that steps do not touch (:mod:`weftform.solver.energies`)."""

# Traits: what never changes. Rows that are alike share one row of traits, so that the sweep hardly has to fetch them.
INVERSE_MASS = 0
AREA = 3
WARP_LINE = 4
WEFT_LINE = 5
VOLUME = 6
INERTIA = 7
"""Area whose mass the crossing carries [mm2]: AREA, or more where an edge yarn would be light for its stiffness."""
LOWER_WEIGHT = 8
"""With half cells: weights of the lower and of the left edge, share of the mirror image, and that times its sign z."""
LEFT_WEIGHT = 9
MIRROR = 10
MIRROR_Z = 11

LANES = 8
"""Loops run over whole blocks of so many places: the widest vector unit holds eight numbers."""

PIECE = 64
"""Most cells of a row that go through its loops together: what these hand on and the rows they read fit into 48 KiB."""
BETWEEN = 11
"""Rows of scratch in which they hand it on, each of PIECE numbers (:mod:`weftform.solver.fabric_rows`)."""

LEAD = 16
"""Unused numbers before each scratch row, so that index i - 1 exists and rows stay aligned."""

WIDTHS = (
    16, 24, 32, 40, 48, 56, 72, 88, 104, 120, 136, 152, 184, 216, 248, 280, 328, 376, 440, 504, 584, 712, 840, 1016, 1208,
    1464, 1736, 2072, 2488, 3000, 3576, 4296, 5176, 6184, 7384, 8216,
)  # fmt: skip
"""Row strides that are compiled: the next is at most a fifth wider, because the processor fetches the padding too (a stride
of 272 for 201 columns cost a fifth of a step); no multiple of 64, so that fields do not compete for the same cache sets."""


def blocks_for(columns: int) -> int:
    """Blocks of :data:`LANES` places that hold a row."""
    return -(-columns // LANES)


def stride_for(columns: int) -> int:
    """Smallest compiled stride that holds a row and the padding that vector loops run into."""
    needed = blocks_for(columns) * LANES + LANES
    for width in WIDTHS:
        if width >= needed:
            return width
    return -(-needed // 4096) * 4096 + 16


@dataclass(frozen=True)
class Layout:
    """Constants of one compiled loop. Every member is an integer, so that the compiled code can be cached by value.

    Attributes
    ----------
    stride
        Numbers per field of a row.
    tools
        Rigid tools.
    half_cells
        1 where the blank has half cells.
    driven
        1 where some crossings follow prescribed motions (grips).
    warp_degree, warp_pieces, weft_degree, weft_pieces, shear_degree, shear_pieces
        Packing of the laws.
    """

    stride: int
    tools: int
    half_cells: int
    driven: int
    warp_degree: int
    warp_pieces: int
    weft_degree: int
    weft_pieces: int
    shear_degree: int
    shear_pieces: int

    @property
    def traits(self) -> int:
        """Fields of a row of traits."""
        return MIRROR_Z + 1 if self.half_cells else INERTIA + 1

    @property
    def force(self) -> int:
        """First of the three fields with the force on a crossing, kept where crossings are driven."""
        return FIRST_OPTIONAL

    @property
    def fields(self) -> int:
        """Fields per row."""
        return self.force + 3 * self.driven

    @property
    def row(self) -> int:
        """Numbers per row."""
        return self.fields * self.stride

    @property
    def block(self) -> int:
        """Numbers of a scratch block of three components."""
        return 3 * self.stride + 2 * LEAD

    @property
    def edge_scratch(self) -> int:
        """Numbers of scratch for edges: warp, carried to the row above, right share of the weft edges."""
        return 3 * self.block

    @property
    def node_scratch(self) -> int:
        """Numbers of scratch for crossings: weft edges and force."""
        return 2 * self.block
