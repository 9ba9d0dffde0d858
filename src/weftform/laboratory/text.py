"""From the bytes of an export to cells: encoding, delimiter, decimal mark; columns have no meaning here."""

from __future__ import annotations

import csv
import hashlib
import math
import re
from dataclasses import dataclass
from pathlib import Path

from weftform.errors import MeasurementError

LARGEST_FILE = 500_000_000
"""Bytes; a full-field export is tens of megabytes."""

DELIMITERS = (";", "\t", ",", "|")
_NUMBER = re.compile(r"^[+-]?(\d+([.,]\d*)*|[.,]\d+)([eE][+-]?\d+)?$")
_GROUPED = re.compile(r"^[+-]?\d{1,3}(?:[ \u00a0\u202f]\d{3})+(?:[.,]\d*)?$")
"""Numbers as the French write them, with blanks between the thousands."""
_ERROR_CELL = re.compile(r"^#(?:\S*[!?]|N/?A\b|#+)", re.IGNORECASE)
"""What a spreadsheet puts where a formula has no value, such as #VALUE! or #N/A; no comment."""
_MISSING = {"", "nan", "n/a", "na", "-", "--", "null", "none", "nul", "#n/a", "inf", "-inf", "+inf"}


@dataclass(frozen=True)
class CellRow:
    """One line of a file cut into cells; ``line`` counts from 1."""

    line: int
    cells: tuple[str, ...]


@dataclass(frozen=True)
class CutText:
    """A file cut into rows of cells.

    Attributes
    ----------
    rows
        Lines that are neither empty nor comments.
    encoding, delimiter
        What was found; the delimiter ``" "`` stands for any white space.
    decimal_comma
        Whether numbers are written ``1,5``.
    sha256
        Fingerprint of the file.
    """

    file: Path
    rows: tuple[CellRow, ...]
    encoding: str
    delimiter: str
    decimal_comma: bool
    sha256: str


def decode(raw: bytes, file: Path) -> tuple[str, str]:
    """Text and encoding of a file: byte order mark first, then UTF-8, then windows-1252 (any Western
    machine).

    Raises
    ------
    MeasurementError
        The file holds NUL bytes and no byte order mark: it is not text.
    """
    for mark, name in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if raw.startswith(mark):
            try:
                return raw.decode(name), name
            except UnicodeDecodeError:
                raise MeasurementError(
                    f"the file announces {name} and is not", file=file, hint="export it again as CSV in UTF-8"
                ) from None
    if b"\x00" in raw:
        raise MeasurementError(
            "this is a binary file",
            file=file,
            expected="text: CSV, TSV or TXT",
            hint="export it from the machine as CSV",
        )
    try:
        return raw.decode("utf-8"), "utf-8"
    except UnicodeDecodeError:
        return raw.decode("windows-1252", errors="replace"), "windows-1252"


def read_bytes(file: Path) -> bytes:
    """The bytes of a measurement file.

    Raises
    ------
    MeasurementError
        No such file, a folder, too large, not readable or empty.
    """
    try:
        if file.is_dir():
            raise MeasurementError("this is a folder", file=file, expected="a file of measurements")
        if file.stat().st_size > LARGEST_FILE:
            raise MeasurementError("this file is too large", file=file, expected=f"{LARGEST_FILE // 10**6} MB at most")
        raw = file.read_bytes()
    except FileNotFoundError:
        raise MeasurementError("no such file", file=file) from None
    except OSError as problem:
        raise MeasurementError(f"cannot be read ({problem.strerror})", file=file) from None
    if not raw.strip(b" \t\r\n\xef\xbb\xbf"):
        raise MeasurementError("the file is empty", file=file, expected="a header line and rows of numbers")
    return raw


def cut(file: Path) -> CutText:
    """Read a file and cut it into cells.

    The delimiter is the one that gives the same number of cells on most lines, more than one; white space
    where none does.
    """
    raw = read_bytes(file)
    text, encoding = decode(raw, file)
    lines = [
        (n, line)
        for n, line in enumerate(text.splitlines(), 1)
        if line.strip() and (not line.lstrip().startswith("#") or _ERROR_CELL.match(line.lstrip()))
    ]
    if not lines:
        raise MeasurementError("the file has comments only", file=file, expected="a header line and rows of numbers")
    delimiter = _delimiter([line for _, line in lines])
    rows = tuple(CellRow(n, _cells(line, delimiter)) for n, line in lines)
    return CutText(file, rows, encoding, delimiter, _decimal_comma(rows, delimiter), hashlib.sha256(raw).hexdigest())


def _cells(line: str, delimiter: str) -> tuple[str, ...]:
    if delimiter == " ":
        return tuple(line.split())
    try:
        cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    except csv.Error:  # a cell of more than 128 kB: no table has one, so the line is left whole and found unreadable
        return (line.strip(),)
    return tuple(re.sub(r"\s", "", c) if _GROUPED.match(c) else c for c in (cell.strip() for cell in cells))


def _delimiter(lines: list[str]) -> str:
    sample = lines[-400:]

    def score(delimiter: str) -> float:
        """Share of the lines with the commonest number of cells, each weighted by its share of numbers."""
        counts: dict[int, float] = {}
        for line in sample:
            cells = _cells(line, delimiter)
            readable = sum(bool(_NUMBER.match(c)) or c.lower() in _MISSING for c in cells)
            if len(cells) > 1 and 2 * readable >= len(cells):
                counts[len(cells)] = counts.get(len(cells), 0.0) + readable / len(cells)
        return max(counts.values(), default=0.0) / len(sample)

    # The first of equals wins: a comma is tried after ; and tab because it may be a decimal mark.
    candidates = (*DELIMITERS, " ")
    best = max(candidates, key=lambda d: (round(score(d), 2), -candidates.index(d)))
    return best if score(best) > 0.0 else ","


def _decimal_comma(rows: tuple[CellRow, ...], delimiter: str) -> bool:
    """Commas are decimal marks where cells hold them and no cell has a single point in their place."""
    commas = points = 0
    for row in rows:
        for cell in row.cells:
            if _NUMBER.match(cell):
                comma, point = cell.rfind(","), cell.rfind(".")
                commas += comma > point
                points += point > comma
    return commas > points


def is_number(cell: str) -> bool:
    """Whether a cell reads as a number (either decimal mark)."""
    return bool(_NUMBER.match(cell.strip()))


def is_missing(cell: str) -> bool:
    """Whether a cell says that there is no value (empty, NaN, n/a, ...)."""
    return cell.strip().lower() in _MISSING


def number(cell: str, decimal_comma: bool) -> float | None:
    """Value of a cell, or None where it is missing.

    Marks between thousands are allowed where they are no decimal mark by mistake: in groups of three, several of them
    or with a decimal mark behind. A single ``1.234`` among decimal commas could be either.

    Raises
    ------
    ValueError
        The cell holds something that is not a number, or one that could be read in two ways.
    """
    text = cell.strip()
    if is_missing(text):
        return None
    if not _NUMBER.match(text):
        raise ValueError(cell)
    mark, thousands = (",", ".") if decimal_comma else (".", ",")
    if thousands in text:
        if not re.match(rf"^[+-]?[1-9]\d{{0,2}}(\{thousands}\d{{3}})+(\{mark}|$|[eE])", text):
            raise ValueError(cell)
        if text.count(thousands) == 1 and mark not in text:
            raise ValueError(cell)
        text = text.replace(thousands, "")
    if text.count(mark) > 1:
        raise ValueError(cell)
    value = float(text.replace(mark, "."))
    if not math.isfinite(value):
        raise ValueError(cell)
    return value
