"""The column-mapped reader: one table of named quantities in mm, N, s and degrees, whatever machine wrote the file."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats
from weftform.laboratory.presets import Preset, Quantity, find_preset, plain
from weftform.laboratory.text import CellRow, CutText, cut, is_missing, is_number, number
from weftform.laboratory.units import Dimension, is_unit, known_units, split_unit, unit_factor

MOST_UNREADABLE = 0.2
"""Share of the rows that may be unreadable; beyond it the file is refused, because it is not the table it is taken for."""


@dataclass(frozen=True)
class MeasuredTable:
    """A table of measurements in the units of the laboratory.

    Attributes
    ----------
    file, sha256
        Where it came from.
    preset, encoding
        How it was read.
    lines
        Line of the file of each row, shape [rows].
    values
        Numbers per quantity [unit in the quantity's name], shape [rows] each.
    names
        Text per quantity (specimen, marker, image), ``rows`` each.
    headers
        Header of each quantity as written in the file.
    declared
        Quantities whose column was named by the user, so that no guess about them is wanted.
    warnings
        What was done to read the file.
    """

    file: Path
    sha256: str
    preset: str
    encoding: str
    lines: np.ndarray
    values: Mapping[Quantity, Floats]
    names: Mapping[Quantity, tuple[str, ...]]
    headers: Mapping[Quantity, str]
    declared: frozenset[Quantity]
    warnings: tuple[str, ...]

    def rows(self, chosen: np.ndarray) -> MeasuredTable:
        """The table with some of its rows: indices or a mask, shape [rows]."""
        index = np.arange(len(self.lines))[chosen]
        return MeasuredTable(
            self.file,
            self.sha256,
            self.preset,
            self.encoding,
            self.lines[index],
            {q: v[index] for q, v in self.values.items()},
            {q: tuple(v[i] for i in index) for q, v in self.names.items()},
            self.headers,
            self.declared,
            self.warnings,
        )


@dataclass(frozen=True)
class _Column:
    quantity: Quantity
    index: int
    header: str
    factor: float


def quantity_named(name: str) -> Quantity:
    """The quantity a user means by ``force``, ``force_N`` or ``FORCE``.

    Raises
    ------
    MeasurementError
        No quantity of that name.
    """
    wanted = plain(name)
    short = {plain(split_unit(q.value)[0]): q for q in Quantity} | {plain(q.value): q for q in Quantity}
    if wanted in short:
        return short[wanted]
    close = difflib.get_close_matches(wanted, list(short), 1)
    raise MeasurementError(
        f'no quantity "{name}"',
        expected="one of " + ", ".join(q.value for q in Quantity),
        hint=f"did you mean {short[close[0]].value}?" if close else None,
    )


def read_table(
    file: Path | str,
    needed: Sequence[Quantity],
    *,
    optional: Sequence[Quantity] = (),
    may_miss: Sequence[Quantity] = (),
    preset: str = "auto",
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
) -> MeasuredTable:
    """Read a CSV, TSV or text export.

    Parameters
    ----------
    file
        Path of the export.
    needed
        Quantities that must be there.
    optional
        Quantities read where there is a column for them.
    may_miss
        Quantities of which single values may be missing (they become NaN); a row that misses any other is left out and named.
    preset
        ``auto``, ``generic``, ``instron``, ``aramis`` or ``vic3d``.
    columns
        Header (or number, 1 = first) of the column of a quantity: ``{"force": "Load 2"}``.
    units
        Unit of a quantity where the file gives none: ``{"force": "kN"}``.

    Raises
    ------
    MeasurementError
        Not a readable table, a needed column is missing, a unit is unknown or contradicts the one given, two tables with
        headers of their own in one file, or too many unreadable rows.
    """
    path = Path(file)
    text = cut(path)
    words = " ".join(" ".join(row.cells) for row in text.rows[:40]).lower()
    found = find_preset(preset, words)
    wanted = {quantity_named(k): v for k, v in (columns or {}).items()}
    given = {quantity_named(k): v for k, v in (units or {}).items()}
    warnings: list[str] = []
    if text.encoding == "windows-1252":
        warnings.append(f"{path.name}: not UTF-8, read as windows-1252")
    start, names, row_units, header_line = _header(text, found, wanted, needed)
    if names is None:
        width = len(text.rows[start].cells)
        if not wanted and width != len(needed):
            raise MeasurementError(
                "the file has no header line, so its columns cannot be told apart",
                file=path,
                line=text.rows[start].line,
                expected=", ".join(q.value for q in needed),
                got=f"{width} columns of numbers",
                hint="name them by number, e.g. --column displacement=1 --column force=2",
            )
        names = [str(k + 1) for k in range(width)]
        if not wanted:
            wanted = {q: str(k + 1) for k, q in enumerate(needed)}
            order = ", ".join(q.value for q in needed)
            warnings.append(f"{path.name}: no header line, columns taken in the order {order}")
            declared: frozenset[Quantity] = frozenset()
        else:
            declared = frozenset(wanted)
    else:
        declared = frozenset(wanted)
    taken = _columns(
        path,
        header_line,
        names,
        row_units,
        found,
        wanted,
        given,
        [*needed, *optional],
        frozenset(needed),
        warnings,
    )
    body = text.rows[start:]
    return _body(path, text, found, body, taken, frozenset(may_miss), declared, warnings)


def _header(
    text: CutText, preset: Preset, wanted: Mapping[Quantity, str], needed: Sequence[Quantity]
) -> tuple[int, list[str] | None, list[str] | None, int | None]:
    """Index of the first row of data, the header's cells, the units' cells and the header's line."""
    best: tuple[int, int] | None = None
    first_number: int | None = None
    for k, row in enumerate(text.rows[:500]):
        cells = row.cells
        numeric = sum(is_number(c) for c in cells)
        if numeric and first_number is None and 2 * numeric >= len(cells):
            first_number = k
        if numeric:
            continue
        score = len({q for c in cells if (q := preset.quantity_of(split_unit(c)[0])) in needed})
        score += sum(
            plain(c) == plain(v) or plain(split_unit(c)[0]) == plain(v)
            for c in cells
            for v in wanted.values()
        )
        if score and (best is None or score > best[1]):
            best = (k, score)
    if best is None and first_number is None:
        raise MeasurementError(
            "no row of numbers", file=text.file, line=text.rows[0].line, expected="a table of numbers",
            got=" | ".join(text.rows[0].cells)[:120],
        )  # fmt: skip
    if best is not None:
        k = best[0]
    elif first_number:
        k = first_number - 1  # a header none of whose names is known: the message will list them
    else:
        return 0, None, None, None
    header = text.rows[k]
    start, row_units = k + 1, None
    if start < len(text.rows):
        below = text.rows[start].cells
        if any(is_unit(c) for c in below) and all(is_unit(c) or not c for c in below):
            row_units, start = [c.strip("()[] ") for c in below], start + 1
    if start >= len(text.rows):
        raise MeasurementError(
            "a header and no rows", file=text.file, line=header.line, expected="rows of numbers"
        )
    return start, list(header.cells), row_units, header.line


def _columns(
    path: Path,
    line: int | None,
    names: list[str],
    row_units: list[str] | None,
    preset: Preset,
    wanted: Mapping[Quantity, str],
    given: Mapping[Quantity, str],
    quantities: Sequence[Quantity],
    needed: frozenset[Quantity],
    warnings: list[str],
) -> list[_Column]:
    split = [split_unit(n) for n in names]
    taken: list[_Column] = []
    for quantity in quantities:
        if quantity in wanted:
            fits = [
                k for k, n in enumerate(names) if plain(wanted[quantity]) in (plain(n), plain(split[k][0]))
            ]
            if not fits and wanted[quantity].isdigit() and 1 <= int(wanted[quantity]) <= len(names):
                fits = [int(wanted[quantity]) - 1]
        else:
            fits = [k for k, (name, _) in enumerate(split) if preset.quantity_of(name) is quantity]
        if not fits:
            if quantity in needed or quantity in wanted:
                close = difflib.get_close_matches(
                    plain(wanted.get(quantity, quantity.value)), map(plain, names), 1, 0.5
                )
                raise MeasurementError(
                    f"no column for {quantity.value}",
                    file=path,
                    line=line,
                    expected=f'a column "{wanted[quantity]}"'
                    if quantity in wanted
                    else f"a column such as {quantity.value}",
                    got=", ".join(names)[:300],
                    hint=(f'is "{close[0]}" meant? ' if close else "")
                    + f"Name the column: --column {split_unit(quantity.value)[0]}=HEADER",
                )
            continue
        if len(fits) > 1:
            warnings.append(
                f"{path.name}: {len(fits)} columns for {quantity.value}, the first taken ({names[fits[0]]!r} "
                f"of {', '.join(repr(names[k]) for k in fits)})"
            )
        k = fits[0]
        in_file = split[k][1] or (row_units[k] if row_units and k < len(row_units) and row_units[k] else None)
        factor = _factor(path, line, quantity, names[k], in_file, given.get(quantity), preset, warnings)
        taken.append(_Column(quantity, k, names[k], factor))
    return taken


def _factor(
    path: Path,
    line: int | None,
    quantity: Quantity,
    header: str,
    in_file: str | None,
    given: str | None,
    preset: Preset,
    warnings: list[str],
) -> float:
    dimension = quantity.dimension
    if dimension is Dimension.NONE:
        return 1.0
    from_file = unit_factor(in_file, dimension) if in_file is not None else None
    from_user = unit_factor(given, dimension) if given is not None else None
    if given is not None and from_user is None:
        raise MeasurementError(
            f'"{given}" is no unit of {quantity.value}', expected=known_units(dimension), got=given
        )
    if in_file is not None and from_file is None and from_user is None:
        raise MeasurementError(
            f'"{in_file}" is no unit of {quantity.value}',
            file=path,
            line=line,
            key=header,
            expected=known_units(dimension),
            got=in_file,
            hint=f"state the unit: --unit {split_unit(quantity.value)[0]}={dimension.value}",
        )
    if from_file is not None and from_user is not None and not np.isclose(from_file, from_user):
        raise MeasurementError(
            f"two units for {quantity.value}: the header says {in_file}, the option says {given}",
            file=path,
            line=line,
            key=header,
            expected="one unit",
            hint="leave the option out, or correct the header",
        )
    if from_user is not None:
        return from_user
    if from_file is not None:
        return from_file
    if quantity in preset.units:
        factor = unit_factor(preset.units[quantity], dimension)
        assert factor is not None
        return factor
    warnings.append(
        f'{path.name}: no unit for {quantity.value} (column "{header}"), {dimension.value} assumed'
    )
    return 1.0


def _body(
    path: Path,
    text: CutText,
    preset: Preset,
    body: tuple[CellRow, ...],
    taken: list[_Column],
    may_miss: frozenset[Quantity],
    declared: frozenset[Quantity],
    warnings: list[str],
) -> MeasuredTable:
    numeric = [c for c in taken if not c.quantity.is_text]
    textual = [c for c in taken if c.quantity.is_text]
    kept: list[CellRow] = []
    numbers: list[list[float]] = []
    unreadable: list[tuple[int, str, str]] = []
    for row in body:
        if numeric and not any(is_number(c) for c in row.cells):
            named = {preset.quantity_of(split_unit(c)[0]) for c in row.cells}
            if len(named & {c.quantity for c in taken}) >= 2:
                raise MeasurementError(
                    "a second header inside the table: are there several tables, perhaps in other units?",
                    file=path,
                    line=row.line,
                    expected="one table per file",
                    got=" | ".join(row.cells)[:120],
                    hint="split the file, one test each",
                )
        values: list[float] = []
        for column in numeric:
            cell = row.cells[column.index] if column.index < len(row.cells) else ""
            try:
                value = number(cell, text.decimal_comma)
            except ValueError:
                _refuse_unit_in_cell(path, row.line, column, cell)
                unreadable.append((row.line, column.header, cell))
                break
            if value is None and column.quantity not in may_miss:
                unreadable.append((row.line, column.header, cell))
                break
            values.append(np.nan if value is None else value * column.factor)
        else:
            if all(c.index < len(row.cells) and not (is_missing(row.cells[c.index])) for c in textual):
                kept.append(row)
                numbers.append(values)
            else:
                unreadable.append((row.line, textual[0].header, ""))
    _report_unreadable(path, unreadable, len(body), warnings)
    array = np.asarray(numbers, float).reshape(len(kept), len(numeric))
    return MeasuredTable(
        file=path,
        sha256=text.sha256,
        preset=preset.name,
        encoding=text.encoding,
        lines=np.array([row.line for row in kept], int),
        values={c.quantity: array[:, k] for k, c in enumerate(numeric)},
        names={c.quantity: tuple(row.cells[c.index] for row in kept) for c in textual},
        headers={c.quantity: c.header for c in taken},
        declared=declared,
        warnings=tuple(warnings),
    )


def _refuse_unit_in_cell(path: Path, line: int, column: _Column, cell: str) -> None:
    parts = cell.split()
    if len(parts) == 2 and is_number(parts[0]) and is_unit(parts[1]):
        raise MeasurementError(
            "a unit inside a cell: the column may mix units",
            file=path,
            line=line,
            key=column.header,
            expected="a number, its unit in the header",
            got=cell,
        )


def _report_unreadable(
    path: Path, unreadable: list[tuple[int, str, str]], rows: int, warnings: list[str]
) -> None:
    if not unreadable:
        return
    line, header, cell = unreadable[0]
    if len(unreadable) > MOST_UNREADABLE * rows:
        raise MeasurementError(
            f"{len(unreadable)} of {rows} rows cannot be read, this one first",
            file=path,
            line=line,
            key=header,
            expected="a number",
            got=repr(cell),
            hint="are the delimiter, the decimal mark and the columns the ones meant?",
        )
    shown = ", ".join(f"{n} ({h}: {c!r})" for n, h, c in unreadable[:5])
    more = f" and {len(unreadable) - 5} more" if len(unreadable) > 5 else ""
    warnings.append(f"{path.name}: {len(unreadable)} unreadable rows left out: line {shown}{more}")
