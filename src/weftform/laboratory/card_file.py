"""Writing what the laboratory found into a fabric card, whole and valid or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import Table

from weftform.declared import read_toml
from weftform.errors import CardError, WeftformError
from weftform.fabric.fabric import Fabric, shipped_cards
from weftform.laboratory.fitting import PolynomialFit
from weftform.laboratory.markers import MarkerTracking
from weftform.laboratory.specimen import Specimen
from weftform.laboratory.tabulating import TableFit

NEEDED = {
    ("fabric", "areal_weight_g_m2"): "--areal-weight G_PER_M2",
    ("fabric", "thickness_mm"): "--thickness MM",
    ("tension", "warp"): "`weftform characterise tensile --direction warp` or --tension-stiffness N_PER_MM",
    ("tension", "weft"): "`weftform characterise tensile --direction weft` or --tension-stiffness N_PER_MM",
    ("shear",): "`weftform characterise bias-extension` (or picture-frame) or --shear-modulus MPA",
}
"""What a card cannot do without, and where each comes from."""


def provenance(
    test: str,
    specimens: Sequence[Specimen],
    fit: PolynomialFit | TableFit,
    interval: tuple[float, float],
    interval_unit: str,
    response_unit: str,
    warnings: Sequence[str],
    *,
    tracking: Sequence[MarkerTracking] = (),
    more: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """What a table of a card was made from: files and their hashes, interval, fit quality, warnings.

    ``interval_unit`` and ``response_unit`` (``mm``, ``N``) end the keys of the interval and of the residual.
    """
    files = {str(s.file): (s.file.name, s.sha256) for s in specimens}
    files |= {str(t.file): (t.file.name, t.sha256) for t in tracking}
    quality: dict[str, Any] = {
        "points": fit.points,
        f"rms_{response_unit}": float(fit.rms),
        "r_squared": float(fit.r_squared),
    }
    if isinstance(fit, PolynomialFit):
        quality |= {
            "standard_errors": [float(v) for v in fit.standard_errors],
            "covariance": [[float(v) for v in row] for row in fit.covariance],
            "monotone_constraint_acts": fit.constrained,
        }
    return {
        "test": test,
        "written_by": f"weftform {_version()}",
        "specimens": [s.name for s in specimens],
        "files": [{"name": name, "sha256": digest} for name, digest in files.values()],
        f"interval_{interval_unit}": [float(v) for v in interval],
        **quality,
        **(more or {}),
        "warnings": list(warnings),
    }


def _version() -> str:
    try:
        return version("weftform")
    except PackageNotFoundError:
        return "(not installed)"


def write_card(
    output: Path,
    tables: Mapping[tuple[str, ...], Mapping[str, Any]],
    origin: Mapping[str, Mapping[str, Any]],
    *,
    base: str | Path | None = None,
    defaults: Mapping[tuple[str, ...], Any] | None = None,
    name: str | None = None,
) -> Fabric:
    """Write a new card, or put tables into one that exists; comments of an existing card stay.

    Parameters
    ----------
    output
        The card; updated where it exists.
    tables
        New tables by their place, ``("tension", "warp")`` or ``("shear",)``; each replaces the old one.
    origin
        Provenance by the same places joined with ``-``.
    base
        Card (shipped name or file) that a new card takes its other tables from.
    defaults
        Values from options by their place, for what the card does not have.
    name
        Of a new card; the name of the file by default.

    Raises
    ------
    CardError
        The card lacks something (all of it is listed, with where to get it), contradicts an option, or
        would not be valid. Nothing is written then.
    """
    if output.suffix != ".toml":
        raise CardError("a card is a TOML file", file=output, expected="a name ending in .toml")
    if not output.parent.is_dir():
        raise CardError(f"the folder {output.parent} does not exist", file=output)
    document, fresh = _document(output, base)
    if fresh:
        document["name"] = name or output.stem
    elif name is not None and document.get("name") != name:
        raise CardError(
            f"the card is named {document.get('name')}, the option says {name}",
            file=output,
            key="name",
            hint="leave --name out, or write to another file",
        )
    for place, value in (defaults or {}).items():
        old = _find(document, place)
        if old is None or (fresh and place[0] == "fabric"):
            _put(document, place, value)
        elif place[0] == "fabric" and old != value:
            raise CardError(
                f"the card says {old}, the option {value}",
                file=output,
                key=".".join(place),
                hint="leave the option out",
            )
    for place, table in tables.items():
        _put(document, place, table)
    for key, table in origin.items():
        _put(document, ("provenance", key), table)
    missing = [(place, how) for place, how in NEEDED.items() if _find(document, place) is None]
    if missing:
        raise CardError(
            "the card would lack " + ", ".join(".".join(place) for place, _ in missing) + "; nothing is written",
            file=output,
            hint="; ".join(f"{'.'.join(place)}: {how}" for place, how in missing)
            + "; or take them all from a card: --from CARD",
        )
    return _commit(output, tomlkit.dumps(document).rstrip("\n") + "\n")


def existing_value(output: Path | None, base: str | Path | None, place: tuple[str, ...]) -> Any:
    """A value of the card being updated, or of the one a new card starts from; None where there is none."""
    if output is None or not output.exists():
        if base is None:
            return None
        path = shipped_cards().get(str(base), Path(base))
    else:
        path = output
    values, _ = read_toml(path, CardError)
    return _find(values, place)


def _document(output: Path, base: str | Path | None) -> tuple[tomlkit.TOMLDocument, bool]:
    if output.exists():
        if base is not None:
            raise CardError(
                "the card exists, so it is updated and takes nothing from another",
                file=output,
                hint="leave --from out, or write to another file",
            )
        _, text = read_toml(output, CardError)
        return tomlkit.parse(text), False
    document = tomlkit.document()
    document["format"] = 1
    if base is None:
        return document, True
    source = Fabric.load(base)
    path = shipped_cards().get(str(base), Path(base))
    values, _ = read_toml(path, CardError)
    # Comments, weave and counts are left behind: they describe the other fabric.
    document["fabric"] = _item({key: values["fabric"][key] for key in ("areal_weight_g_m2", "thickness_mm")})
    for key in ("tension", "shear", "membrane"):
        if key in values:
            document[key] = _item(values[key])
    document["provenance"] = _item({"taken_from": f'card "{source.name}", except where a table below says otherwise'})
    return document, True


def _find(document: Mapping[str, Any], place: tuple[str, ...]) -> Any:
    current: Any = document
    for key in place:
        if not isinstance(current, Mapping) or key not in current:
            return None
        current = current[key]
    return current


def _put(document: tomlkit.TOMLDocument, place: tuple[str, ...], value: Any) -> None:
    current: Any = document
    for key in place[:-1]:
        if key not in current:
            current[key] = tomlkit.table(is_super_table=True)
        current = current[key]
    current[place[-1]] = _item(value)


def _item(value: Any) -> Any:
    """A value as TOML: tables as tables, long lists on several lines."""
    if isinstance(value, Mapping):
        table: Table = tomlkit.table()
        for key, inner in value.items():
            if inner is not None:
                table[key] = _item(inner)
        return table
    if isinstance(value, list | tuple):
        array = tomlkit.array()
        for inner in value:
            if isinstance(inner, Mapping):
                line = tomlkit.inline_table()
                line.update(inner)
                array.append(line)
            else:
                array.append(_item(inner) if isinstance(inner, list | tuple) else inner)
        array.multiline(len(value) > 6 or any(isinstance(v, list | tuple | Mapping) for v in value))
        return array
    return tomlkit.item(value)


def _commit(output: Path, text: str) -> Fabric:
    """Write beside the card, load what was written as a study would, and only then put it in place."""
    handle, name = tempfile.mkstemp(prefix=f".{output.stem}-", suffix=".toml", dir=output.parent)
    draft = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as stream:
            stream.write(text)
        try:
            Fabric.load(draft)
        except WeftformError as problem:
            raise CardError(
                f"the card would not be valid, nothing is written: {problem.message}",
                file=output,
                key=problem.key,
                expected=problem.expected,
                got=problem.got,
                hint=problem.hint,
            ) from None
        draft.chmod(output.stat().st_mode if output.exists() else 0o644)
        os.replace(draft, output)
    finally:
        draft.unlink(missing_ok=True)
    return Fabric.load(output)
