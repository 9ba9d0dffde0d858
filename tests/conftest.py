"""Small results to draw, written without the solver: blanks laid over a bump, with a made-up history."""

from __future__ import annotations

import numpy as np
import pytest

from weftform import Result, Study
from weftform.cases import case_of
from weftform.execution import COLUMNS
from weftform.result.fields import Fields
from weftform.result.outline import draw_in, formed_outline
from weftform.result.writer import ResultWriter, claim_folder, write_whole
from weftform.verdict import blank_summary

STROKE = 30.0


def bumped(flat, share):
    """Positions [mm] over a bump as high as ``share`` of the stroke, drawn in towards its centre."""
    distance2 = (flat**2).sum(axis=-1)
    pull = 1.0 - 0.1 * share * np.exp(-distance2 / 70.0**2)
    formed = flat * pull[..., None]
    formed[..., 2] = share * STROKE * np.exp(-distance2 / 30.0**2)
    return formed


def lay_down(name, folder) -> Result:
    study = Study.load(name, ["blank.cell_length_mm=10", "output.frames=3", "output.rows=11"])
    grid = study.grid
    claim_folder(folder)
    write_whole(folder / "study.toml", study.to_toml())

    def fields(share):
        return Fields(grid, study.fabric, bumped(grid.flat, share))

    columns = [*COLUMNS, *case_of(study).columns]
    writer = ResultWriter(folder, columns, fields(0.0))
    for share in np.linspace(0.0, 1.0, 11):
        row = dict.fromkeys(columns, 0.0)
        energies = {
            "internal": 40.0,
            "friction": 900.0,
            "external": 940.0,
            "kinetic": 0.1 * (1.0 - share),
            "contact": 0.2,
        }
        row |= {f"{k}_{'work' if k == 'external' else 'energy'}_mJ": v * share**2 for k, v in energies.items()}
        row |= {"time_s": 0.1 * share, "displacement_mm": STROKE * share, "force_N": 80.0 * share**2}
        writer.row(row)
    for share in (0.0, 0.5, 1.0):
        writer.frame(0.1 * share, STROKE * share, fields(share), np.zeros((*grid.shape, 3)))
    writer.outline(fields(1.0))
    flat, formed, _ = formed_outline(grid, fields(1.0).positions)
    writer.summary(
        {
            "study": study.name,
            "energy": {"balance_error": 1e-4},
            "blank": blank_summary(study),
            "draw_in_mm": draw_in(flat, formed, 0.25 * np.pi),
        }
    )
    writer.close()
    return Result.open(folder)


@pytest.fixture(scope="session")
def along_yarns(tmp_path_factory) -> Result:
    return lay_down("hemisphere-0-90", tmp_path_factory.mktemp("along") / "result")


@pytest.fixture(scope="session")
def along_bias(tmp_path_factory) -> Result:
    return lay_down("hemisphere-45", tmp_path_factory.mktemp("bias") / "result")
