"""The fabric as the solver and the laboratory use it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Any, Literal

import numpy as np

from weftform.declared import read_toml, validated
from weftform.errors import CardError
from weftform.fabric.card import FabricCard, TensionPair, TensionTable
from weftform.fabric.laws import (
    Floats,
    Law,
    LinearLaw,
    LogStrainLaw,
    PolynomialLaw,
    Scaled,
    TabulatedLaw,
    first_fall,
)

Direction = Literal["warp", "weft"]

MOST_STRETCH = 2.0
"""Largest nominal strain covered by the packed pieces of a law that has no limit of validity (element tests reach 1)."""


def shipped_cards() -> dict[str, Path]:
    """Names and files of the cards in the package."""
    folder = resources.files("weftform") / "data" / "cards"
    return {p.name.removesuffix(".toml"): Path(str(p)) for p in sorted(folder.iterdir(), key=lambda p: p.name)}


@dataclass(frozen=True)
class TensionLaw:
    """Force of a tensile specimen against its elongation, with the specimen's size.

    Attributes
    ----------
    specimen_force
        F(u) of the specimen [N] of u [mm], without slack.
    length, width
        Specimen [mm]: X and Y of Eq. 11.
    slack_ratio
        Stiffness in compression as a share of the initial stiffness in tension (0: yarns do not push).
    """

    specimen_force: Law
    length: float
    width: float
    slack_ratio: float = 0.0

    def line_law(self, spacing: float) -> Law:
        """Force [N] of one line of connectors against nominal strain, for lines ``spacing`` mm apart.

        Eq. 11: the specimen is n + 1 = width / spacing + 1 lines in parallel (fractional values are meant), each a chain of
        length / l0 connectors that share the elongation. Written in the strain u / length, l0 along the line drops out.
        """
        lines = self.width / spacing + 1.0
        return Scaled(self.specimen_force, factor_x=self.length, factor_y=1.0 / lines)

    def force(self, elongation: Floats | float) -> Floats:
        """Force of the specimen [N] at an elongation [mm], slack included."""
        u = np.asarray(elongation, float)
        push = self.slack_ratio * self.specimen_force.slope(0.0) * np.minimum(u, 0.0)
        return self.specimen_force.value(np.maximum(u, 0.0)) + push


@dataclass(frozen=True)
class ShearLaw:
    """Shear stress against shear angle, odd in the angle.

    Attributes
    ----------
    stress
        tau [MPa] of gamma >= 0 [rad]; G12 is its derivative (Eqs. 9 and 10).
    valid_to
        End of the validity [rad].
    """

    stress: Law
    valid_to: float

    def shear_stress(self, angle: Floats | float) -> Floats:
        """tau [MPa] at a shear angle [rad] of either sign."""
        angle = np.asarray(angle, float)
        return np.sign(angle) * self.stress.value(np.abs(angle))

    def modulus(self, angle: Floats | float) -> Floats:
        """G12 [MPa] at a shear angle [rad] of either sign."""
        return self.stress.slope(np.abs(angle))


@dataclass(frozen=True)
class Fabric:
    """A fabric card with its laws.

    Examples
    --------
    >>> fabric = Fabric.load("hexforce-48600-c1300")
    >>> round(float(fabric.warp.force(3.9)))
    10992
    """

    card: FabricCard
    variant: str = ""
    source: str = ""

    @classmethod
    def load(
        cls, card: str | Path, *, variant: str = "", override: Mapping[str, Any] | None = None, near: Path | None = None
    ) -> Fabric:
        """Read a card by shipped name or file.

        Parameters
        ----------
        card
            A shipped name or the path of a TOML file (relative to ``near`` where given).
        variant
            Name of a tension variant of the card; empty for the card's own laws.
        override
            Tables merged over the card's, e.g. ``{"fabric": {"thickness_mm": 0.3}}``; a table with a ``law`` replaces.

        Raises
        ------
        CardError
            The card does not exist, is not valid, or a law is not usable (tension not rising, G12 negative).
        """
        shipped = shipped_cards()
        if str(card) in shipped:
            path = shipped[str(card)]
        else:
            path = Path(card)
            if near is not None and not path.is_absolute():
                path = near / path
            if not path.exists() and path.suffix != ".toml":
                raise CardError(
                    f'no card named "{card}"',
                    expected="a shipped card (" + ", ".join(shipped) + ") or a file ending in .toml",
                    hint="`weftform cards` lists the shipped cards",
                )
        values, text = read_toml(path, CardError)
        if override:
            values = merge_tables(values, override)
        model = validated(FabricCard, values, CardError, file=path, text=text)
        fabric = cls(card=model, variant=variant, source=str(card))
        try:
            fabric.check()
        except CardError as problem:
            if problem.file is None:
                problem.file = path
            raise CardError(
                problem.message,
                file=problem.file,
                key=problem.key,
                expected=problem.expected,
                got=problem.got,
                hint=problem.hint,
            ) from None
        return fabric

    @property
    def name(self) -> str:
        return self.card.name

    @property
    def thickness(self) -> float:
        """Thickness [mm]."""
        return self.card.fabric.thickness_mm

    @property
    def areal_density(self) -> float:
        """Mass per area [tonne / mm2]."""
        return self.card.fabric.areal_weight_g_m2 * 1.0e-12

    def _pair(self) -> TensionPair:
        if not self.variant:
            return self.card.tension
        try:
            return self.card.tension.variants[self.variant]
        except KeyError:
            names = ", ".join(self.card.tension.variants) or "none"
            raise CardError(
                f'the card has no tension variant "{self.variant}"', key="tension.variants", expected=names
            ) from None

    def _tension(self, direction: Direction) -> TensionLaw:
        pair = self._pair()
        table: TensionTable = getattr(pair, direction)
        if table.same_as is not None:
            table = getattr(pair, table.same_as)
        return _tension_law(table)

    @cached_property
    def warp(self) -> TensionLaw:
        """Tension law along the warp."""
        return self._tension("warp")

    @cached_property
    def weft(self) -> TensionLaw:
        """Tension law along the weft."""
        return self._tension("weft")

    @cached_property
    def shear(self) -> ShearLaw:
        """In-plane shear law."""
        table = self.card.shear
        end = np.radians(table.valid_to_deg)
        if table.law == "constant":
            assert table.modulus_MPa is not None
            return ShearLaw(LinearLaw(table.modulus_MPa), end)
        per_thickness = 1.0 / self.thickness if table.quantity == "normalised-shear-force" else 1.0
        law: Law
        if table.law == "polynomial":
            assert table.coefficients is not None
            powers = np.asarray(table.coefficients)
            if table.quantity == "shear-modulus":
                powers = powers / np.arange(1, len(powers) + 1)
            law = PolynomialLaw(tuple(powers), end)
        else:
            assert table.shear_angle_deg is not None and table.values is not None
            law = TabulatedLaw(tuple(np.radians(table.shear_angle_deg)), tuple(table.values))
            end = law.valid_to
        return ShearLaw(Scaled(law, factor_y=per_thickness), end)

    def normalised_shear_force(self, angle: Floats | float) -> Floats:
        """F_sh [N/mm] at a shear angle [rad]: thickness times shear stress (before Eq. 9)."""
        return self.thickness * self.shear.shear_stress(angle)

    @property
    def balanced(self) -> bool:
        """Whether warp and weft behave alike, so that a bias plane can be a plane of symmetry."""
        membrane = self.card.membrane
        return self.warp == self.weft and membrane.warp_modulus_MPa == membrane.weft_modulus_MPa

    def check(self) -> None:
        """Refuse laws that cannot describe a fabric.

        Raises
        ------
        CardError
            Tension that does not rise over its validity, or a shear modulus that is negative within its validity.
        """
        for direction, tension in (("warp", self.warp), ("weft", self.weft)):
            law = tension.specimen_force
            key = f"tension.{f'variants.{self.variant}.' if self.variant else ''}{direction}"
            upper = law.valid_to if np.isfinite(law.valid_to) else MOST_STRETCH * tension.length
            fall = first_fall(law, upper)
            if fall is not None:
                raise CardError(
                    f"the tension law of the {direction} is not monotone: the force falls between {fall.start:.3g} and "
                    f"{fall.end:.3g} mm",
                    key=key,
                    expected=f"a force that rises over 0-{upper:.3g} mm",
                    got=f"F({fall.start:.3g} mm) = {float(law.value(fall.start)):.4g} N, "
                    f"F({upper:.3g} mm) = {float(law.value(upper)):.4g} N",
                    hint="a yarn that softens is unstable; refit the law, or end its validity before the fall",
                )
            if float(law.value(0.0)) != 0.0:
                raise CardError(
                    f"the tension law of the {direction} does not pass through the origin",
                    key=key,
                    expected="no force at no elongation",
                    got=f"F(0) = {float(law.value(0.0)):.4g} N",
                    hint="leave out constant_N",
                )
        shear = self.shear
        fall = first_fall(shear.stress, shear.valid_to)
        if fall is not None:
            raise CardError(
                f"the shear modulus is negative between {np.degrees(fall.start):.3g} and {np.degrees(fall.end):.3g} degrees",
                key="shear",
                expected=f"G12 >= 0 over 0-{np.degrees(shear.valid_to):.3g} degrees",
                got=f"G12 = {fall.steepest_fall:.4g} MPa at the worst",
                hint="end the validity (valid_to_deg) before the fall, or refit",
            )


def merge_tables(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Merge nested tables; a table that brings its own ``law`` replaces the one it stands for."""
    merged = dict(base)
    for key, value in over.items():
        old = merged.get(key)
        if isinstance(value, Mapping) and isinstance(old, Mapping) and "law" not in value:
            merged[key] = merge_tables(old, value)
        else:
            merged[key] = dict(value) if isinstance(value, Mapping) else value
    return merged


def _tension_law(table: TensionTable) -> TensionLaw:
    assert table.specimen_length_mm is not None and table.specimen_width_mm is not None
    law: Law
    if table.law == "polynomial":
        assert table.coefficients is not None and table.valid_to_mm is not None
        law = PolynomialLaw(tuple(table.coefficients), table.valid_to_mm, table.constant_N)
    elif table.law == "linear":
        assert table.stiffness_N_per_mm is not None
        law = LinearLaw(table.stiffness_N_per_mm)
    elif table.law == "log-strain":
        assert table.stiffness_N_per_mm is not None
        law = LogStrainLaw(table.stiffness_N_per_mm, table.specimen_length_mm)
    else:
        assert table.displacement_mm is not None and table.force_N is not None
        law = TabulatedLaw(tuple(table.displacement_mm), tuple(table.force_N))
    return TensionLaw(law, table.specimen_length_mm, table.specimen_width_mm, table.slack_ratio)
