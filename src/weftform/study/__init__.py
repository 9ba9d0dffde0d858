"""The declared problem: schema, reading, checking, shipped studies."""

from weftform.study.study import Study, shipped_studies

__all__ = ["Study", "shipped_studies"]
