"""Figures of a result, and its view in three dimensions."""

from weftform.report.figures import FigureSet, figure_set, register_figures, write_figures

__all__ = ["FigureSet", "figure_set", "register_figures", "write_figures"]
