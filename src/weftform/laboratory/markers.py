"""Marker tracking on a bias-extension specimen: shear angles zone by zone (Sec. 2.3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from weftform.declared import read_toml, validated
from weftform.errors import MeasurementError
from weftform.fabric.card import Declared
from weftform.fabric.laws import Floats
from weftform.laboratory.presets import Quantity
from weftform.laboratory.specimen import Reading
from weftform.laboratory.table import MeasuredTable, read_table

Zone = Literal["A", "B", "C"]
Half = Literal["upper", "lower", "centre"]
Axis = Literal["x", "y"]


class Quadruple(Declared):
    """Four markers at the corners of a rhombus whose sides lie along the yarns, named in order around it.

    ``zone`` is A (at the clamp, undeformed), B (centre, pure shear) or C (half shear); ``half`` of the
    specimen.
    """

    name: Annotated[str, Field(min_length=1)]
    zone: Zone
    half: Half = "centre"
    markers: Annotated[list[str], Field(min_length=4, max_length=4)]


class MarkerLayout(Declared):
    """The quadruples of a specimen: a TOML file of ``[[quadruple]]`` tables."""

    quadruple: Annotated[list[Quadruple], Field(min_length=1)]


def read_layout(file: Path | str) -> MarkerLayout:
    """Read and check a layout file.

    Raises
    ------
    MeasurementError
        Not TOML, unknown keys, or a quadruple that names a marker twice.
    """
    path = Path(file)
    values, text = read_toml(path, MeasurementError)
    layout = validated(MarkerLayout, values, MeasurementError, file=path, text=text)
    for quad in layout.quadruple:
        if len(set(quad.markers)) < 4:
            raise MeasurementError(
                f'quadruple "{quad.name}" names a marker twice',
                file=path,
                expected="four different markers",
                got=", ".join(quad.markers),
            )
    return layout


@dataclass(frozen=True, eq=False)
class ZoneAngles:
    """Shear angle of a zone over the images of a test [deg], shape [images]; NaN where no quadruple was seen.

    ``deviation`` is the standard deviation between quadruples (NaN for one), ``count`` how many were seen.
    """

    mean: Floats
    deviation: Floats
    count: np.ndarray


@dataclass(frozen=True, eq=False)
class MarkerTracking:
    """Shear angles of all quadruples.

    Attributes
    ----------
    file, sha256
        Where the positions came from.
    images
        Names, in the order of the file.
    displacement
        Of the crosshead per image [mm], shape [images].
    quadruples
        What was tracked, ``q`` of them.
    angles
        Shear angles [deg], shape [images, q]; NaN where too many markers were lost.
    warnings
        Which markers were lost, and what was done.
    """

    file: Path
    sha256: str
    images: tuple[str, ...]
    displacement: Floats
    quadruples: tuple[Quadruple, ...]
    angles: Floats
    warnings: tuple[str, ...]

    def zones(self) -> tuple[Zone, ...]:
        """Zones with a quadruple."""
        return tuple(z for z in ("A", "B", "C") if any(q.zone == z for q in self.quadruples))  # type: ignore[misc]

    def zone(self, zone: Zone, half: Half | None = None) -> ZoneAngles:
        """Mean and scatter of a zone, of one half of the specimen where ``half`` is given.

        Raises
        ------
        MeasurementError
            No quadruple there.
        """
        chosen = [k for k, q in enumerate(self.quadruples) if q.zone == zone and half in (None, q.half)]
        if not chosen:
            raise MeasurementError(
                f"no quadruple in zone {zone}" + (f", {half} half" if half else ""),
                file=self.file,
                got=", ".join(f"{q.name} ({q.zone}, {q.half})" for q in self.quadruples),
            )
        values = self.angles[:, chosen]
        seen = np.isfinite(values)
        count = seen.sum(axis=1)
        total = np.where(seen, values, 0.0).sum(axis=1)
        mean = np.divide(total, count, out=np.full(len(values), np.nan), where=count > 0)
        squares = np.where(seen, (values - mean[:, None]) ** 2, 0.0).sum(axis=1)
        deviation = np.sqrt(np.divide(squares, count - 1, out=np.full(len(values), np.nan), where=count > 1))
        return ZoneAngles(mean, deviation, count)


def corner_angle(before: Floats, corner: Floats, after: Floats) -> Floats:
    """Angle [rad] at ``corner`` between two neighbours, by the law of cosines from the three distances.

    Parameters
    ----------
    before, corner, after
        Positions, shape [..., 2 or 3]; NaN where a marker is lost, which makes the angle NaN.
    """
    a = np.linalg.norm(before - corner, axis=-1)
    b = np.linalg.norm(after - corner, axis=-1)
    c = np.linalg.norm(after - before, axis=-1)
    product = 2.0 * a * b
    cosine = np.divide(a**2 + b**2 - c**2, product, out=np.full(np.shape(product), np.nan), where=product > 0.0)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def quadruple_angles(corners: Floats, pull: Axis = "y") -> Floats:
    """Shear angle [rad] of a quadruple over the images, shape [images].

    At each corner the change of the angle since the first image; corners on the diagonal nearer to the pull
    close, the others open by as much. The mean is taken over the corners that can be seen: one lost marker
    leaves the corner opposite to it.

    Parameters
    ----------
    corners
        Positions [mm], shape [images, 4, 2 or 3], in order around the quadruple; NaN where lost.
    pull
        Direction of the pull in these coordinates.
    """
    angles = np.stack(
        [corner_angle(corners[:, k - 1], corners[:, k], corners[:, (k + 1) % 4]) for k in range(4)], axis=1
    )
    first = corners[0]
    axis = 1 if pull == "y" else 0

    def along(diagonal: Floats) -> float:
        return float(abs(diagonal[axis]) / np.linalg.norm(diagonal))

    even, odd = along(first[2] - first[0]), along(first[3] - first[1])
    sign = np.array([1.0, -1.0, 1.0, -1.0]) * (1.0 if even >= odd else -1.0)
    change = sign * (angles[0] - angles)
    seen = np.isfinite(change)
    count = seen.sum(axis=1)
    total = np.where(seen, change, 0.0).sum(axis=1)
    return np.asarray(np.divide(total, count, out=np.full(len(change), np.nan), where=count > 0))


def track_markers(
    positions: Path | str,
    layout: Path | str | MarkerLayout,
    *,
    displacements: Path | str | None = None,
    pull: Axis = "y",
    reading: Reading = Reading(),  # noqa: B008 (frozen)
) -> MarkerTracking:
    """Shear angles from a table of marker positions.

    Parameters
    ----------
    positions
        One row per image and marker: ``image``, ``marker``, ``x_mm``, ``y_mm``, ``z_mm`` where
        triangulated, and ``displacement_mm`` of the crosshead unless ``displacements`` has it. A lost
        marker has no row or no coordinates.
    layout
        The quadruples, or the TOML file with them.
    displacements
        Table of ``image`` and ``displacement_mm``.
    pull
        Axis of the pull.

    Raises
    ------
    MeasurementError
        The table cannot be read, an image has no displacement, a marker appears twice in an image, or no
        quadruple is complete in the first image.
    """
    if not isinstance(layout, MarkerLayout):
        layout = read_layout(layout)
    needed = [Quantity.IMAGE, Quantity.MARKER, Quantity.X, Quantity.Y]
    coordinates = [Quantity.X, Quantity.Y, Quantity.Z]
    table = read_table(
        positions,
        needed,
        optional=[Quantity.Z, Quantity.DISPLACEMENT],
        may_miss=coordinates,
        preset=reading.preset,
        columns=reading.columns,
        units=reading.units,
    )
    images = tuple(dict.fromkeys(table.names[Quantity.IMAGE]))
    travel = _displacements(table, images, displacements, reading)
    markers = sorted({m for q in layout.quadruple for m in q.markers})
    xyz = positions_by_image(table, images, markers)
    warnings = [*table.warnings, *_lost(table, images, markers, xyz)]
    order = np.argsort(travel, kind="stable")
    if (order != np.arange(len(order))).any():
        warnings.append(f"{table.file.name}: images sorted by displacement")
        images, travel, xyz = tuple(images[k] for k in order), travel[order], xyz[order]
    kept: list[Quadruple] = []
    columns: list[Floats] = []
    for quad in layout.quadruple:
        corners = xyz[:, [markers.index(m) for m in quad.markers]]
        gone = [m for m, c in zip(quad.markers, corners[0], strict=True) if not np.isfinite(c).all()]
        if gone:
            warnings.append(
                f"{table.file.name}: quadruple {quad.name} left out, marker {', '.join(gone)} is not in "
                f"image {images[0]}"
            )
            continue
        angle = np.degrees(quadruple_angles(corners, pull))
        unseen = int((~np.isfinite(angle)).sum())
        if unseen:
            warnings.append(f"{table.file.name}: quadruple {quad.name} cannot be measured in {unseen} images")
        kept.append(quad)
        columns.append(angle)
    if not kept:
        raise MeasurementError(
            "no quadruple is complete in the first image, which is the undeformed reference",
            file=table.file,
            line=int(table.lines[0]),
            expected="markers " + ", ".join(markers[:12]),
            got="; ".join(warnings)[:300],
        )
    return MarkerTracking(
        table.file, table.sha256, images, travel, tuple(kept), np.stack(columns, axis=1), tuple(warnings)
    )


def _displacements(table: MeasuredTable, images: tuple[str, ...], file: Path | str | None, reading: Reading) -> Floats:
    names: Sequence[str]
    if file is not None:
        given = read_table(file, [Quantity.IMAGE, Quantity.DISPLACEMENT], columns=reading.columns, units=reading.units)
        names, values = given.names[Quantity.IMAGE], given.values[Quantity.DISPLACEMENT]
        source = given.file
    elif Quantity.DISPLACEMENT in table.values:
        names, values, source = table.names[Quantity.IMAGE], table.values[Quantity.DISPLACEMENT], table.file
    else:
        raise MeasurementError(
            "the displacement of the crosshead in each image is not known",
            file=table.file,
            expected="a column displacement_mm, or a table of image and displacement_mm",
        )
    known = dict(zip(names, values, strict=True))
    missing = [i for i in images if i not in known]
    if missing:
        raise MeasurementError(
            f"{len(missing)} images have no displacement",
            file=source,
            got=", ".join(missing[:8]),
            expected="one per image",
        )
    return np.array([known[i] for i in images], float)


def positions_by_image(table: MeasuredTable, images: Sequence[str], markers: Sequence[str]) -> Floats:
    """Positions of markers [mm], shape [images, markers, 2 or 3]; NaN where a marker is lost.

    A table without a column of images is one image, whatever its name.

    Raises
    ------
    MeasurementError
        A marker stands twice in an image.
    """
    spatial = Quantity.Z in table.values
    axes = [Quantity.X, Quantity.Y, *([Quantity.Z] if spatial else [])]
    xyz = np.full((len(images), len(markers), len(axes)), np.nan)
    where_image = {name: k for k, name in enumerate(images)}
    where_marker = {name: k for k, name in enumerate(markers)}
    filled: set[tuple[int, int]] = set()
    named = table.names[Quantity.MARKER]
    shown = table.names.get(Quantity.IMAGE, (images[0],) * len(named))
    for row, (image, marker) in enumerate(zip(shown, named, strict=True)):
        if marker not in where_marker:
            continue
        place = (where_image[image], where_marker[marker])
        if place in filled:
            raise MeasurementError(
                f"marker {marker} appears twice" + (f" in image {image}" if Quantity.IMAGE in table.names else ""),
                file=table.file,
                line=int(table.lines[row]),
                expected="one row per marker and image",
            )
        filled.add(place)
        xyz[place] = [table.values[a][row] for a in axes]
    xyz[~np.isfinite(xyz).all(axis=-1)] = np.nan
    return xyz


def _lost(table: MeasuredTable, images: tuple[str, ...], markers: list[str], xyz: Floats) -> list[str]:
    warnings = []
    for k, marker in enumerate(markers):
        gone = np.flatnonzero(~np.isfinite(xyz[:, k]).all(axis=-1))
        if len(gone) == len(images):
            raise MeasurementError(
                f"marker {marker} of the layout is in no image",
                file=table.file,
                got="markers " + ", ".join(sorted(set(table.names[Quantity.MARKER]))[:20]),
                hint="do the names of the layout match those of the file?",
            )
        if len(gone):
            shown = ", ".join(images[i] for i in gone[:5]) + (f" and {len(gone) - 5} more" if len(gone) > 5 else "")
            warnings.append(
                f"{table.file.name}: marker {marker} lost in {len(gone)} of {len(images)} images ({shown}); "
                "angles there come from the corners still seen"
            )
    return warnings
