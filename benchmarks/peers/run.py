"""Other programs on the same sheet, 56 x 56 cells, one thread, in the same session as weftform.

usage: python benchmarks/peers/run.py [--out FILE.json] [--environments DIR] [--rounds N]

LAMMPS is taken from the system (Debian: apt-get install lammps); MuJoCo and Newton are installed from PyPI into
environments of their own. A peer that cannot be had is named with the reason and left out. The programs take turns, the
least time of each counts. Their physics is poorer than weftform's; each file says what it has and lacks.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import lammps_sheet

from weftform.benchmark.measure import weftform_case
from weftform.benchmark.sheet import formed_sheet, formed_source

CELLS = 56
HERE = Path(__file__).resolve().parent
PACKAGES = {"MuJoCo": ("mujoco", "mujoco_sheet.py"), "Newton/Warp": ("newton", "newton_sheet.py")}
PHYSICS = {
    "LAMMPS": lammps_sheet.PHYSICS,
    "MuJoCo": "elastic membrane triangles, implicit frictional contact with a sphere",
    "Newton/Warp": "membrane triangles and springs, single precision, penalty contact with a sphere",
}


def environment(folder: Path, package: str) -> Path:
    """Python of an environment with the package, made if it is not there."""
    python = folder / package / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder / package)], check=True)
        subprocess.run([str(python), "-m", "pip", "-q", "install", package, "numpy"], check=True)
    return python


def measure(name: str, contact: bool, folder: Path) -> float:
    """One measurement [ns per cell per step]."""
    if name == "LAMMPS":
        with tempfile.TemporaryDirectory() as scratch:
            return lammps_sheet.ns_per_cell_step(Path(scratch), CELLS, contact, 300)
    package, script = PACKAGES[name]
    python = environment(folder, package)
    one = {**os.environ, "OMP_NUM_THREADS": "1"}
    one.pop("PYTHONPATH", None)
    done = subprocess.run(
        [str(python), str(HERE / script), str(CELLS), str(int(contact)), "20"],
        capture_output=True, text=True, check=False, env=one,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{name} failed: {(done.stderr or done.stdout).strip()[-300:]}")
    return float(done.stdout.split()[-2])


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--out", type=Path)
    arguments.add_argument("--environments", type=Path, default=Path(tempfile.gettempdir()) / "weftform-peers")
    arguments.add_argument("--rounds", type=int, default=3)
    options = arguments.parse_args()
    source = formed_source()
    ours = {
        contact: weftform_case(formed_sheet(CELLS, contact, source), CELLS, 1, contact, "cpu")
        for contact in (True, False)
    }
    found: dict[tuple[str, bool], list[float]] = {}
    missing: dict[tuple[str, bool], str] = {}
    for turn in range(options.rounds):
        for contact in (True, False):
            for _ in range(10):
                ours[contact].run()
            for name in PHYSICS:
                if (name, contact) in missing:
                    continue
                try:
                    found.setdefault((name, contact), []).append(measure(name, contact, options.environments))
                except (RuntimeError, OSError, subprocess.CalledProcessError) as problem:
                    missing[name, contact] = str(problem)
                    print(f"{name}, {'contact' if contact else 'no contact'}: left out: {problem}", file=sys.stderr)
        print(f"round {turn + 1} of {options.rounds}", file=sys.stderr)
    least = {contact: ours[contact].as_dict()["ns_per_cell_step"] for contact in ours}
    table = []
    for contact in (True, False):
        print(f"weftform     contact={contact!s:5} {least[contact]:8.1f} ns per cell per step")
        for name, physics in PHYSICS.items():
            if not found.get((name, contact)):
                continue
            value = min(found[name, contact])
            ratio = value / least[contact]
            print(f"{name:12} contact={contact!s:5} {value:8.1f} ns per cell per step, {ratio:.1f} times weftform")
            table.append(
                {
                    "program": name, "physics": physics, "contact": contact, "cells": CELLS**2, "threads": 1,
                    "ns_per_cell_step": round(value, 1), "ratio_to_weftform": round(ratio, 2),
                }
            )  # fmt: skip
    if options.out:
        options.out.write_text(json.dumps(table, indent=2) + "\n")


if __name__ == "__main__":
    main()
