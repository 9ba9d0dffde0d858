"""The simulations behind the comparison, run side by side in processes of their own."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from weftform.reproduction.picture_frames import frame_runs, write_cards
from weftform.result import Result

SHORT = ("loading.displacement_mm=20", "loading.duration_s=0.4", "output.rows=81", "output.frames=3")
"""The bias test to 20 mm at the speed of the shipped study, for comparisons between meshes and speeds."""

RUNS: dict[str, tuple[str, tuple[str, ...]]] = {
    "bias": ("bias-extension", ()),
    "bias-constant": ("bias-extension-constant-g", ()),
    "hemisphere-45": ("hemisphere-45", ()),
    "hemisphere-0-90": ("hemisphere-0-90", ()),
    "hemisphere-full": ("hemisphere-0-90", ("blank.symmetry=full", "output.frames=2")),
    "hemisphere-fine": (
        "hemisphere-0-90",
        ("blank.cell_length_mm=1.92", "solver.least_step_s=1.43e-6", "output.frames=2"),
    ),
    "hemisphere-slow": ("hemisphere-0-90", ("loading.duration_s=0.285", "output.frames=2")),
    "hemisphere-coarse": ("hemisphere-0-90", ("blank.cell_length_mm=3.77", "output.frames=2")),
    "bias-slow": ("bias-extension", (*SHORT[:1], "loading.duration_s=0.8", *SHORT[2:])),
    "bias-fine": ("bias-extension", (*SHORT, "specimen.cell_length_mm=1.96")),
    "bias-middle": ("bias-extension", SHORT),
    "bias-coarse": ("bias-extension", (*SHORT, "specimen.cell_length_mm=3.93")),
    "bias-e0.01": ("bias-extension-e0.01", ()),
    "bias-e0.1": ("bias-extension-e0.1", ()),
    "bias-e1": ("bias-extension-e1", ()),
    "tensile-warp": ("tensile-warp", ()),
    "tensile-weft": ("tensile-weft", ()),
    "tensile-1": ("tensile-warp", ("specimen.cell_length_mm=1", "solver.damping_per_s=500", "output.rows=40")),
    "tensile-2.5": ("tensile-warp", ("specimen.cell_length_mm=2.5",)),
    "tensile-5": ("tensile-warp", ("specimen.cell_length_mm=5",)),
    "picture-frame": ("picture-frame", ()),
    "shear-cycle": ("shear-cycle", ()),
    "element-shear": ("element-shear", ()),
    "element-tension-shear": ("element-tension-shear", ()),
    "element-tension-rotation": ("element-tension-rotation", ()),
    "element-hybrid": ("element-hybrid", ()),
    "element-hybrid-log": (
        "element-hybrid",
        (
            'fabric.override.tension.warp={law = "log-strain", stiffness_N_per_mm = 35400.0, specimen_length_mm = 1.0, '
            "specimen_width_mm = 1.0}",
        ),
    ),
}
"""Name of each run, its shipped study and what is changed in it; the longest first."""


def _run_one(name: str, study: str, changes: tuple[str, ...], folder: str) -> str:
    """Run one study; a function of the module so that a process can be given it."""
    from weftform.execution import run
    from weftform.study import Study

    run(Study.load(study, changes), Path(folder) / name, threads=1)
    return name


def run_all(folder: Path, watch: Callable[[str, int, int], None] | None = None) -> dict[str, Result]:
    """Run everything into ``folder``; ``watch`` is called with the name, the number done and the number of runs.

    The cards of the real picture frames are written there first, into ``cards``.
    """
    runs = RUNS | frame_runs(write_cards((folder / "cards").absolute()))
    workers = max(1, min(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 2, 8))
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        # the first of each kind compiles its kernels; those that share a layout find them in the cache
        jobs = [pool.submit(_run_one, name, *what, str(folder)) for name, what in runs.items()]
        for done, job in enumerate(as_completed(jobs), 1):
            name = job.result()
            if watch is not None:
                watch(name, done, len(jobs))
    return {name: Result.open(folder / name) for name in runs}
