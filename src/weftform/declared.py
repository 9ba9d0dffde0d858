"""Reading declared TOML: one clear message that names file, line, key, expected, got and a hint."""

from __future__ import annotations

import difflib
import re
import tomllib
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from weftform.errors import WeftformError

Model = TypeVar("Model", bound=BaseModel)

LARGEST_FILE = 20_000_000
"""Bytes; a card or study is a page of text, so anything larger is some other file."""


def read_toml(path: Path, error: type[WeftformError]) -> tuple[dict[str, Any], str]:
    """Read a TOML file; returns its tables and its text (for line numbers in later messages)."""
    try:
        if path.is_dir():
            raise error("this is a folder", file=path, expected="a TOML file")
        if path.stat().st_size > LARGEST_FILE:
            raise error("this file is too large", file=path, expected="a TOML file of a few kilobytes")
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise error("no such file", file=path, hint=_nearby(path)) from None
    except UnicodeDecodeError:
        raise error("this is not a text file in UTF-8", file=path, expected="TOML") from None
    except OSError as problem:
        raise error(f"cannot be read ({problem.strerror})", file=path) from None
    try:
        return tomllib.loads(text), text
    except tomllib.TOMLDecodeError as problem:
        found = re.search(r"\(at line (\d+)", str(problem))
        raise error(
            f"not valid TOML: {re.sub(r' *[(]at .*[)]', '', str(problem))}",
            file=path,
            line=int(found.group(1)) if found else None,
            hint='lines look like: key = 3.5, key = "text", or [table]',
        ) from None


def _nearby(path: Path) -> str | None:
    try:
        names = [p.name for p in path.parent.iterdir() if p.suffix == ".toml"]
    except OSError:
        return f"the folder {path.parent} does not exist"
    close = difflib.get_close_matches(path.name, names, 3, 0.5)
    return f"did you mean {', '.join(close)}?" if close else None


def line_of(text: str, location: tuple[str | int, ...]) -> int | None:
    """Line (1 = first) of a key in TOML text, or of its table where the key itself is not written."""
    names = [str(part) for part in location if not isinstance(part, int)]
    table: list[str] = []
    best: tuple[int, int] | None = None
    for number, line in enumerate(text.splitlines(), 1):
        header = re.match(r"\s*\[\[?\s*([^\]]+?)\s*\]\]?\s*(#.*)?$", line)
        if header:
            table = [part.strip().strip("\"'") for part in header.group(1).split(".")]
            here = table
        else:
            pair = re.match(r"\s*([A-Za-z0-9_.\"'-]+)\s*=", line)
            if not pair:
                continue
            here = table + [part.strip("\"'") for part in pair.group(1).split(".")]
        if here == names[: len(here)] and (best is None or len(here) > best[0]):
            best = (len(here), number)
    return best[1] if best else None


def known_keys(model: type[BaseModel], location: tuple[str | int, ...]) -> list[str]:
    """Names allowed at a place of a declared model; empty where the place cannot be resolved."""
    table = _model_in(_declared_at(model, location))
    return list(getattr(table, "model_fields", {}))


def _declared_at(model: type[BaseModel], location: tuple[str | int, ...]) -> Any:
    """What a declared model says about a place: a type, with its limits; None where the place cannot be resolved."""
    current: Any = model
    named = False
    for part in location:
        if isinstance(part, int):
            continue
        if named:
            # a name that the file chooses, such as that of a tool
            named = False
            continue
        fields = getattr(_model_in(current), "model_fields", {})
        if part not in fields:
            return None
        found = fields[part]
        named = get_origin(found.annotation) is dict
        current = Annotated[(found.annotation, *found.metadata)] if found.metadata else found.annotation
    return current


NAMES: dict[Any, str] = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}
LIMITS = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}


def wanted(declared: Any) -> str | None:
    """What a declared place takes, in words: ``a number, greater than 0 and at most 0.5``; None where words are lacking."""
    origin, arguments = get_origin(declared), get_args(declared)
    if origin is Annotated:
        kind, *metadata = arguments
        words = wanted(kind)
        limits = [
            f"{word} {limit}"
            for part in metadata
            # a pydantic Field carries its limits in a list of its own
            for rule in getattr(part, "metadata", [part])
            for name, word in LIMITS.items()
            if (limit := getattr(rule, name, None)) is not None
        ]
        return f"{words}, {' and '.join(limits)}" if words and limits else words
    if origin is Literal:
        return ("one of " if len(arguments) > 1 else "") + ", ".join(str(choice) for choice in arguments)
    if origin in (Union, UnionType):
        choices = [choice for choice in arguments if choice is not type(None)]
        return wanted(choices[0]) if len(choices) == 1 else None
    if origin is None and (table := _model_in(declared)) is not None:
        return "a table with the keys " + ", ".join(table.model_fields)
    return NAMES.get(declared) if origin is None else None


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        found = _model_in(inner)
        if found is not None:
            return found
    return None


def validated(
    model: type[Model],
    values: dict[str, Any],
    error: type[WeftformError],
    *,
    file: Path | str | None = None,
    text: str = "",
) -> Model:
    """Check tables against a model; the first problem becomes one typed error."""
    try:
        return model.model_validate(values)
    except ValidationError as problem:
        # An unknown key explains more than the missing one it was meant to be.
        problems = sorted(problem.errors(), key=lambda e: e["type"] != "extra_forbidden")
        first = problems[0]
        location = tuple(
            p for p in first["loc"] if isinstance(p, int) or not str(p).startswith(("function-", "tagged-"))
        )
        key = ".".join(str(p) for p in location)
        line = line_of(text, location) if text else None
        others = len(problems) - 1
        more = f" ({others} more problem{'s' if others > 1 else ''} in this file)" if others else ""
        if first["type"] == "extra_forbidden":
            allowed = known_keys(model, location[:-1])
            close = difflib.get_close_matches(str(location[-1]), allowed, 1, 0.5)
            raise error(
                f"unknown key{more}",
                file=file,
                line=line,
                key=key,
                expected=("one of " + ", ".join(allowed)) if allowed else None,
                hint=f"did you mean {close[0]}?" if close else None,
            ) from None
        message = first["msg"].removeprefix("Value error, ")
        if first["type"] in ("model_type", "dict_type"):
            message = "a table is needed here"
        raise error(
            f"{message[0].lower()}{message[1:]}{more}",
            file=file,
            line=line,
            key=key or None,
            expected=None if first["type"] == "value_error" else wanted(_declared_at(model, location)),
            got=None if first["type"] in ("missing", "value_error") else repr(first["input"])[:200],
        ) from None
