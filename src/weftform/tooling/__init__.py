"""Rigid tools: shapes as signed distances, what moves them, friction."""

from weftform.tooling.tools import RigidTool, flat_punch, hemisphere, opening

__all__ = ["RigidTool", "flat_punch", "hemisphere", "opening"]
