"""Markers on the cloth: where they were found after forming, and where the simulation takes their material points."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from weftform.comparison.angles import refuse_outside
from weftform.comparison.placement import Placement
from weftform.errors import MeasurementError
from weftform.laboratory.markers import positions_by_image
from weftform.laboratory.presets import FORMED, Quantity
from weftform.laboratory.specimen import Reading
from weftform.laboratory.table import MeasuredTable, read_table

if TYPE_CHECKING:
    from weftform.result import Result

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeasuredMarkers:
    """Markers as measured, in their own axes.

    Attributes
    ----------
    table
        As read.
    names
        Markers seen after forming, n of them.
    rows
        Row of the table of each, shape [n].
    formed
        Positions after forming [mm], shape [n, 2 or 3].
    material
        Material points (U, V) [mm], shape [n, 2]; None where the table has none.
    flat
        Positions in the first image, before forming [mm], shape [n, 2]; None where there is one image only.
    image
        The image that shows the formed part; None where the table has no images.
    warnings
        What was done.
    """

    table: MeasuredTable
    names: tuple[str, ...]
    rows: NDArray[np.int64]
    formed: Floats
    material: Floats | None
    flat: Floats | None
    image: str | None
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class MarkerComparison:
    """Measured markers and simulated material points.

    Attributes
    ----------
    file, sha256
        Where the markers came from.
    names
        Of the markers, n of them.
    yarn_mm
        Material points (U, V), shape [n, 2].
    measured, simulated
        Positions in the axes of the press [mm], shape [n, 2 or 3] and [n, 3].
    image
        The image that was compared.
    warnings
        What was done.
    """

    file: Path
    sha256: str
    names: tuple[str, ...]
    yarn_mm: Floats
    measured: Floats
    simulated: Floats
    image: str | None
    warnings: tuple[str, ...]

    @property
    def distances(self) -> Floats:
        """Between marker and material point [mm], shape [n]; in plan view where heights were not measured."""
        axes = self.measured.shape[1]
        return np.asarray(np.linalg.norm(self.simulated[:, :axes] - self.measured, axis=1))

    def as_dict(self) -> dict[str, Any]:
        """For ``comparison.json``."""
        distances = self.distances
        return {
            "file": str(self.file),
            "sha256": self.sha256,
            "image": self.image,
            "spatial": self.measured.shape[1] == 3,
            "markers": [
                {
                    "name": name,
                    "yarn_mm": [float(v) for v in yarn],
                    "measured_mm": [float(v) for v in measured],
                    "simulated_mm": [float(v) for v in simulated],
                    "distance_mm": float(distance),
                }
                for name, yarn, measured, simulated, distance in zip(
                    self.names, self.yarn_mm, self.measured, self.simulated, distances, strict=True
                )
            ],
            "distance_mm": {
                "max": float(distances.max()),
                "mean": float(distances.mean()),
                "rms": float(np.sqrt((distances**2).mean())),
                "at": self.names[int(distances.argmax())],
            },
        }


def read_markers(file: Path | str, stroke: float, reading: Reading = Reading()) -> MeasuredMarkers:  # noqa: B008
    """Read marker positions.

    Parameters
    ----------
    file
        Either one row per marker (``marker``, ``u_mm``, ``v_mm``, ``x_mm``, ``y_mm``, and ``z_mm`` where triangulated),
        or one per image and marker (``image`` as well, and ``displacement_mm`` where known); then ``u_mm`` and ``v_mm``
        may be left out, and the first image shows the flat blank.
    stroke
        Compared stroke [mm]: of several images that with the nearest displacement counts, the last one where
        displacements are not known.

    Raises
    ------
    MeasurementError
        The table cannot be read, a marker stands twice in an image, or none is left.
    """
    table = read_table(
        file,
        [Quantity.MARKER, Quantity.X, Quantity.Y],
        optional=[Quantity.Z, Quantity.IMAGE, Quantity.DISPLACEMENT, Quantity.U, Quantity.V],
        may_miss=[Quantity.X, Quantity.Y, Quantity.Z, Quantity.U, Quantity.V],
        preset=FORMED,
        columns=reading.columns,
        units=reading.units,
    )
    named = np.array(table.names[Quantity.MARKER])
    markers = tuple(dict.fromkeys(table.names[Quantity.MARKER]))
    shown = table.names.get(Quantity.IMAGE)
    images = tuple(dict.fromkeys(shown)) if shown else ("",)
    xyz = positions_by_image(table, images, markers)
    warnings = list(table.warnings)
    last = _image_at(table, images, stroke, warnings)
    material = _material(table, named, markers)
    flat = xyz[0, :, :2] if len(images) > 1 and material is None else None
    seen = np.isfinite(xyz[last]).all(axis=1)
    if material is not None:
        seen &= np.isfinite(material).all(axis=1)
    if flat is not None:
        seen &= np.isfinite(flat).all(axis=1)
    if not seen.any():
        raise MeasurementError(
            "no marker can be compared",
            file=table.file,
            expected="markers with a position after forming and a material point (u_mm, v_mm, or a first image)",
            got=f"{len(markers)} markers in {len(images)} images" if shown else f"{len(markers)} markers",
        )
    lost = [m for m, s in zip(markers, seen, strict=True) if not s]
    if lost:
        where = f" in image {images[last]}" if shown else ""
        warnings.append(f"{table.file.name}: {len(lost)} markers not seen{where} left out: {', '.join(lost[:8])}")
    rows = np.array([int(np.flatnonzero(named == m)[0]) for m in markers])[seen]
    return MeasuredMarkers(
        table,
        tuple(m for m, s in zip(markers, seen, strict=True) if s),
        rows,
        xyz[last][seen],
        None if material is None else material[seen],
        None if flat is None else flat[seen],
        images[last] if shown else None,
        tuple(warnings),
    )


def _image_at(table: MeasuredTable, images: tuple[str, ...], stroke: float, warnings: list[str]) -> int:
    if len(images) == 1:
        return 0
    if Quantity.DISPLACEMENT not in table.values:
        warnings.append(f"{table.file.name}: no displacements, so the last image ({images[-1]}) is compared")
        return len(images) - 1
    shown = np.array(table.names[Quantity.IMAGE])
    travel = np.array([table.values[Quantity.DISPLACEMENT][shown == image].mean() for image in images])
    nearest = int(np.abs(travel - stroke).argmin())
    if abs(travel[nearest] - stroke) > 0.01 * max(abs(stroke), 1.0):
        warnings.append(
            f"{table.file.name}: image {images[nearest]} at {travel[nearest]:.4g} mm is the nearest to the compared "
            f"{stroke:.4g} mm"
        )
    return nearest


def _material(table: MeasuredTable, named: NDArray[Any], markers: tuple[str, ...]) -> Floats | None:
    """Material points (U, V) [mm], shape [markers, 2]; of each marker the first that is written."""
    if not {Quantity.U, Quantity.V} <= table.values.keys():
        return None
    pairs = np.stack([table.values[Quantity.U], table.values[Quantity.V]], axis=1)
    found = np.full((len(markers), 2), np.nan)
    for k, marker in enumerate(markers):
        written = pairs[(named == marker) & np.isfinite(pairs).all(axis=1)]
        if len(written):
            found[k] = written[0]
    return found


def material_points(markers: MeasuredMarkers, result: Result, placement: Placement | None) -> Floats:
    """Material points (U, V) of the markers [mm], shape [n, 2].

    Parameters
    ----------
    placement
        Of the measured axes, for markers that are known by their place on the flat blank; None where it is to be found
        from the markers themselves.

    Raises
    ------
    MeasurementError
        The material points are not known, or one is outside the blank.
    """
    if markers.material is not None:
        points = markers.material
    elif markers.flat is not None and placement is not None:
        points = result.grid.material_at(placement.apply(markers.flat))
    else:
        raise MeasurementError(
            "the material points of the markers are not known",
            file=markers.table.file,
            expected="columns u_mm and v_mm (along warp and weft from the centre of the blank)",
            got=", ".join(markers.table.headers.values()),
            hint="with images of the flat and of the formed blank, an outline in the same axes (--outline) or "
            "--no-registration places them",
        )
    for row, name, (u, v) in zip(markers.rows, markers.names, points, strict=True):
        refuse_outside(result, markers.table, int(row), name, float(u), float(v))
    return points


def compare_markers(
    markers: MeasuredMarkers, yarn: Floats, simulated: Floats, placement: Placement
) -> MarkerComparison:
    """Set measured markers beside their simulated material points.

    Parameters
    ----------
    yarn
        Material points [mm], shape [n, 2].
    simulated
        Their simulated positions [mm], shape [n, 3].
    placement
        Of the measured axes.
    """
    return MarkerComparison(
        markers.table.file,
        markers.table.sha256,
        markers.names,
        yarn,
        placement.apply(markers.formed),
        simulated,
        markers.image,
        markers.warnings,
    )
