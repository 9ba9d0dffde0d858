"""The sheet as a bead model in LAMMPS: tabulated bonds along the yarns, harmonic corner angles, a spherical indenter.

Has: axial law of the yarns, shear stiffness by angles, damping, frictionless contact with one sphere.
Lacks: membrane law, dashpots of the connectors, friction, die, blank-holder, energy ledger.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

SIDE_MM = 150.0
PHYSICS = "tabulated bonds, corner angles, frictionless sphere"
FORCE_TABLE = 200


def write_input(folder: Path, cells: int, contact: bool, steps: int) -> None:
    """Data, bond table and input script (units: mm, N, tonne, s, as in LAMMPS "units lj": any consistent ones)."""
    pitch, n = SIDE_MM / cells, cells + 1
    nodes = [(i, j) for j in range(n) for i in range(n)]
    number = {node: k + 1 for k, node in enumerate(nodes)}
    bonds = [(a, (a[0] + 1, a[1])) for a in nodes if a[0] < cells] + [
        (a, (a[0], a[1] + 1)) for a in nodes if a[1] < cells
    ]
    angles = [
        ((i + di, j), (i, j), (i, j + dj))
        for i, j in nodes
        for di in (-1, 1)
        for dj in (-1, 1)
        if 0 <= i + di <= cells and 0 <= j + dj <= cells
    ]
    mass = 6.0e-10 * pitch**2
    lines = [
        "sheet", "", f"{len(nodes)} atoms", f"{len(bonds)} bonds", f"{len(angles)} angles",
        "1 atom types", "1 bond types", "1 angle types", "",
        "-90 90 xlo xhi", "-90 90 ylo yhi", "-60 60 zlo zhi", "", "Masses", "", f"1 {mass:.9e}", "", "Atoms # angle", "",
        *(f"{number[a]} 1 1 {a[0] * pitch - 75:.9g} {a[1] * pitch - 75:.9g} 0" for a in nodes),
        "", "Bonds", "", *(f"{k + 1} 1 {number[a]} {number[b]}" for k, (a, b) in enumerate(bonds)),
        "", "Angles", "", *(f"{k + 1} 1 {' '.join(str(number[p]) for p in angle)}" for k, angle in enumerate(angles)),
    ]  # fmt: skip
    (folder / "sheet.data").write_text("\n".join(lines) + "\n")
    table, energy, before = ["YARN", f"N {FORCE_TABLE} EQ {pitch:.9g}", ""], 0.0, 0.0
    for k in range(FORCE_TABLE):
        length = pitch * (0.5 + k / (FORCE_TABLE - 1.0))
        strain = length / pitch - 1.0
        pull = pitch * (50.0 * strain + 3.0e4 * strain**2) if strain > 0 else pitch * 5.0 * strain
        energy += 0.5 * (pull + before) * pitch / (FORCE_TABLE - 1.0) if k else 0.0
        before = pull
        table.append(f"{k + 1} {length:.9g} {energy:.9e} {-pull:.9e}")
    (folder / "yarn.table").write_text("\n".join(table) + "\n")
    step = 1.0e-6
    sphere = f"variable z equal -25.0+{100.0:g}*time\nfix punch all indent 150.0 sphere 0 0 v_z 25.0" if contact else ""
    (folder / "in.sheet").write_text(f"""units lj
atom_style angle
boundary s s s
newton on
pair_style zero 3.0 nocoeff
bond_style table linear {FORCE_TABLE}
angle_style harmonic
special_bonds lj/coul 0 0 0
read_data sheet.data
pair_coeff * *
bond_coeff 1 yarn.table YARN
angle_coeff 1 0.05 90.0
neighbor 0.3 bin
neigh_modify every 100000 delay 0 check no exclude type 1 1
timestep {step}
fix move all nve
fix damp all viscous {200.0 * mass:.6e}
{sphere}
thermo 1000000
run 200
run {steps}
""")


def ns_per_cell_step(folder: Path, cells: int, contact: bool, steps: int) -> float:
    """Time of LAMMPS's own loop [ns per cell per step], one thread."""
    program = shutil.which("lmp")
    if program is None:
        raise RuntimeError("no lmp (Debian: apt-get install lammps)")
    write_input(folder, cells, contact, steps)
    done = subprocess.run(
        [program, "-in", "in.sheet", "-log", "none"], cwd=folder, capture_output=True, text=True, check=False,
        env={"OMP_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"},
    )  # fmt: skip
    times = re.findall(r"Loop time of ([0-9.e+-]+) on 1 procs for (\d+) steps", done.stdout)
    if done.returncode or not times:
        raise RuntimeError(f"LAMMPS failed: {(done.stdout + done.stderr)[-600:]}")
    seconds, made = times[-1]
    return float(seconds) / int(made) / cells**2 * 1e9
