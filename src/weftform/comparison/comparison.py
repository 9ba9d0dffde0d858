"""One comparison of a result with measurements: what is laid over what, the numbers, and the verdicts."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from weftform.comparison.angles import AngleComparison, compare_angles
from weftform.comparison.curves import CurveComparison, compare_curves
from weftform.comparison.gaps import OutlineGap, outline_gap
from weftform.comparison.markers import (
    MarkerComparison,
    MeasuredMarkers,
    compare_markers,
    material_points,
    read_markers,
)
from weftform.comparison.outline import MeasuredOutline, Ring, read_outline
from weftform.comparison.placement import Placement
from weftform.comparison.registration import register_markers, register_outline
from weftform.comparison.tolerance import Tolerance, Verdict, tolerances_from, verdict
from weftform.errors import MeasurementError, ResultError
from weftform.laboratory.specimen import Reading
from weftform.result import Result
from weftform.result.writer import write_whole

ITEMS = ("outline", "angles", "curve", "markers")
"""What can be compared."""
LIKE_SIZES = 1.5
"""Ratio of the lengths of two outlines beyond which a unit is likely to be wrong."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """A result beside measurements of the formed part.

    Attributes
    ----------
    result
        What was simulated.
    frame
        Index of the compared instant.
    placement
        Where the measured axes lie in those of the press.
    measured_outline, outline
        The outline as measured and its gaps; None where it was not compared, like the others.
    angles, curve, markers
        Shear angles, forces and markers.
    verdicts
        One per tolerance.
    warnings
        What was done, and what to look at.
    """

    result: Result
    frame: int
    placement: Placement
    measured_outline: MeasuredOutline | None
    outline: OutlineGap | None
    angles: AngleComparison | None
    curve: CurveComparison | None
    markers: MarkerComparison | None
    verdicts: tuple[Verdict, ...]
    warnings: tuple[str, ...]

    @property
    def ok(self) -> bool | None:
        """Whether all tolerances are kept; None where none was given."""
        return all(v.ok for v in self.verdicts) if self.verdicts else None

    @property
    def stroke_mm(self) -> float:
        """Stroke of the compared instant [mm]."""
        return float(self.result.strokes[self.frame])

    def tolerance(self, name: str) -> Tolerance | None:
        """The tolerance of a name, where it was given."""
        return next((v.tolerance for v in self.verdicts if v.tolerance.name == name), None)

    def as_dict(self) -> dict[str, Any]:
        """What ``comparison.json`` holds."""
        return {
            "result": str(self.result.folder),
            "study": self.result.study.name,
            "stroke_mm": self.stroke_mm,
            "ok": self.ok,
            "verdicts": [v.as_dict() for v in self.verdicts],
            "registration": self.placement.as_dict(),
            **_items(self.measured_outline, self.outline, self.angles, self.curve, self.markers),
            "warnings": list(self.warnings),
        }

    def to_json(self) -> str:
        """``comparison.json`` as text."""
        return json.dumps(self.as_dict(), indent=2, allow_nan=False)

    def write(self, folder: Path | str | None = None, *, figures: bool = True) -> list[Path]:
        """Write ``comparison.json`` and the figures; figures of a former comparison there go.

        Parameters
        ----------
        folder
            Where to; ``comparison`` in the result folder without.

        Raises
        ------
        ResultError
            The folder cannot be written.
        """
        folder = self.result.folder / "comparison" if folder is None else Path(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for item in ITEMS:
                (folder / f"{item}.png").unlink(missing_ok=True)
            write_whole(folder / "comparison.json", self.to_json() + "\n")
        except OSError as problem:
            raise ResultError(
                f"cannot be written ({problem.strerror})", file=folder, hint="choose another with --out"
            ) from None
        written = [folder / "comparison.json"]
        if figures:
            from weftform.comparison.figures import write_figures

            written += write_figures(self, folder)
        return written


def compare(
    result: Result | Path | str,
    *,
    outline: Path | str | None = None,
    angles: Path | str | None = None,
    curve: Path | str | Sequence[Path | str] = (),
    markers: Path | str | None = None,
    stroke: float | None = None,
    scale: bool = False,
    register_by: str | None = None,
    signed_angles: bool = False,
    tolerances: Mapping[str, float | str] | None = None,
    readings: Mapping[str, Reading] | None = None,
) -> Comparison:
    """Compare a result with measurements of the formed part (Sec. 5, Figs. 15, 16).

    Parameters
    ----------
    result
        A result or its folder.
    outline
        Table of the points around the part, see :func:`weftform.comparison.outline.read_outline`.
    angles
        Table of shear angles at points, see :func:`weftform.comparison.angles.compare_angles`.
    curve
        Tables of displacement and force, one or several specimens.
    markers
        Table of marker positions, see :func:`weftform.comparison.markers.read_markers`.
    stroke
        Compare the computed instant nearest to this stroke [mm]; the end without. Forces are compared over their whole
        way.
    scale
        Find a scale of the measured axes as well as turn and shift.
    register_by
        What places the measured axes, which all files share: ``outline``, ``markers`` or ``none``. Without, the
        outline where there is one, else the markers.
    signed_angles
        Compare shear angles with their signs, not their sizes.
    tolerances
        Limits by name, see :data:`weftform.comparison.tolerance.LIMITED`; ``{"outline": 2.0, "curve": "5 %"}``.
    readings
        How the files are read, by item (``outline``, ``angles``, ``curve``, ``markers``).

    Raises
    ------
    MeasurementError
        A file or tolerance cannot be used, or nothing was given to compare.
    ResultError
        The result cannot be read, or that stroke was not computed.

    Examples
    --------
    >>> from weftform import compare
    >>> found = compare("results/first", outline="measured.csv", tolerances={"outline": 2})  # doctest: +SKIP
    >>> found.outline.hausdorff, found.ok  # doctest: +SKIP
    """
    curves = [curve] if isinstance(curve, str | Path) else list(curve)
    limits = tolerances_from(tolerances or {})
    given = {
        "outline": outline is not None,
        "angles": angles is not None,
        "curve": curves,
        "markers": markers is not None,
    }
    _refuse_idle(given, limits)
    opened = result if isinstance(result, Result) else Result.open(result)
    frame = opened.frame_at(stroke)
    read = {item: (readings or {}).get(item, Reading()) for item in ITEMS}
    measured = read_outline(outline, read["outline"]) if outline is not None else None
    seen = read_markers(markers, float(opened.strokes[frame]), read["markers"]) if markers is not None else None
    way = _way(register_by, measured, seen)
    if scale and way == "none":
        raise MeasurementError(
            "a scale can be found only where the measured axes are placed",
            key="--scale",
            expected="an outline or two markers at least, and a registration",
        )
    edge = opened.outline(frame)[1][:-1, :2]
    if not np.isfinite(edge).all():
        raise ResultError("the formed part has no outline at that stroke: the run blew up", file=opened.folder)
    simulated = Ring(edge)
    warnings = [*_result_notes(opened)]
    placement = Placement()
    if way == "outline" and measured is not None:
        placement = register_outline(measured.ring, simulated, scale=scale)
    yarn = places = None
    if seen is not None:
        yarn = material_points(seen, opened, placement if way != "markers" else None)
        places = np.array([p.position_mm for p in opened.probe([(float(u), float(v)) for u, v in yarn], stroke)])
        if way == "markers":
            placement = register_markers(seen.formed, places, scale=scale)
    gap = None
    if measured is not None:
        gap = outline_gap(Ring(placement.apply(measured.ring.points)), simulated)
        warnings += [*measured.warnings, *_outline_notes(gap, placement, scale)]
    compared = None
    if seen is not None and yarn is not None and places is not None:
        compared = compare_markers(seen, yarn, places, placement)
        warnings += compared.warnings
    at_points = None
    if angles is not None:
        at_points = compare_angles(
            opened, angles, placement, stroke=stroke, signed=signed_angles, reading=read["angles"]
        )
        warnings += at_points.warnings
    forces = compare_curves(opened, curves, read["curve"]) if curves else None
    if forces is not None:
        warnings += forces.warnings
    items = _items(measured, gap, at_points, forces, compared)
    verdicts = tuple(verdict(limit, items) for limit in limits)
    return Comparison(
        opened, frame, placement, measured, gap, at_points, forces, compared, verdicts, tuple(dict.fromkeys(warnings))
    )


def _refuse_idle(given: Mapping[str, Any], limits: Sequence[Tolerance]) -> None:
    """Refuse a comparison of nothing, and a tolerance on what is not compared: it would never be checked."""
    if not any(given.values()):
        raise MeasurementError(
            "nothing to compare with",
            expected="one at least of --outline, --angles, --curve and --markers",
            hint="weftform compare --help",
        )
    for limit in limits:
        if not given[limit.limited.item]:
            raise MeasurementError(
                f"the {limit.limited.what} is limited and not compared",
                key=f"--tolerance {limit.name}",
                expected=f"--{limit.limited.item} FILE as well",
            )


def _way(register_by: str | None, outline: MeasuredOutline | None, markers: MeasuredMarkers | None) -> str:
    """What places the measured axes."""
    count = 0 if markers is None else len(markers.names)
    if register_by is None:
        return "outline" if outline is not None else "markers" if count > 1 and markers.material is not None else "none"  # type: ignore[union-attr]
    if register_by not in ("outline", "markers", "none"):
        raise MeasurementError("no such way of registration", expected="outline, markers or none", got=register_by)
    if register_by == "outline" and outline is None:
        raise MeasurementError("there is no outline to place the measured axes by", expected="--outline FILE")
    if register_by == "markers" and count < 2:
        raise MeasurementError(
            "two markers at least place the measured axes", expected="--markers FILE", got=f"{count} markers"
        )
    return register_by


def _items(
    measured: MeasuredOutline | None,
    gap: OutlineGap | None,
    angles: AngleComparison | None,
    curve: CurveComparison | None,
    markers: MarkerComparison | None,
) -> dict[str, Any]:
    items: dict[str, Any] = {}
    if measured is not None and gap is not None:
        items["outline"] = {
            "file": str(measured.file),
            "sha256": measured.sha256,
            "points": len(measured.ring.points),
            **gap.as_dict(),
        }
    for name, found in (("angles", angles), ("curve", curve), ("markers", markers)):
        if found is not None:
            items[name] = found.as_dict()
    return items


def _result_notes(result: Result) -> list[str]:
    if (result.folder / "summary.json").exists():
        if not result.summary.get("ok", True):
            return ["the run did not pass its own checks of quality (see summary.json)"]
        return []
    return ["the run has no summary: it did not reach its end"]


def _outline_notes(gap: OutlineGap, placement: Placement, scale: bool) -> list[str]:
    notes = []
    ratio = gap.measured.line.length / gap.simulated.line.length
    if not scale and not 1.0 / LIKE_SIZES < ratio < LIKE_SIZES:
        notes.append(f"the measured outline is {ratio:.3g} times as long as the simulated one: is its unit right?")
    if not placement.turn_known:
        notes.append("the outline is round, so it does not say how the measured axes are turned")
    elif placement.as_good_deg:
        others = ", ".join(f"{turn:.3g}" for turn in sorted(placement.as_good_deg))
        notes.append(
            f"the outline fits as well turned by {others} degrees; the smallest turn was taken "
            f"({placement.turn_deg:.3g} degrees)"
        )
    return notes
