"""Typed errors. Each names the place, what was expected, what was found and, where possible, a hint."""

from __future__ import annotations

from pathlib import Path


class WeftformError(Exception):
    """Something the user can mend; the command line prints it without a traceback.

    Parameters
    ----------
    message
        What is wrong, in one sentence.
    file, line, key
        Where: the file, its line (1 = first) and the dotted key.
    expected, got
        What was wanted and what was there.
    hint
        What to do next.
    """

    exit_code = 2

    def __init__(
        self,
        message: str,
        *,
        file: Path | str | None = None,
        line: int | None = None,
        key: str | None = None,
        expected: str | None = None,
        got: str | None = None,
        hint: str | None = None,
    ) -> None:
        self.message = message
        self.file = file
        self.line = line
        self.key = key
        self.expected = expected
        self.got = got
        self.hint = hint
        super().__init__(str(self))

    def __str__(self) -> str:
        place = str(self.file) if self.file is not None else ""
        if self.line is not None:
            place += f", line {self.line}" if place else f"line {self.line}"
        if self.key:
            place += f", key {self.key}" if place else f"key {self.key}"
        parts = [f"{place}: {self.message}" if place else self.message]
        if self.expected is not None:
            parts.append(f"  expected: {self.expected}")
        if self.got is not None:
            parts.append(f"  got:      {self.got}")
        if self.hint is not None:
            parts.append(f"  hint:     {self.hint}")
        return "\n".join(parts)


class CardError(WeftformError):
    """A fabric card that cannot be used."""


class StudyError(WeftformError):
    """A study that cannot be run."""


class ResultError(WeftformError):
    """A result folder that cannot be read or written."""


class DeviceError(WeftformError):
    """A device that was asked for and cannot compute here."""


class MeasurementError(WeftformError):
    """A file of measurements that cannot be used."""


class IdentificationError(WeftformError):
    """An inverse identification that cannot be made as asked."""


class UnstableRun(WeftformError):
    """The simulation blew up; what was computed before is kept."""

    exit_code = 1
