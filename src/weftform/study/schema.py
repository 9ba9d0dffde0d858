"""What a study may say. Lengths in mm, forces in N, times in s, stresses in MPa, angles in degrees."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from weftform.fabric.card import Declared, Finite, NotNegative, Positive

Ramp = Annotated[float, Field(strict=True, gt=0, le=0.5, allow_inf_nan=False)]
"""Share of a motion's time spent gathering speed, and again losing it."""

Coefficient = Annotated[float, Field(strict=True, ge=0, le=2, allow_inf_nan=False)]


class FabricChoice(Declared):
    """Which card, which of its tension variants, and tables of the card that this study changes."""

    card: Annotated[str, Field(min_length=1)]
    tension_variant: str = ""
    override: dict[str, Any] = Field(default_factory=dict)


class BlankTable(Declared):
    """The flat blank in the plane of the press."""

    outline: Literal["rectangle", "disc", "polygon"] = "rectangle"
    width_mm: Positive | None = None
    height_mm: Positive | None = None
    diameter_mm: Positive | None = None
    points_mm: list[tuple[Finite, Finite]] | None = Field(default=None, min_length=3)
    cell_length_mm: Positive
    fit_cells: Annotated[bool, Field(strict=True)] = True
    warp_angle_deg: Annotated[float, Field(strict=True, ge=-180, le=180, allow_inf_nan=False)] = 0.0
    symmetry: Literal["full", "half-x", "half-y", "quarter"] = "full"

    @model_validator(mode="after")
    def _sizes(self) -> BlankTable:
        needed = {
            "rectangle": ("width_mm", "height_mm"),
            "disc": ("diameter_mm",),
            "polygon": ("points_mm",),
        }[self.outline]
        for key in ("width_mm", "height_mm", "diameter_mm", "points_mm"):
            given = getattr(self, key) is not None
            if key in needed and not given:
                raise ValueError(f'outline "{self.outline}" needs {key}')
            if key not in needed and given:
                raise ValueError(f'{key} has no meaning for outline "{self.outline}"')
        return self


class ToolTable(Declared):
    """A rigid tool of revolution about the z axis, on one side of the fabric.

    ``hemisphere`` and ``flat-punch`` have ``diameter_mm`` (the flat punch also ``edge_radius_mm``); ``opening``
    is a flat face with a hole of ``hole_diameter_mm`` and a fillet ``edge_radius_mm``. A tool stands still
    (``fixed``), makes the stroke of the loading (``stroke``) or is pushed on the fabric by ``force_N`` on the
    whole blank and free along z (``force``).
    """

    shape: Literal["hemisphere", "flat-punch", "opening"]
    side: Literal["below", "above"]
    motion: Literal["fixed", "stroke", "force"]
    diameter_mm: Positive | None = None
    hole_diameter_mm: Positive | None = None
    edge_radius_mm: NotNegative | None = None
    force_N: Positive | None = None
    mass_kg: Positive | None = None

    @model_validator(mode="after")
    def _sizes(self) -> ToolTable:
        needed = {
            "hemisphere": ("diameter_mm",),
            "flat-punch": ("diameter_mm", "edge_radius_mm"),
            "opening": ("hole_diameter_mm", "edge_radius_mm"),
        }[self.shape]
        for key in ("diameter_mm", "hole_diameter_mm", "edge_radius_mm"):
            given = getattr(self, key) is not None
            if key in needed and not given:
                raise ValueError(f'shape "{self.shape}" needs {key}')
            if key not in needed and given:
                raise ValueError(f'{key} has no meaning for shape "{self.shape}"')
        if self.shape == "flat-punch":
            assert self.diameter_mm is not None and self.edge_radius_mm is not None
            if not 0.0 < self.edge_radius_mm <= 0.5 * self.diameter_mm:
                raise ValueError("edge_radius_mm must be above 0 and at most half of diameter_mm")
        if (self.force_N is not None) != (self.motion == "force"):
            raise ValueError('force_N goes with motion = "force", and only with it')
        if self.mass_kg is not None and self.motion != "force":
            raise ValueError('mass_kg goes with motion = "force"')
        return self


class ContactTable(Declared):
    """Contact of the fabric with one tool. The penalty stiffness is per area of fabric."""

    friction: Coefficient
    stiffness_N_per_mm3: Positive = 30.0
    tangential_ratio: Annotated[float, Field(strict=True, gt=0, le=1, allow_inf_nan=False)] = 0.5


class FormingLoading(Declared):
    """Stroke and its timing. Times are of the simulation: with quasi-static forming they only set how many steps
    are made.
    """

    stroke_mm: Positive
    closing_s: NotNegative = 0.01
    duration_s: Positive
    ramp: Ramp = 0.2
    end_ramp: Ramp | None = None
    """Of the end; like ``ramp`` without. At a given duration a short one leaves the speed on the way lower."""


class SolverTable(Declared):
    """Numerical settings."""

    mass_scaling: Annotated[float, Field(strict=True, ge=1, le=1e6, allow_inf_nan=False)] = 1.0
    damping_per_s: NotNegative = 0.0
    viscosity: Annotated[float, Field(strict=True, ge=0, le=0.3, allow_inf_nan=False)] = 0.06
    hourglass: NotNegative = 0.01
    safety: Annotated[float, Field(strict=True, gt=0, le=0.98, allow_inf_nan=False)] = 0.85
    least_step_s: NotNegative = 0.0
    most_steps: Annotated[int, Field(strict=True, gt=0, le=1_000_000_000)] = 20_000_000


class OutputTable(Declared):
    """How often to keep fields and history."""

    frames: Annotated[int, Field(strict=True, ge=2, le=2000)] = 31
    rows: Annotated[int, Field(strict=True, ge=2, le=100_000)] = 301


class Common(Declared):
    """What every study says."""

    format: Literal[1] = 1
    name: Annotated[str, Field(min_length=1, pattern=r"^[^/\\\x00]+$")]
    description: str = ""
    fabric: FabricChoice
    solver: SolverTable = SolverTable()
    output: OutputTable = OutputTable()


class FormingModel(Common):
    """A blank between rigid tools."""

    kind: Literal["forming"]
    blank: BlankTable
    tools: dict[str, ToolTable] = Field(min_length=1, max_length=8)
    contact: dict[str, ContactTable]
    loading: FormingLoading

    @model_validator(mode="after")
    def _pairs(self) -> FormingModel:
        names = ", ".join(self.tools)
        for name in self.contact:
            if name not in self.tools:
                raise ValueError(f"[contact.{name}] names a tool that does not exist; the tools are {names}")
        for name in self.tools:
            if name not in self.contact:
                raise ValueError(f"tool {name} has no [contact.{name}]; every pair is named, with its friction")
        moving = [name for name, tool in self.tools.items() if tool.motion == "stroke"]
        if len(moving) != 1:
            raise ValueError(f'one tool makes the stroke (motion = "stroke"); here {len(moving)} do')
        return self


class SpecimenTable(Declared):
    """A rectangular specimen between two clamps, pulled along its length."""

    length_mm: Positive
    width_mm: Positive
    cell_length_mm: Positive


class TensileSpecimen(SpecimenTable):
    """A specimen pulled along its warp or its weft."""

    direction: Literal["warp", "weft"]


class Pull(Declared):
    """Displacement of the moving clamp [mm] in simulated time [s]."""

    displacement_mm: Positive
    duration_s: Positive
    ramp: Ramp = 0.2


class TensileModel(Common):
    """A strip clamped at both ends and pulled along its yarns (Sec. 3.2)."""

    kind: Literal["tensile"]
    specimen: TensileSpecimen
    loading: Pull


class BiasModel(Common):
    """A strip clamped at both ends and pulled at 45 degrees to its yarns (Secs. 2.3, 3.6)."""

    kind: Literal["bias-extension"]
    specimen: SpecimenTable
    loading: Pull


class FrameSpecimen(Declared):
    """A square of fabric pinned along its edges in a square frame."""

    frame_side_mm: Positive
    fabric_side_mm: Positive
    cell_length_mm: Positive

    @model_validator(mode="after")
    def _fits(self) -> FrameSpecimen:
        if self.fabric_side_mm > self.frame_side_mm:
            raise ValueError("the fabric is larger than the frame")
        return self


class FrameLoading(Declared):
    """Shear angles that the frame passes through, one after the other, from zero."""

    shear_angles_deg: list[Annotated[float, Field(strict=True, gt=-85, lt=85, allow_inf_nan=False)]] = Field(
        min_length=1
    )
    duration_s: Positive
    ramp: Ramp = 0.2


class FrameModel(Common):
    """A picture frame; with several angles a cyclic shear test."""

    kind: Literal["picture-frame"]
    specimen: FrameSpecimen
    loading: FrameLoading


class BiaxialSpecimen(Declared):
    """A rectangle whose edges are pulled along warp and weft and free to slide along themselves."""

    warp_length_mm: Positive
    weft_length_mm: Positive
    cell_length_mm: Positive


class BiaxialLoading(Declared):
    """Nominal strains of warp and weft at the end; their quotient is the biaxial ratio."""

    warp_strain: Annotated[float, Field(strict=True, ge=0, le=0.5, allow_inf_nan=False)]
    weft_strain: Annotated[float, Field(strict=True, ge=0, le=0.5, allow_inf_nan=False)]
    duration_s: Positive
    ramp: Ramp = 0.2

    @model_validator(mode="after")
    def _moves(self) -> BiaxialLoading:
        if self.warp_strain == self.weft_strain == 0.0:
            raise ValueError("nothing is pulled: give warp_strain or weft_strain")
        return self


class BiaxialModel(Common):
    """Biaxial tension with any ratio."""

    kind: Literal["biaxial"]
    specimen: BiaxialSpecimen
    loading: BiaxialLoading


class ElementTable(Declared):
    """A single square cell."""

    side_mm: Positive = 1.0


class Move(Declared):
    """One phase of an element test; exactly one of its values is given.

    ``warp_stretch``: length of the warp over its initial length at the end of the phase; ``shear_angle_deg``:
    simple shear, the weft leans towards the warp at constant height; ``rotation_deg``: a rigid turn, only as the
    last phase.
    """

    warp_stretch: Annotated[float, Field(strict=True, gt=0.4, lt=2.5, allow_inf_nan=False)] | None = None
    shear_angle_deg: Annotated[float, Field(strict=True, gt=-65, lt=65, allow_inf_nan=False)] | None = None
    rotation_deg: Annotated[float, Field(strict=True, ge=-720, le=720, allow_inf_nan=False)] | None = None

    @model_validator(mode="after")
    def _one(self) -> Move:
        given = [v for v in (self.warp_stretch, self.shear_angle_deg, self.rotation_deg) if v is not None]
        if len(given) != 1:
            raise ValueError("a phase is one of warp_stretch, shear_angle_deg and rotation_deg")
        return self


class ElementLoading(Declared):
    """Phases of equal duration."""

    phases: list[Move] = Field(min_length=1, max_length=12)
    duration_s: Positive
    ramp: Ramp = 0.2

    @model_validator(mode="after")
    def _turn_last(self) -> ElementLoading:
        if any(phase.rotation_deg is not None for phase in self.phases[:-1]):
            raise ValueError("rotation_deg must be the last phase")
        return self


class ElementModel(Common):
    """Elementary tests on one cell (Secs. 3.4 and 3.5, Tables 2 and 3)."""

    kind: Literal["element"]
    element: ElementTable = ElementTable()
    loading: ElementLoading


MODELS: dict[str, type[Common]] = {
    "forming": FormingModel,
    "tensile": TensileModel,
    "bias-extension": BiasModel,
    "picture-frame": FrameModel,
    "biaxial": BiaxialModel,
    "element": ElementModel,
}

StudyModel = FormingModel | TensileModel | BiasModel | FrameModel | BiaxialModel | ElementModel
