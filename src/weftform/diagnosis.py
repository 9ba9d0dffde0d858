"""Checks of an installation, each with one line of advice for its failure."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

REQUIRED = ("numpy", "scipy", "numba", "h5py", "pydantic", "typer", "rich", "matplotlib", "shapely", "tomlkit")

TINY = (
    "blank.cell_length_mm=7.5",
    "loading.stroke_mm=15",
    "loading.duration_s=0.06",
    "loading.closing_s=0.005",
    "loading.ramp=0.3",
    "loading.end_ramp=0.1",
    "solver.damping_per_s=200",
    "solver.viscosity=0.06",
    "solver.safety=0.85",
    "output.frames=2",
    "output.rows=5",
)
"""Changes that make the shipped hemisphere a run of a fraction of a second, whatever becomes of its loading."""

TINY_SHEAR_DEG = 4.4224
"""Mean shear angle of that run. Stored from a run whose default-size sibling meets the kinematic net and the closed forms (tests);
it is compared, not trusted: a difference means that this machine computes something else."""

TINY_TOLERANCE = 1.0e-4
"""Relative; rounding and other batches of steps, which friction amplifies, change it by some 1e-5. (Before 10 mm of stroke the
fabric is slack, and they change it a hundred times as much.)"""


@dataclass(frozen=True)
class Finding:
    """What was checked, what was found, whether it is well, and what to do if not."""

    what: str
    found: str
    ok: bool
    advice: str = ""

    def as_dict(self) -> dict[str, Any]:
        return dict(self.__dict__)


def diagnose(*, quick: bool = False) -> list[Finding]:
    """All checks; with ``quick`` without the tiny run and the rendering."""
    checks: list[Callable[[], Finding]] = [_python, _versions, _threads, _gpu, _kernel_folder, _writing]
    if not quick:
        checks += [_tiny_run, _drawing, _rendering]
    return [_guarded(check) for check in checks]


def _guarded(check: Callable[[], Finding]) -> Finding:
    """A check that itself fails is a finding."""
    try:
        return check()
    except Exception as problem:
        what = check.__name__.strip("_").replace("_", " ")
        return Finding(what, f"{type(problem).__name__}: {problem}", False, "reinstall weftform in a fresh environment")


def _python() -> Finding:
    from weftform import __version__

    found = f"weftform {__version__}, Python {platform.python_version()}, {platform.system()} {platform.machine()}"
    return Finding("program", found, sys.version_info >= (3, 11), "install Python 3.11 or later")


def _versions() -> Finding:
    found, missing = [], []
    for name in REQUIRED:
        try:
            found.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            missing.append(name)
    return Finding(
        "packages",
        ", ".join(found) + (f"; missing: {', '.join(missing)}" if missing else ""),
        not missing,
        f"pip install {' '.join(missing)}" if missing else "",
    )


def _threads() -> Finding:
    from weftform.processors import usable_processors

    usable, there = usable_processors(), os.cpu_count() or 1
    return Finding("threads", f"{usable} of {there} processors may be used", True)


def _gpu() -> Finding:
    """A GPU is optional, so that there is none is no failure."""
    from weftform.errors import DeviceError
    from weftform.solver.cuda.gpu import find_gpu

    try:
        return Finding("GPU", f"{find_gpu()} (weftform run --device cuda)", True)
    except DeviceError as problem:
        return Finding("GPU", f"none to use: {problem.message}; runs compute on the processor", True)


def _kernel_folder() -> Finding:
    from weftform.solver.kernel_cache import kernel_folder, user_folder

    folder = kernel_folder()
    kept = sum(1 for _ in folder.rglob("*.nbc"))
    return Finding(
        "compiled kernels",
        f"{kept} in {folder}",
        folder.parent == user_folder(),
        "the user's cache folder cannot be written, so kernels may be compiled again after a restart",
    )


def _writing() -> Finding:
    try:
        with tempfile.NamedTemporaryFile(dir=Path.cwd()):
            pass
    except OSError as problem:
        return Finding(
            "this folder", f"cannot be written ({problem.strerror})", False, "give another folder with --out"
        )
    return Finding("this folder", "can be written", True)


def _tiny_run() -> Finding:
    from weftform.execution import run
    from weftform.study import Study

    with tempfile.TemporaryDirectory() as folder:
        summary = run(Study.load("hemisphere-0-90", TINY), Path(folder) / "tiny").summary
    mean = summary["shear_angle_deg"]["mean"]
    ok = abs(mean / TINY_SHEAR_DEG - 1.0) <= TINY_TOLERANCE and summary["energy"]["balance_error"] < 0.01
    return Finding(
        "tiny run",
        f"mean shear angle {mean:.4f} deg (stored: {TINY_SHEAR_DEG:.4f}), ledger closed within "
        f"{100 * summary['energy']['balance_error']:.2g} %, {summary['ns_per_cell_step']:.0f} ns per cell per step",
        ok,
        "remove the folder of compiled kernels named above and try again; if it stays, report it with this output",
    )


def _drawing() -> Finding:
    import io

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(2, 2))
    FigureCanvasAgg(figure)
    figure.add_subplot().plot([0, 1], [0, 1])
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return Finding("figures", f"drawn off-screen ({len(file.getvalue())} bytes)", len(file.getvalue()) > 1000)


def _rendering() -> Finding:
    """3D rendering is optional; tried in a process of its own, because a missing display can abort it."""
    try:
        version = metadata.version("pyvista")
    except metadata.PackageNotFoundError:
        return Finding(
            "3D view", "pyvista is not installed; `weftform view` writes pictures (pip install weftform[view])", True
        )
    script = (
        "import pyvista as p; q = p.Plotter(off_screen=True, window_size=(64, 64)); q.add_mesh(p.Sphere()); "
        "i = q.screenshot(return_img=True); assert i.std() > 0; print('rendered')"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=False)
    return Finding(
        "3D view",
        f"pyvista {version} " + ("renders off-screen" if "rendered" in done.stdout else "cannot render off-screen"),
        "rendered" in done.stdout,
        "install the OpenGL libraries of the system (Debian: libgl1 libegl1), or uninstall pyvista to have pictures only",
    )
