"""What a run leaves: fields, history, summary; probes and outlines."""

from weftform.result.result import Result

__all__ = ["Result"]
