"""The figures of a result: which there are for each kind of study, and writing them.

A kind of study has a figure set, a function that makes named figures one after another; :func:`register_figures` adds
one. Kinds without a set of their own get force, energies and the shear angle on the deformed shape.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from weftform.report.curves import energies_figure, force_figure, shear_law_figure
from weftform.report.edges import outline_figure
from weftform.report.maps import above_map, deformed_map, flat_map, oblique_map
from weftform.report.style import house_style, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from weftform.result import Result

FigureSet = Callable[["Result", int], Iterator[tuple[str, "Figure"]]]
"""From a result and the index of an instant to file names (without ``.png``) and figures, made when asked for."""


def forming_figures(result: Result, frame: int) -> Iterator[tuple[str, Figure]]:
    """Formed part obliquely and from above, flat map, outline, punch force and energies."""
    yield "shear-angle-formed", oblique_map(result, frame)
    yield "shear-angle-above", above_map(result, frame)
    yield "shear-angle-flat", flat_map(result, frame)
    yield "outline", outline_figure(result, frame)
    yield "punch-force", force_figure(result, frame, "Punch force")
    yield "energies", energies_figure(result, frame)


def generic_figures(result: Result, frame: int) -> Iterator[tuple[str, Figure]]:
    """Deformed shape, force and energies of a study without tools."""
    yield "shear-angle-deformed", deformed_map(result, frame)
    yield "force", force_figure(result, frame)
    yield "energies", energies_figure(result, frame)


def shear_test_figures(result: Result, frame: int) -> Iterator[tuple[str, Figure]]:
    """Figures of a bias test or a picture frame: those of every test, and the shear law that comes back."""
    yield from generic_figures(result, frame)
    yield "shear-force", shear_law_figure(result, frame)


_SETS: dict[str, FigureSet] = {
    "forming": forming_figures,
    "bias-extension": shear_test_figures,
    "picture-frame": shear_test_figures,
}


def register_figures(kind: str, figures: FigureSet) -> None:
    """Use a figure set for all results of a kind of study.

    Parameters
    ----------
    kind
        ``kind`` of the study file.
    figures
        Yields pairs of file name (without ``.png``) and figure.
    """
    _SETS[kind] = figures


def figure_set(kind: str) -> FigureSet:
    """The figure set of a kind of study; the generic one where it has none."""
    return _SETS.get(kind, generic_figures)


def write_figures(result: Result, folder: Path | None = None, *, stroke: float | None = None) -> list[Path]:
    """Write the figures of a result as PNG.

    Parameters
    ----------
    folder
        Where to; ``figures`` in the result folder without.
    stroke
        Maps show the computed instant nearest to this stroke [mm]; the last one without.

    Returns
    -------
    The files, in the order in which a report shows them.

    Raises
    ------
    ResultError
        The result lacks a file, that stroke was not computed, or the folder cannot be written.
    """
    folder = result.folder / "figures" if folder is None else Path(folder)
    frame = result.frame_at(stroke)
    with house_style():
        figures = figure_set(result.study.model.kind)(result, frame)
        return [save(figure, folder / f"{name}.png") for name, figure in figures]
