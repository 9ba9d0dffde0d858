"""The fabric card: what is written in the TOML file, checked."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

# strict: a text or a truth value is no number, even where it could be read as one
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]


class Declared(BaseModel):
    """Base of all declared tables: unknown keys are refused, values do not change once read."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class FabricTable(Declared):
    """What the data sheet says."""

    areal_weight_g_m2: Positive
    thickness_mm: Positive
    weave: str = ""
    warp_count_per_cm: Positive | None = None
    weft_count_per_cm: Positive | None = None
    yarn_linear_density_tex: Positive | None = None


class TensionTable(Declared):
    """Force against elongation of a tensile specimen, F [N] of u [mm].

    ``polynomial``: ``coefficients`` of u, u^2, ... and ``valid_to_mm``; ``linear`` and ``log-strain``:
    ``stiffness_N_per_mm``; ``tabulated``: ``displacement_mm`` and ``force_N``. ``same_as`` copies the other
    direction.
    """

    law: Literal["polynomial", "linear", "log-strain", "tabulated"] | None = None
    coefficients: list[Finite] | None = Field(default=None, min_length=1, max_length=12)
    constant_N: Finite = 0.0
    stiffness_N_per_mm: Positive | None = None
    displacement_mm: list[Finite] | None = None
    force_N: list[Finite] | None = None
    specimen_length_mm: Positive | None = None
    specimen_width_mm: Positive | None = None
    valid_to_mm: Positive | None = None
    slack_ratio: NotNegative = Field(default=0.0, le=1.0)
    source: str = ""
    same_as: Literal["warp", "weft"] | None = None

    @model_validator(mode="after")
    def _complete(self) -> TensionTable:
        if self.same_as is not None:
            if self.law is not None:
                raise ValueError("give either same_as or law, not both")
            return self
        if self.law is None:
            raise ValueError('law is missing (polynomial, linear, log-strain or tabulated), or same_as = "warp"')
        needed = {
            "polynomial": ("coefficients", "valid_to_mm"),
            "linear": ("stiffness_N_per_mm",),
            "log-strain": ("stiffness_N_per_mm",),
            "tabulated": ("displacement_mm", "force_N"),
        }[self.law]
        for key in (*needed, "specimen_length_mm", "specimen_width_mm"):
            if getattr(self, key) is None:
                raise ValueError(f'law "{self.law}" needs {key}')
        return self


class TensionPair(Declared):
    """A tension law for each direction."""

    warp: TensionTable
    weft: TensionTable

    @model_validator(mode="after")
    def _no_circle(self) -> TensionPair:
        if self.warp.same_as == "warp" or self.weft.same_as == "weft":
            raise ValueError("same_as must name the other direction")
        if self.warp.same_as and self.weft.same_as:
            raise ValueError("warp and weft cannot both be same_as the other")
        return self


class TensionSection(TensionPair):
    """The card's own pair and named variants of it."""

    variants: dict[str, TensionPair] = Field(default_factory=dict)


class ShearTable(Declared):
    """In-plane shear, one of three quantities, against the shear angle.

    ``shear-modulus``: G12 [MPa], polynomial with its constant first; ``shear-stress``: tau [MPa] and
    ``normalised-shear-force``: F_sh [N/mm], polynomials of gamma, gamma^2, ... Angles of polynomials in
    radians, of tables in degrees.
    """

    law: Literal["polynomial", "constant", "tabulated"]
    quantity: Literal["shear-modulus", "shear-stress", "normalised-shear-force"] = "shear-modulus"
    coefficients: list[Finite] | None = Field(default=None, min_length=1, max_length=12)
    modulus_MPa: NotNegative | None = None
    shear_angle_deg: list[Finite] | None = None
    values: list[Finite] | None = None
    valid_to_deg: Annotated[float, Field(strict=True, gt=0, le=90, allow_inf_nan=False)] = 90.0
    source: str = ""

    @model_validator(mode="after")
    def _complete(self) -> ShearTable:
        needed = {
            "polynomial": ("coefficients",),
            "constant": ("modulus_MPa",),
            "tabulated": ("shear_angle_deg", "values"),
        }[self.law]
        for key in needed:
            if getattr(self, key) is None:
                raise ValueError(f'law "{self.law}" needs {key}')
        if self.law == "constant" and self.quantity != "shear-modulus":
            raise ValueError('law "constant" gives a shear modulus')
        if self.law == "tabulated" and self.quantity == "shear-modulus":
            raise ValueError("a tabulated shear law is of shear-stress or normalised-shear-force")
        if self.law == "tabulated" and "valid_to_deg" in self.model_fields_set:
            raise ValueError("a tabulated shear law is valid to its last point: leave out valid_to_deg")
        if self.law == "tabulated" and self.shear_angle_deg and max(self.shear_angle_deg) > 90.0:
            raise ValueError("shear angles of a table must not exceed 90 degrees")
        return self


class MembraneTable(Declared):
    """Numerical stiffness of the membrane along the yarns [MPa]."""

    warp_modulus_MPa: NotNegative = 3.9
    weft_modulus_MPa: NotNegative = 3.9
    source: str = ""


class FabricCard(Declared):
    """The whole card."""

    format: Literal[1] = 1
    name: Annotated[str, Field(min_length=1)]
    description: str = ""
    fabric: FabricTable
    tension: TensionSection
    shear: ShearTable
    membrane: MembraneTable = MembraneTable()
    provenance: dict[str, Any] = Field(default_factory=dict)
