"""A study: a declared problem, read from TOML, checked, and turned into what the solver needs."""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from shapely.geometry import Polygon

from weftform.blank import YarnGrid, build_grid, disc, polygon, rectangle
from weftform.declared import line_of, read_toml, validated
from weftform.errors import CardError, StudyError
from weftform.fabric import Fabric
from weftform.fabric.fabric import merge_tables
from weftform.study.schema import (
    MODELS,
    BiasModel,
    BlankTable,
    Common,
    ContactTable,
    ElementModel,
    FormingModel,
    FrameModel,
    StudyModel,
    TensileModel,
    ToolTable,
)
from weftform.study.shipped import shipped_studies
from weftform.study.specimens import specimen_grid
from weftform.tooling import RigidTool, flat_punch, hemisphere, opening

PLANES = {"full": (), "half-x": ("x",), "half-y": ("y",), "quarter": ("x", "y")}


@dataclass(frozen=True)
class Study:
    """A checked study.

    Attributes
    ----------
    model
        What it says, defaults filled in.
    file
        Where it was read; cards are looked up next to it.
    """

    model: StudyModel
    file: Path | None = None

    @classmethod
    def load(cls, study: str | Path, changes: Iterable[str] | Mapping[str, Any] = ()) -> Study:
        """Read a study by shipped name or file.

        Parameters
        ----------
        study
            A shipped name (``weftform studies``) or the path of a TOML file.
        changes
            ``dotted.key=value`` texts, or a mapping of dotted keys to values. A card's file is looked for from the
            current folder here, and next to the study where the study itself names it.

        Raises
        ------
        StudyError, CardError
            With file, line and key of the first problem.
        """
        shipped = shipped_studies()
        path = shipped[str(study)] if str(study) in shipped else Path(study)
        if not path.exists() and path.suffix != ".toml":
            close = difflib.get_close_matches(str(study), shipped, 1, 0.5)
            raise StudyError(
                f'no study named "{study}"',
                expected="a shipped study (" + ", ".join(shipped) + ") or a file ending in .toml",
                hint=f"did you mean {close[0]}?"
                if close
                else "`weftform studies` lists the shipped studies, `weftform new` writes one to start from",
            )
        values, text = read_toml(path, StudyError)
        pairs = list(changes.items()) if isinstance(changes, Mapping) else [_split_change(c) for c in changes]
        for key, value in pairs:
            values = _changed(values, key.split("."), _from_here(key, value))
        try:
            made = cls(_validated(values, path, text), path.resolve())
            made.check()
        except (StudyError, CardError) as problem:
            raise _placed(problem, path, text, dict(pairs)) from None
        return made

    def check(self) -> None:
        """Build everything that a run would build, so that what cannot work is refused before anything is written."""
        self.fabric  # noqa: B018
        if isinstance(self.model, FormingModel):
            self._check_symmetry(self.model.blank)
        self.grid  # noqa: B018
        if isinstance(self.model, FormingModel):
            self._check_tools(self.model)

    @property
    def name(self) -> str:
        return self.model.name

    @cached_property
    def fabric(self) -> Fabric:
        """The fabric, with the variant and changes that the study asks for."""
        choice = self.model.fabric
        near = self.file.parent if self.file is not None else None
        return Fabric.load(choice.card, variant=choice.tension_variant, override=choice.override, near=near)

    @cached_property
    def outline(self) -> Polygon:
        """Declared outline of the blank or specimen in its plane [mm]."""
        model = self.model
        if isinstance(model, FormingModel):
            return _outline(model.blank)
        if isinstance(model, ElementModel):
            return rectangle(model.element.side_mm, model.element.side_mm)
        if isinstance(model, FrameModel):
            return rectangle(model.specimen.fabric_side_mm, model.specimen.fabric_side_mm)
        if isinstance(model, TensileModel) and model.specimen.direction == "warp":
            return rectangle(model.specimen.length_mm, model.specimen.width_mm)
        if isinstance(model, (TensileModel, BiasModel)):
            return rectangle(model.specimen.width_mm, model.specimen.length_mm)
        return rectangle(model.specimen.warp_length_mm, model.specimen.weft_length_mm)

    @cached_property
    def grid(self) -> YarnGrid:
        """The yarn grid that covers the outline."""
        if not isinstance(self.model, FormingModel):
            return specimen_grid(self.model, self.outline)
        blank = self.model.blank
        return build_grid(
            self.outline,
            cell_length=blank.cell_length_mm,
            warp_angle=math.radians(blank.warp_angle_deg),
            planes=PLANES[blank.symmetry],
            fitted=blank.fit_cells,
        )

    @cached_property
    def tools(self) -> tuple[RigidTool, ...]:
        """Rigid tools in the order of the study; none in a laboratory test."""
        if not isinstance(self.model, FormingModel):
            return ()
        contact = self.model.contact
        return tuple(self._tool(name, table, contact[name]) for name, table in self.model.tools.items())

    def _tool(self, name: str, table: ToolTable, contact: ContactTable) -> RigidTool:
        thickness = self.fabric.thickness
        up = 1.0 if table.side == "below" else -1.0
        if table.shape == "hemisphere":
            assert table.diameter_mm is not None
            shape = hemisphere(table.diameter_mm, thickness, up)
        elif table.shape == "flat-punch":
            assert table.diameter_mm is not None and table.edge_radius_mm is not None
            shape = flat_punch(table.diameter_mm, table.edge_radius_mm, thickness, up)
        else:
            assert table.hole_diameter_mm is not None and table.edge_radius_mm is not None
            shape = opening(table.hole_diameter_mm, table.edge_radius_mm, thickness, up)
        return RigidTool(
            name,
            *shape,
            up=up,
            motion=table.motion,
            friction=contact.friction,
            stiffness=contact.stiffness_N_per_mm3,
            tangential_ratio=contact.tangential_ratio,
            force=table.force_N or 0.0,
            mass=table.mass_kg * 1e-3 if table.mass_kg else None,
        )

    def _check_symmetry(self, blank: BlankTable) -> None:
        eighths = blank.warp_angle_deg / 45.0
        odd = abs(eighths - round(eighths)) < 1e-9 and round(eighths) % 2 == 1
        if blank.symmetry != "full" and odd and not self.fabric.balanced:
            raise StudyError(
                "an unbalanced fabric at 45 degrees has no plane of symmetry: its mirror image has warp and weft exchanged",
                key="blank.symmetry",
                expected='"full", or a fabric whose warp and weft are alike',
                got=f'"{blank.symmetry}"',
            )

    def _check_tools(self, model: FormingModel) -> None:
        # a blank that does not cover the axis has no edge around the hole at all
        nearest = self.outline.exterior.distance(_origin()) if self.outline.contains(_origin()) else 0.0
        for name, table in model.tools.items():
            hole = table.hole_diameter_mm
            if hole is None or table.edge_radius_mm is None:
                continue
            if nearest <= 0.5 * hole + table.edge_radius_mm:
                raise StudyError(
                    f"the blank is smaller than the hole of the {name.replace('_', ' ')}",
                    key="blank",
                    expected=f"an edge more than {0.5 * hole + table.edge_radius_mm:g} mm from the axis everywhere",
                    got=f"{nearest:g} mm",
                )
            for other, punch in model.tools.items():
                if punch.motion != "stroke" or punch.diameter_mm is None:
                    continue
                # a ring around the punch, or an opening that it enters with the fabric on both sides
                within = punch.side == table.side
                needed = punch.diameter_mm + (0.0 if within else 2.0 * self.fabric.thickness)
                if hole < needed:
                    raise StudyError(
                        f"the {other} does not fit through the {name}"
                        + ("" if within else " with the fabric between them"),
                        key=f"tools.{name}.hole_diameter_mm",
                        expected=f"at least {needed:g} mm for the diameter of {punch.diameter_mm:g} mm",
                        got=f"{hole:g} mm",
                    )

    def to_toml(self, header: str = "") -> str:
        """The study as TOML with every default written out, cards given by path made absolute."""
        import tomlkit

        values = self.model.model_dump(mode="json", exclude_none=True)
        if self.file is not None and self.model.fabric.card.endswith(".toml"):
            values["fabric"]["card"] = str((self.file.parent / self.model.fabric.card).resolve())
        text = tomlkit.dumps(values)
        return "".join(f"# {line}\n" for line in header.splitlines()) + text


def _validated(values: dict[str, Any], path: Path, text: str) -> StudyModel:
    """The tables checked against the model of their kind."""
    kind = values.get("kind")
    if not isinstance(kind, str) or kind not in MODELS:
        close = difflib.get_close_matches(str(kind), MODELS, 1, 0.4)
        raise StudyError(
            "kind is missing" if kind is None else "no such kind of study",
            file=path,
            line=line_of(text, ("kind",)),
            key="kind",
            expected="one of " + ", ".join(MODELS),
            got=None if kind is None else repr(kind),
            hint=f"did you mean {close[0]}?" if close else None,
        )
    model: Common = validated(MODELS[kind], values, StudyError, file=path, text=text)
    return model  # type: ignore[return-value]


def _origin() -> Any:
    from shapely.geometry import Point

    return Point(0.0, 0.0)


def _outline(blank: BlankTable) -> Polygon:
    if blank.outline == "rectangle":
        assert blank.width_mm is not None and blank.height_mm is not None
        return rectangle(blank.width_mm, blank.height_mm)
    if blank.outline == "disc":
        assert blank.diameter_mm is not None
        return disc(blank.diameter_mm)
    assert blank.points_mm is not None
    shape = polygon(list(blank.points_mm))
    if not shape.is_valid or shape.area <= 0.0:
        from shapely.validation import explain_validity

        raise StudyError(
            f"the polygon is not a simple outline ({explain_validity(shape)})",
            key="blank.points_mm",
            hint="list the corners once, in order around the blank",
        )
    return shape


def _split_change(change: str) -> tuple[str, Any]:
    key, equals, value = change.partition("=")
    if not equals or not key.strip():
        raise StudyError(
            "a change must be of the form dotted.key=value",
            got=change,
            hint="for example blank.warp_angle_deg=45",
        )
    try:
        return key.strip(), tomllib.loads(f"value = {value.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()


def _from_here(key: str, value: Any) -> Any:
    """The value of a change; the file of a card as the shell or script that gives it sees it."""
    if key == "fabric.card" and isinstance(value, str | Path) and str(value).endswith(".toml"):
        return str(Path(value).absolute())
    return value


def _changed(values: dict[str, Any], path: list[str], value: Any) -> dict[str, Any]:
    """A copy of nested tables with one dotted key changed; the keys themselves are checked with the whole study."""
    nested: Any = value
    for part in reversed(path[1:]):
        nested = {part: nested}
    if len(path) == 1:
        return {**values, path[0]: value}
    if path[0] in values and not isinstance(values[path[0]], Mapping):
        raise StudyError(f"{path[0]} is a value, not a table", key=".".join(path))
    return merge_tables(values, {path[0]: nested})


def _brought(change: str, value: Any, problem: StudyError | CardError) -> bool:
    """Whether a change has brought the key that a problem is about."""
    if not problem.key:
        return change == "fabric.card" and isinstance(problem, CardError) and problem.file is None
    if isinstance(problem, CardError) and problem.file is not None:
        # a key of the card, which the study may override
        place = ("fabric", "override", *problem.key.split("."))
        return place[:2] == tuple(change.split(".")[:2]) and _holds(value, place, change.split("."))
    # a table that nobody knows has no line in the study either
    unknown = problem.message.startswith("unknown key") and change.startswith(f"{problem.key}.")
    return unknown or f"{problem.key}.".startswith(f"{change}.")


def _holds(value: Any, place: tuple[str, ...], change: list[str]) -> bool:
    """Whether a change of ``change`` to ``value`` sets ``place`` or something in it."""
    if len(change) >= len(place):
        return tuple(change[: len(place)]) == place
    if tuple(change) != place[: len(change)]:
        return False
    for part in place[len(change) :]:
        if not isinstance(value, Mapping) or part not in value:
            return False
        value = value[part]
    return True


def _placed(
    problem: StudyError | CardError, path: Path, text: str, changes: Mapping[str, Any]
) -> StudyError | CardError:
    """The same error with its place: the change that it is about, or else the file and line of a key of the study."""
    change = next((key for key, value in changes.items() if _brought(key, value, problem)), None)
    if problem.file is not None and Path(problem.file) != path and change is None:
        return problem
    place: Path | str | None = problem.file
    line = problem.line
    if change is not None:
        place, line = f"change {change}={changes[change]}", None
    elif place is None:
        place, line = path, line_of(text, tuple(problem.key.split("."))) if problem.key else None
    return type(problem)(
        problem.message,
        file=place,
        line=line,
        key=problem.key,
        expected=problem.expected,
        got=problem.got,
        hint=problem.hint,
    )
