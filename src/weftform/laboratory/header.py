"""Which column holds what, and in which unit: headers, rows of units, options and presets."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from weftform.errors import MeasurementError
from weftform.laboratory.presets import Preset, Quantity, plain
from weftform.laboratory.text import CutText, is_number
from weftform.laboratory.units import Dimension, is_unit, known_units, split_unit, unit_factor


@dataclass(frozen=True)
class Column:
    """Where a quantity stands in a row, and the factor from its unit to the laboratory's."""

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


def find_header(
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
            plain(c) == plain(v) or plain(split_unit(c)[0]) == plain(v) for c in cells for v in wanted.values()
        )
        if score and (best is None or score > best[1]):
            best = (k, score)
    if best is None and first_number is None:
        raise MeasurementError(
            "no row of numbers",
            file=text.file,
            line=text.rows[0].line,
            expected="a table of numbers",
            got=" | ".join(text.rows[0].cells)[:120],
        )
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
        raise MeasurementError("a header and no rows", file=text.file, line=header.line, expected="rows of numbers")
    return start, list(header.cells), row_units, header.line


def find_columns(
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
) -> list[Column]:
    split = [split_unit(n) for n in names]
    taken: list[Column] = []
    for quantity in quantities:
        if quantity in wanted:
            fits = [k for k, n in enumerate(names) if plain(wanted[quantity]) in (plain(n), plain(split[k][0]))]
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
        taken.append(Column(quantity, k, names[k], factor))
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
        raise MeasurementError(f'"{given}" is no unit of {quantity.value}', expected=known_units(dimension), got=given)
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
    warnings.append(f'{path.name}: no unit for {quantity.value} (column "{header}"), {dimension.value} assumed')
    return 1.0
