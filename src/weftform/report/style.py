"""How every figure looks: quiet axes, a title that says what is shown, a caption that says what was run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from weftform.errors import ResultError

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from matplotlib.axes import Axes

    from weftform.result import Result

INK = "#22262b"
"""Text and main lines."""
FAINT = "#6f7780"
"""Captions, tool outlines, secondary lines."""
HAIR = "#d9dde1"
"""Grids."""
COLOURS = {
    "blue": "#2563a8",
    "orange": "#d9741a",
    "green": "#2d8a5f",
    "red": "#c23b3b",
    "violet": "#7a52a8",
    "grey": "#6f7780",
}
"""Colours of curves, told apart in print and by colour-blind readers together with their labels."""
MAP = "viridis"
"""Perceptually uniform colour map of fields."""
DPI = 200

_SETTINGS: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": "#9aa1a8",
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": False,
    "grid.color": HAIR,
    "grid.linewidth": 0.6,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.minor.visible": False,
    "lines.linewidth": 1.6,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "path.simplify": False,
}

SYMMETRY_WORDS = {1: "full model", 2: "half model", 4: "quarter model"}


def house_style() -> AbstractContextManager[Any]:
    """The settings of matplotlib under which all figures are drawn; those of the caller come back afterwards."""
    return rc_context(_SETTINGS)


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inches], outside of pyplot."""
    figure = Figure(figsize=(width, height), dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


def headline(figure: Figure, title: str, caption: str, *, left: float = 0.16) -> None:
    """Write the title above and the caption below, ``left`` inches from the edge."""
    width, height = figure.get_size_inches()
    figure.text(left / width, 1.0 - 0.15 / height, title, size=11.5, weight="bold", va="top", ha="left")
    figure.text(left / width, 0.13 / height, caption, size=7.2, color=FAINT, va="bottom", ha="left", linespacing=1.5)


def place(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Axes at a place given in inches from the lower left corner of the figure."""
    across, along = figure.get_size_inches()
    return figure.add_axes((left / across, bottom / along, width / across, height / along))


def run_words(result: Result, frame: int, note: str = "") -> str:
    """Caption: what was run, with which fabric and mesh, and at which stroke the fields are shown.

    Parameters
    ----------
    frame
        Index of the instant shown.
    note
        Said after it, on a line of its own.
    """
    grid, study = result.grid, result.study
    card = study.model.fabric.card
    if card.endswith(".toml"):
        card = Path(card).stem
    pitch = f"{grid.warp_pitch:.3g} mm"
    if abs(grid.warp_pitch - grid.weft_pitch) > 1e-3 * grid.warp_pitch:
        pitch = f"{grid.warp_pitch:.3g} × {grid.weft_pitch:.3g} mm"
    words = (
        f"Study {study.name}, card {card}, {grid.cell_count:,} cells of {pitch} ({SYMMETRY_WORDS[grid.copies]}), "
        f"{way_word(result)} {result.strokes[frame]:.4g} mm."
    )
    return f"{words}\n{note}" if note else words


def way_word(result: Result) -> str:
    """What ``displacement_mm`` is called in this kind of study."""
    return "stroke" if result.study.model.kind == "forming" else "displacement"


def save(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG.

    Raises
    ------
    ResultError
        The file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, format="png", dpi=DPI)
    except OSError as problem:
        raise ResultError(f"the figure cannot be written ({problem.strerror})", file=path) from None
    return path
