"""What the columns of the usual exports are called.

A preset is a set of spellings for the quantities of the laboratory and the units to take where a file gives
none. The generic one reads any table whose headers name the quantity; the others add what an instrument
calls it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from weftform.errors import MeasurementError
from weftform.laboratory.units import Dimension, split_unit


class Quantity(Enum):
    """A measured quantity: its name in this package (with the unit it is converted to)."""

    TIME = "time_s"
    DISPLACEMENT = "displacement_mm"
    FORCE = "force_N"
    SHEAR_ANGLE = "shear_angle_deg"
    NORMALISED_SHEAR_FORCE = "normalised_shear_force_N_per_mm"
    X = "x_mm"
    Y = "y_mm"
    Z = "z_mm"
    U = "u_mm"
    V = "v_mm"
    SHIFT_X = "shift_x_mm"
    SHIFT_Y = "shift_y_mm"
    SHIFT_Z = "shift_z_mm"
    STRAIN_XX = "strain_xx"
    STRAIN_YY = "strain_yy"
    STRAIN_XY = "strain_xy"
    SCATTER = "scatter_deg"
    IMAGE = "image"
    MARKER = "marker"
    SPECIMEN = "specimen"

    @property
    def dimension(self) -> Dimension:
        """Kind of the quantity."""
        return _DIMENSIONS[self]

    @property
    def is_text(self) -> bool:
        """Whether the column holds names rather than numbers."""
        return self in (Quantity.MARKER, Quantity.SPECIMEN, Quantity.IMAGE)


_DIMENSIONS: dict[Quantity, Dimension] = {
    Quantity.TIME: Dimension.TIME,
    Quantity.DISPLACEMENT: Dimension.LENGTH,
    Quantity.FORCE: Dimension.FORCE,
    Quantity.SHEAR_ANGLE: Dimension.ANGLE,
    Quantity.NORMALISED_SHEAR_FORCE: Dimension.FORCE_PER_LENGTH,
    Quantity.X: Dimension.LENGTH,
    Quantity.Y: Dimension.LENGTH,
    Quantity.Z: Dimension.LENGTH,
    Quantity.U: Dimension.LENGTH,
    Quantity.V: Dimension.LENGTH,
    Quantity.SHIFT_X: Dimension.LENGTH,
    Quantity.SHIFT_Y: Dimension.LENGTH,
    Quantity.SHIFT_Z: Dimension.LENGTH,
    Quantity.STRAIN_XX: Dimension.RATIO,
    Quantity.STRAIN_YY: Dimension.RATIO,
    Quantity.STRAIN_XY: Dimension.RATIO,
    Quantity.SCATTER: Dimension.ANGLE,
    Quantity.IMAGE: Dimension.NONE,
    Quantity.MARKER: Dimension.NONE,
    Quantity.SPECIMEN: Dimension.NONE,
}

_GENERIC: dict[Quantity, tuple[str, ...]] = {
    Quantity.TIME: ("time", "zeit", "temps", "t"),
    Quantity.DISPLACEMENT: (
        "displacement",
        "crosshead displacement",
        "extension",
        "elongation",
        "stroke",
        "crosshead",
        "position",
        "deplacement",
        "déplacement",
        "allongement",
        "traverse",
        "weg",
        "verschiebung",
        "d",
        "u",
    ),
    Quantity.FORCE: ("force", "load", "axial force", "standard force", "kraft", "charge", "effort", "f"),
    Quantity.SHEAR_ANGLE: ("shear angle", "gamma", "γ", "angle", "scherwinkel", "angle de cisaillement"),
    Quantity.NORMALISED_SHEAR_FORCE: (
        "normalised shear force",
        "normalized shear force",
        "shear force per length",
        "fsh",
        "f sh",
    ),
    Quantity.X: ("x", "x coordinate", "coordinate x"),
    Quantity.Y: ("y", "y coordinate", "coordinate y"),
    Quantity.Z: ("z", "z coordinate", "coordinate z"),
    Quantity.IMAGE: ("image", "frame", "stage", "picture", "photo", "step"),
    Quantity.MARKER: ("marker", "mark", "point", "label", "target"),
    Quantity.SPECIMEN: (
        "specimen",
        "sample",
        "laboratory",
        "test",
        "specimen label",
        "specimen width x height",
        "probe",
        "éprouvette",
    ),
}


@dataclass(frozen=True)
class Preset:
    """Spellings of one kind of export.

    Attributes
    ----------
    name
        What the user calls it.
    spellings
        Extra names per quantity, tried before the generic ones.
    units
        Units per quantity where the file gives none.
    signs
        Words in the file that tell this preset from others.
    """

    name: str
    spellings: Mapping[Quantity, tuple[str, ...]] = field(default_factory=dict)
    units: Mapping[Quantity, str] = field(default_factory=dict)
    signs: tuple[str, ...] = ()

    def quantity_of(self, header: str) -> Quantity | None:
        """Which quantity a header (without its unit) names, or None."""
        name = plain(header)
        for spellings in (self.spellings, _GENERIC):
            for quantity, names in spellings.items():
                if name in names:
                    return quantity
        return next((q for q in Quantity if name == plain(split_unit(q.value)[0])), None)


def plain(header: str) -> str:
    """A header in small letters, marks and underscores turned into single blanks."""
    return re.sub(r"[\s_:\-\.\"']+", " ", header.strip().lower()).strip()


GENERIC = Preset("generic")
INSTRON = Preset(
    "instron",
    {
        Quantity.DISPLACEMENT: (
            "extension",
            "compressive extension",
            "tensile extension",
            "tensile displacement",
        ),
        Quantity.FORCE: ("load", "compressive load"),
    },
    {Quantity.DISPLACEMENT: "mm", Quantity.FORCE: "N", Quantity.TIME: "s"},
    signs=("bluehill", "instron", "specimen label"),
)
ARAMIS = Preset(
    "aramis",
    {
        Quantity.SHIFT_X: ("displacement x", "dx", "disp x"),
        Quantity.SHIFT_Y: ("displacement y", "dy", "disp y"),
        Quantity.SHIFT_Z: ("displacement z", "dz", "disp z"),
        Quantity.STRAIN_XX: ("epsilon x", "strain x", "technical strain x"),
        Quantity.STRAIN_YY: ("epsilon y", "strain y", "technical strain y"),
        Quantity.STRAIN_XY: ("epsilon xy", "strain xy", "shear strain xy"),
        Quantity.MARKER: ("point id", "point name", "facet", "element"),
        Quantity.IMAGE: ("stage", "stage id"),
    },
    dict.fromkeys((Quantity.X, Quantity.Y, Quantity.Z, Quantity.SHIFT_X, Quantity.SHIFT_Y, Quantity.SHIFT_Z), "mm")
    | dict.fromkeys((Quantity.STRAIN_XX, Quantity.STRAIN_YY, Quantity.STRAIN_XY), "%"),
    signs=("aramis", "gom "),
)
VIC3D = Preset(
    "vic3d",
    {
        Quantity.X: ("x",),
        Quantity.Y: ("y",),
        Quantity.Z: ("z",),
        Quantity.SHIFT_X: ("u",),
        Quantity.SHIFT_Y: ("v",),
        Quantity.SHIFT_Z: ("w",),
        Quantity.STRAIN_XX: ("exx",),
        Quantity.STRAIN_YY: ("eyy",),
        Quantity.STRAIN_XY: ("exy",),
    },
    dict.fromkeys((Quantity.X, Quantity.Y, Quantity.Z, Quantity.SHIFT_X, Quantity.SHIFT_Y, Quantity.SHIFT_Z), "mm")
    | dict.fromkeys((Quantity.STRAIN_XX, Quantity.STRAIN_YY, Quantity.STRAIN_XY), "1"),
    signs=("exx", "vic-3d"),
)
FORMED = Preset(
    "formed",
    {
        Quantity.U: ("u", "warp coordinate", "along warp"),
        Quantity.V: ("v", "weft coordinate", "along weft"),
        Quantity.MARKER: ("name", "id"),
        Quantity.SCATTER: ("scatter", "angle scatter", "deviation", "standard deviation", "std", "sd", "uncertainty"),
    },
)
"""Points of a formed part: ``u`` and ``v`` are material coordinates here, not displacements."""
PRESETS: dict[str, Preset] = {p.name: p for p in (GENERIC, INSTRON, ARAMIS, VIC3D)}


def find_preset(name: str, words: str) -> Preset:
    """The preset of a name; ``auto`` looks for the signs of each in ``words`` (in small letters).

    Raises
    ------
    MeasurementError
        No preset of that name.
    """
    if name == "auto":
        return next((p for p in PRESETS.values() if any(sign in words for sign in p.signs)), GENERIC)
    if name not in PRESETS:
        raise MeasurementError(f'no reader preset "{name}"', expected="auto, " + ", ".join(PRESETS))
    return PRESETS[name]
