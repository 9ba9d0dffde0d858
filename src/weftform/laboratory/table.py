"""The column-mapped reader: named quantities in mm, N, s and degrees, whatever machine wrote the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats
from weftform.laboratory.header import Column, find_columns, find_header, quantity_named
from weftform.laboratory.presets import Preset, Quantity, find_preset
from weftform.laboratory.text import CellRow, CutText, cut, is_missing, is_number, number
from weftform.laboratory.units import is_unit, split_unit

MOST_UNREADABLE = 0.2
"""Share of the rows that may be unreadable; beyond it the file is refused, because it is not the table it
is taken for."""


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


def read_table(
    file: Path | str,
    needed: Sequence[Quantity],
    *,
    optional: Sequence[Quantity] = (),
    may_miss: Sequence[Quantity] = (),
    preset: str | Preset = "auto",
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
        Quantities of which single values may be missing (they become NaN); a row that misses any other is
        left out and named.
    preset
        ``auto``, ``generic``, ``instron``, ``aramis`` or ``vic3d``, or spellings of one's own.
    columns
        Header (or number, 1 = first) of the column of a quantity: ``{"force": "Load 2"}``.
    units
        Unit of a quantity where the file gives none: ``{"force": "kN"}``.

    Raises
    ------
    MeasurementError
        Not a readable table, a needed column is missing, a unit is unknown or contradicts the one given,
        two tables with headers of their own in one file, or too many unreadable rows.
    """
    path = Path(file)
    text = cut(path)
    words = " ".join(" ".join(row.cells) for row in text.rows[:40]).lower()
    found = preset if isinstance(preset, Preset) else find_preset(preset, words)
    wanted = {quantity_named(k): v for k, v in (columns or {}).items()}
    given = {quantity_named(k): v for k, v in (units or {}).items()}
    warnings: list[str] = []
    if text.encoding == "windows-1252":
        warnings.append(f"{path.name}: not UTF-8, read as windows-1252")
    start, names, row_units, header_line = find_header(text, found, wanted, needed)
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
    taken = find_columns(
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


def _body(
    path: Path,
    text: CutText,
    preset: Preset,
    body: tuple[CellRow, ...],
    taken: list[Column],
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


def _refuse_unit_in_cell(path: Path, line: int, column: Column, cell: str) -> None:
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


def _report_unreadable(path: Path, unreadable: list[tuple[int, str, str]], rows: int, warnings: list[str]) -> None:
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
