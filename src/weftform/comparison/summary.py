"""The numbers of a comparison as rows of a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from weftform.comparison.tolerance import LIMITED

if TYPE_CHECKING:
    from weftform.comparison.comparison import Comparison


@dataclass(frozen=True)
class Row:
    """One number in words; ``ok`` is None where nothing limits it."""

    item: str
    what: str
    value: str
    tolerance: str = ""
    ok: bool | None = None


def rows(found: Comparison) -> list[Row]:
    """Every number that can be limited, after it the angle at each point."""
    items = found.as_dict()
    verdicts = {v.tolerance.name: v for v in found.verdicts}
    table: list[Row] = []
    last = ""
    for name, limited in LIMITED.items():
        if limited.item not in items:
            continue
        value = _at(items[limited.item], limited.path)
        unit = limited.dimension.value
        words = "none" if value is None else f"{value:.4g} {unit}"
        if limited.percent_path:
            words += f" ({_at(items[limited.item], limited.percent_path):.3g} % of the peak)"
        limit, ok = "", None
        if name in verdicts:
            limit, ok = f"{verdicts[name].tolerance.limit:g} {verdicts[name].tolerance.unit}", verdicts[name].ok
        table.append(Row(limited.item if limited.item != last else "", limited.what, words, limit, ok))
        last = limited.item
        if name == "angle-mean" and found.angles is not None:
            table += _points(found)
    return table


def _points(found: Comparison) -> list[Row]:
    assert found.angles is not None
    limit = found.tolerance("angle")
    return [
        Row(
            "",
            f"  {p.name} ({p.yarn_mm[0]:.4g}, {p.yarn_mm[1]:.4g})",
            f"{p.simulated:.2f} - {p.measured:.2f} = {p.difference:+.2f} deg",
            "",
            None if limit is None else abs(p.difference) <= limit.limit,
        )
        for p in found.angles.points
    ]


def _at(values: Any, path: tuple[str, ...]) -> Any:
    for key in path:
        values = values[key]
    return values
