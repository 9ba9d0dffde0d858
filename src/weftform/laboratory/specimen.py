"""One specimen: its curve as measured, made fit for averaging; what was done to it is said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats
from weftform.laboratory.presets import Quantity
from weftform.laboratory.scatter import neighbour_misses
from weftform.laboratory.table import MeasuredTable, read_table

FEWEST_POINTS = 8
"""A curve with fewer points says nothing about its shape."""
SMALL_REVERSAL = 0.01
"""Share of the travel that a displacement may step back without being an unloading."""
CLIPPED_ROWS = 5
CLIPPED_TRAVEL = 0.02
"""A load cell is clipped where the largest force repeats exactly over so many rows and this share of the
travel."""
SPIKE_OF_NOISE = 10.0
SPIKE_OF_FORCE, SPIKE_OF_VALUE = 0.05, 0.5
"""A point stands alone where it leaves the median of itself and its four neighbours by so many times the noise of the
curve, and by this share of the largest force or of that median."""
MOST_SPIKES = 0.02
"""Share of the rows that may stand alone; with more it is noise, not an error of single rows."""
LIKE_EACH_OTHER = 5.0
"""Largest ratio between the forces of one specimen and the median specimen; beyond it units or tests are
mixed."""


@dataclass(frozen=True)
class Reading:
    """How files are read.

    Attributes
    ----------
    preset
        ``auto``, ``generic``, ``instron``, ``aramis`` or ``vic3d``.
    columns, units
        Column and unit per quantity, see :func:`weftform.laboratory.table.read_table`.
    only
        Names of the specimens to take from files that hold several; empty for all.
    zero
        Shift displacement and force so that each test starts at zero.
    """

    preset: str = "auto"
    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    only: tuple[str, ...] = ()
    zero: bool = False


@dataclass(frozen=True, eq=False)
class Specimen:
    """The curve of one specimen.

    Attributes
    ----------
    name
        File stem, and the name within the file where it holds several.
    file, sha256
        Where it came from.
    x, y
        Displacement [mm] and force [N], or shear angle [deg] and normalised shear force [N/mm]; shape [n],
        ``x`` increasing.
    angle
        Measured shear angle [deg], shape [n], NaN where there is none; None where it was not measured.
    lines
        Line of the file per point, shape [n].
    warnings
        What was done.
    """

    name: str
    file: Path
    sha256: str
    x: Floats
    y: Floats
    lines: np.ndarray
    angle: Floats | None = None
    warnings: tuple[str, ...] = ()

    def part(self, chosen: np.ndarray, warning: str | None = None) -> Specimen:
        """Some of the points, with a reason."""
        return replace(
            self,
            x=self.x[chosen],
            y=self.y[chosen],
            lines=self.lines[chosen],
            angle=None if self.angle is None else self.angle[chosen],
            warnings=self.warnings if warning is None else (*self.warnings, warning),
        )


def read_specimens(
    files: Sequence[Path | str],
    x: Quantity,
    y: Quantity,
    reading: Reading = Reading(),
    *,
    angle: bool = False,
) -> tuple[Specimen, ...]:
    """Read and clean the curves of a test, several specimens per file where a column names them.

    Raises
    ------
    MeasurementError
        A file cannot be read, a curve cannot be used, or the specimens differ too much to be the same test.
    """
    if not files:
        raise MeasurementError("no files of measurements", expected="one file per specimen at least")
    specimens: list[Specimen] = []
    seen: dict[str, Path] = {}
    for file in files:
        optional = [Quantity.SPECIMEN] + ([Quantity.SHEAR_ANGLE] if angle else [])
        table = read_table(
            file,
            [x, y],
            optional=optional,
            may_miss=[Quantity.SHEAR_ANGLE] if angle else [],
            preset=reading.preset,
            columns=reading.columns,
            units=reading.units,
        )
        if table.sha256 in seen:
            raise MeasurementError(
                f"the same measurements as {seen[table.sha256]}: a specimen cannot count twice",
                file=table.file,
            )
        seen[table.sha256] = table.file
        specimens += _of_table(table, x, y, reading)
    if not specimens:
        raise MeasurementError(
            "none of the specimens asked for is in the files",
            got=", ".join(reading.only),
            hint="check the spelling",
        )
    _check_alike(specimens)
    return tuple(specimens)


def _of_table(table: MeasuredTable, x: Quantity, y: Quantity, reading: Reading) -> list[Specimen]:
    names = table.names.get(Quantity.SPECIMEN)
    groups: dict[str, np.ndarray] = {"": np.arange(len(table.lines))}
    if names is not None:
        groups = {name: np.flatnonzero(np.array(names) == name) for name in dict.fromkeys(names)}
        if reading.only:
            groups = {name: rows for name, rows in groups.items() if name in reading.only}
    found = []
    for k, (name, rows) in enumerate(groups.items()):
        part = table.rows(rows)
        specimen = Specimen(
            name=f"{table.file.stem}: {name}" if name else table.file.stem,
            file=table.file,
            sha256=table.sha256,
            x=part.values[x],
            y=part.values[y],
            lines=part.lines,
            angle=part.values.get(Quantity.SHEAR_ANGLE) if x is not Quantity.SHEAR_ANGLE else None,
            warnings=table.warnings if k == 0 else (),
        )
        guess = not {x, y} & table.declared
        found.append(clean(specimen, x.value, y.value, zero=reading.zero, guess_swapped=guess))
    return found


def clean(specimen: Specimen, x_name: str, y_name: str, *, zero: bool = False, guess_swapped: bool = True) -> Specimen:
    """A curve with increasing displacement and positive force, cut where the load cell is clipped or the
    test ends.

    Small steps back of the displacement are left out; a return at the end is cut off; an unloading before
    that is refused.

    Raises
    ------
    MeasurementError
        Too few points, columns that seem swapped, or a displacement that unloads on its way.
    """
    if len(specimen.x) < FEWEST_POINTS:
        raise MeasurementError(
            f"{specimen.name}: too few points for a curve",
            file=specimen.file,
            line=int(specimen.lines[0]) if len(specimen.lines) else None,
            expected=f"{FEWEST_POINTS} rows at least",
            got=f"{len(specimen.x)}",
        )
    if guess_swapped:
        _refuse_swapped(specimen, x_name, y_name)
    if not np.ptp(specimen.y) > 0.0:
        raise MeasurementError(
            f"{specimen.name}: {y_name} never changes",
            file=specimen.file,
            line=int(specimen.lines[0]),
            expected="a curve",
            got=f"{specimen.y[0]:g} throughout",
        )
    s = _upright(specimen, x_name, y_name)
    if zero:
        s = replace(s, x=s.x - s.x[0], y=s.y - s.y[0])
    s = _rising(s, x_name)
    s = _without_spikes(s, y_name)
    s = _without_clipping(s, y_name)
    if len(s.x) < FEWEST_POINTS:
        raise MeasurementError(
            f"{s.name}: too few points are left after cleaning",
            file=s.file,
            expected=f"{FEWEST_POINTS} rows at least",
            got=f"{len(s.x)}",
            hint="; ".join(s.warnings) or None,
        )
    started = []
    if s.x[0] > 0.05 * s.x[-1]:
        started.append(f"{s.name}: starts at {x_name} = {s.x[0]:.4g}; the origin is taken as the undeformed state")
    if abs(s.y[0]) > 0.05 * np.abs(s.y).max() and s.x[0] < 0.02 * s.x[-1]:
        started.append(
            f"{s.name}: starts with {y_name} = {s.y[0]:.4g}, {100 * s.y[0] / np.abs(s.y).max():.0f} % of "
            f"its largest; "
            "a preload or an untared cell (--zero removes it)"
        )
    return replace(s, warnings=(*s.warnings, *started))


def _refuse_swapped(s: Specimen, x_name: str, y_name: str) -> None:
    """A crosshead moves evenly, a force does not; the contrary means that the columns are swapped."""

    def unevenness(values: Floats) -> float:
        steps = np.diff(values)
        middle = float(np.median(steps))
        if middle == 0.0:
            return np.inf
        return float(np.median(np.abs(steps / middle - 1.0)))

    x, y = unevenness(s.x), unevenness(s.y)
    if y < 0.02 and x > 0.2:
        raise MeasurementError(
            f"{s.name}: the columns seem swapped: {y_name} rises evenly like a crosshead, {x_name} does not",
            file=s.file,
            line=int(s.lines[0]),
            expected=f"{x_name} that rises evenly",
            got=f"{x_name} up to {np.abs(s.x).max():.4g}, {y_name} up to {np.abs(s.y).max():.4g}",
            hint="name both columns (--column displacement=... --column force=...) to settle it",
        )


def _upright(s: Specimen, x_name: str, y_name: str) -> Specimen:
    turned: list[str] = []
    x, y = s.x, s.y
    if x[np.argmax(np.abs(x - x[0]))] < x[0] and np.median(x) < 0.0:
        x, turned = -x, [*turned, x_name]
    if y[np.argmax(np.abs(y))] < 0.0:
        y, turned = -y, [*turned, y_name]
    if not turned:
        return s
    warning = f"{s.name}: sign of {' and '.join(turned)} turned, tension is positive here"
    return replace(s, x=x, y=y, warnings=(*s.warnings, warning))


def _rising(s: Specimen, x_name: str) -> Specimen:
    travel = float(np.ptp(s.x))
    if travel == 0.0:
        raise MeasurementError(
            f"{s.name}: {x_name} never changes",
            file=s.file,
            line=int(s.lines[0]),
            got=f"{s.x[0]:g} throughout",
        )
    top = int(np.argmax(s.x))
    if top < len(s.x) - 1 and s.x[top] - s.x[-1] > SMALL_REVERSAL * travel:
        line = int(s.lines[top])
        s = s.part(np.arange(top + 1), f"{s.name}: the return after line {line} ({s.x[top]:.4g}, the end) is cut off")
        if len(s.x) < FEWEST_POINTS:
            raise MeasurementError(
                f"{s.name}: {x_name} falls from the start", file=s.file, line=line, expected="a loading curve"
            )
    reached = np.maximum.accumulate(s.x)
    back = reached - s.x
    if back.max() > SMALL_REVERSAL * travel:
        k = int(np.argmax(back > SMALL_REVERSAL * travel))
        raise MeasurementError(
            f"{s.name}: {x_name} steps back by {back.max():.4g} on its way",
            file=s.file,
            line=int(s.lines[k]),
            expected="a displacement that increases (one loading, no cycles)",
            got=f"{s.x[k]:.6g} after {reached[k]:.6g}",
            hint="give the first loading only, or one file per cycle",
        )
    forward = np.append(True, s.x[1:] > reached[:-1])
    if forward.all():
        return s
    lost = s.lines[~forward]
    shown = ", ".join(map(str, lost[:5])) + (f" and {len(lost) - 5} more" if len(lost) > 5 else "")
    return s.part(forward, f"{s.name}: {len(lost)} rows in which {x_name} does not increase left out (line {shown})")


def _without_spikes(s: Specimen, y_name: str) -> Specimen:
    """The curve without single points far from their neighbours: a lost sample, a knock, a spark.

    Far both from the running median, which leaves every rising curve as it is, so that only points out of order depart
    from it, and from the straight line between the two neighbours. A drop that lasts (yarns that break) stays.

    References
    ----------
    Hampel (1974), The influence curve and its role in robust estimation, Journal of the American Statistical
    Association 69:383-393.
    """
    middle = np.median(np.lib.stride_tricks.sliding_window_view(s.y, 5), axis=1)
    departure = np.append(np.insert(np.abs(s.y[2:-2] - middle), 0, [0.0, 0.0]), [0.0, 0.0])
    miss = np.pad(np.abs(neighbour_misses(s.x, s.y)[0]), 1)
    noise = 1.4826 * float(np.median(miss[1:-1]))
    local = np.pad(np.abs(middle), 2, constant_values=np.inf)
    least = np.minimum(SPIKE_OF_FORCE * float(np.abs(middle).max()), SPIKE_OF_VALUE * local)
    least = np.maximum(least, SPIKE_OF_NOISE * noise)
    alone = (departure > least) & (miss > least)
    if not alone.any() or alone.sum() > max(1.0, MOST_SPIKES * len(s.y)):
        return s
    shown = ", ".join(f"{line} ({y:.4g})" for line, y in list(zip(s.lines[alone], s.y[alone], strict=True))[:5])
    more = f" and {int(alone.sum()) - 5} more" if alone.sum() > 5 else ""
    return s.part(~alone, f"{s.name}: {y_name} stands alone among its neighbours and is left out: line {shown}{more}")


def _without_clipping(s: Specimen, y_name: str) -> Specimen:
    at_top = s.y == s.y.max()
    first = int(np.argmax(at_top))
    last = first
    while last + 1 < len(s.y) and at_top[last + 1]:
        last += 1
    if last - first + 1 < CLIPPED_ROWS or s.x[last] - s.x[first] < CLIPPED_TRAVEL * np.ptp(s.x):
        return s
    return s.part(
        np.arange(first),
        f"{s.name}: {y_name} stays at exactly {s.y[first]:.6g} from line {s.lines[first]} to "
        f"{s.lines[last]}: a clipped "
        "load cell; the curve ends before it",
    )


def _check_alike(specimens: Sequence[Specimen]) -> None:
    """Forces at a common place must be of one size: a factor of 1000 is a unit, not scatter."""
    if len(specimens) < 2:
        return
    end = min(s.x[-1] for s in specimens)
    longest = max(specimens, key=lambda s: s.x[-1])
    if longest.x[-1] > LIKE_EACH_OTHER**2 * end:
        short = min(specimens, key=lambda s: s.x[-1])
        raise MeasurementError(
            f"{short.name} ends at {end:.4g}, {longest.name} at {longest.x[-1]:.4g}: are the units mixed?",
            file=short.file,
            hint="state the units: --unit displacement=mm",
        )
    sizes = np.array([np.abs(s.y[s.x <= end]).mean() for s in specimens])
    typical = float(np.median(sizes))
    for s, size in zip(specimens, sizes, strict=True):
        if typical > 0.0 and not 1.0 / LIKE_EACH_OTHER < size / typical < LIKE_EACH_OTHER:
            raise MeasurementError(
                f"{s.name} is {size / typical:.3g} times the median specimen: are units or tests mixed?",
                file=s.file,
                line=int(s.lines[0]),
                expected=f"forces within a factor {LIKE_EACH_OTHER:g} of each other",
                got=f"{size:.4g} on average up to {end:.4g}, median specimen {typical:.4g}",
                hint="state the units (--unit force=kN), or leave this file out",
            )
