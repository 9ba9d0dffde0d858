"""What a study may say. Lengths in mm, forces in N, times in s, stresses in MPa, angles in degrees."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from weftform.fabric.card import Declared, Finite, NotNegative, Positive

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

    ``hemisphere`` and ``flat-punch`` have ``diameter_mm`` (the flat punch also ``edge_radius_mm``); ``opening`` is a flat face with a hole of
    ``hole_diameter_mm`` and a fillet ``edge_radius_mm``. A tool stands still (``fixed``), makes the stroke of the loading
    (``stroke``) or is pushed on the fabric by ``force_N`` on the whole blank and free along z (``force``).
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


class LoadingTable(Declared):
    """Stroke and its timing. Times are of the simulation: with quasi-static forming they only set how many steps are made."""

    stroke_mm: Positive
    closing_s: NotNegative = 0.01
    duration_s: Positive
    ramp: Annotated[float, Field(strict=True, gt=0, le=0.5, allow_inf_nan=False)] = 0.2


class SolverTable(Declared):
    """Numerical settings."""

    mass_scaling: Annotated[float, Field(strict=True, ge=1, le=1e6, allow_inf_nan=False)] = 1.0
    damping_per_s: NotNegative = 0.0
    hourglass: NotNegative = 0.01
    safety: Annotated[float, Field(strict=True, gt=0, le=0.98, allow_inf_nan=False)] = 0.9
    most_steps: Annotated[int, Field(strict=True, gt=0, le=1_000_000_000)] = 20_000_000


class OutputTable(Declared):
    """How often to keep fields and history."""

    frames: Annotated[int, Field(strict=True, ge=2, le=2000)] = 31
    rows: Annotated[int, Field(strict=True, ge=2, le=100_000)] = 301


class StudyModel(Declared):
    """A forming study."""

    format: Literal[1] = 1
    name: Annotated[str, Field(min_length=1)]
    kind: Literal["forming"]
    description: str = ""
    fabric: FabricChoice
    blank: BlankTable
    tools: dict[str, ToolTable] = Field(min_length=1, max_length=8)
    contact: dict[str, ContactTable]
    loading: LoadingTable
    solver: SolverTable = SolverTable()
    output: OutputTable = OutputTable()

    @model_validator(mode="after")
    def _pairs(self) -> StudyModel:
        for name in self.contact:
            if name not in self.tools:
                raise ValueError(
                    f"[contact.{name}] names a tool that does not exist; the tools are {', '.join(self.tools)}"
                )
        for name in self.tools:
            if name not in self.contact:
                raise ValueError(f"tool {name} has no [contact.{name}]; every pair is named, with its friction")
        if not any(tool.motion == "stroke" for tool in self.tools.values()):
            raise ValueError('no tool moves: give one of them motion = "stroke"')
        return self
