"""Everything the paper reports, computed and set beside it."""

from weftform.reproduction.reproduce import Reproduction, reproduce

__all__ = ["Reproduction", "reproduce"]
