"""Sample measurements: reconstructed specimens of the paper's fabric, and tables of Cao et al. (2008).

Of the paper's own tests only the equations survived. The specimens written here come from Eq. 4 (with a4
repaired, see the card) and Eq. 8, with scatter of a realistic size from a seeded generator. They are for
learning and testing; they are not measurements, and every file says so.
"""

from __future__ import annotations

import shutil
from importlib import resources
from pathlib import Path

import numpy as np

from weftform.errors import MeasurementError
from weftform.fabric.laws import Floats
from weftform.laboratory.kinematics import bias_force, kinematic_angle

LENGTH, WIDTH, THICKNESS = 150.0, 50.0, 0.62
"""Of the paper's specimens (Sec. 2.1) [mm]."""
TENSILE = (19.75, -123.13, 573.0, -91.645)
"""Eq. 4 repaired, F [N] of u, u^2, ... [mm]."""
TENSILE_END = 3.9
SHEAR = (0.0514, -0.4168, 1.8682, -3.7092, 2.8450)
"""Eq. 8, F_sh [N/mm] of gamma, gamma^2, ... [rad]."""
SLIP_MM = 16.5
"""Where the reconstructed markers leave the kinematic angle (21 degrees, Fig. 6)."""
LAST_MM, LAST_DEG = 50.0, 39.0
"""End of the reconstructed bias-extension test; with it the largest force is the 5.5 N of Sec. 2.3.1."""
SEED = 48600
_LABEL = "RECONSTRUCTED sample (weftform.laboratory.samples, seed {seed}), not a measurement: {what}"

_FILES: dict[str, tuple[str, ...]] = {
    "tensile-warp": tuple(f"tensile-warp-{k}.csv" for k in range(1, 6)),
    "tensile-weft": tuple(f"tensile-weft-{k}.csv" for k in range(1, 6)),
    "bias-extension": tuple(f"bias-extension-{k}.csv" for k in range(1, 6)),
    "bias-extension-markers": ("bias-extension-markers.csv",),
    "bias-extension-layout": ("bias-extension-layout.toml",),
    "dic-aramis": ("dic-aramis.csv",),
    "dic-vic3d": ("dic-vic3d.csv",),
    "cao2008-picture-frame": ("cao2008-picture-frame-plain.csv",),
    "cao2008-bias-extension": ("cao2008-bias-extension-plain.csv",),
}


def sample_names() -> tuple[str, ...]:
    """Names of the shipped sample measurements."""
    return tuple(_FILES)


def sample(name: str) -> list[Path]:
    """Files of a shipped sample.

    Raises
    ------
    MeasurementError
        No sample of that name.
    """
    if name not in _FILES:
        raise MeasurementError(f'no sample named "{name}"', expected=", ".join(_FILES))
    folder = Path(str(resources.files("weftform") / "data" / "samples"))
    return [folder / f for f in _FILES[name]]


def copy_samples(folder: Path) -> list[Path]:
    """Copy all shipped samples into a folder of the user's; returns the copies."""
    folder.mkdir(parents=True, exist_ok=True)
    return [Path(shutil.copy(path, folder)) for name in _FILES for path in sample(name)]


def tensile_force(displacement: Floats) -> Floats:
    """Eq. 4 repaired, then damage: stiffness that fades beyond 3.9 mm until the cloth unweaves [N]."""
    powers = np.arange(1, 5)
    u = np.asarray(displacement, float)
    inside = np.minimum(u, TENSILE_END)[:, None] ** powers @ np.array(TENSILE)
    slope = float(np.array(TENSILE) * powers @ TENSILE_END ** (powers - 1))
    past = np.maximum(u - TENSILE_END, 0.0)
    return np.asarray(inside + slope * (past - past**2 / 0.3))


def measured_angle(displacement: Floats) -> Floats:
    """Shear angle of zone B [rad]: kinematic up to the onset of slip, then straight to its last value."""
    d = np.asarray(displacement, float)
    at_slip = float(kinematic_angle(SLIP_MM, LENGTH, WIDTH))
    rate = (np.radians(LAST_DEG) - at_slip) / (LAST_MM - SLIP_MM)
    return np.where(d <= SLIP_MM, kinematic_angle(d, LENGTH, WIDTH), at_slip + rate * (d - SLIP_MM))


def write_samples(folder: Path, seed: int = SEED) -> list[Path]:
    """Write the reconstructed files; the same seed gives the same bytes.

    Parameters
    ----------
    folder
        Where to; it must exist.
    seed
        Of the scatter.
    """
    rng = np.random.default_rng(seed)
    written: list[Path] = []

    def write(name: str, text: str, encoding: str = "utf-8") -> None:
        path = folder / name
        path.write_bytes(text.replace("\n", "\r\n" if encoding == "windows-1252" else "\n").encode(encoding))
        written.append(path)

    for direction, share in (("warp", 1.0), ("weft", 0.96)):
        for k in range(1, 6):
            rows = int(rng.integers(85, 115))
            u = np.linspace(0.0, 4.3 + 0.05 * rng.standard_normal(), rows)
            scale = share * (1.0 + 0.02 * rng.standard_normal())
            force = scale * tensile_force(u) + 8.0 * rng.standard_normal(rows)
            force[0] = 0.0
            what = f"Eq. 4 repaired, {direction} x {share:g}, scatter 2 % between specimens, noise 8 N"
            label = _LABEL.format(seed=seed, what=what)
            write(*_instron(k, u, force, label) if direction == "warp" else _french(k, u, force, label))
    for k in range(1, 6):
        rows = int(rng.integers(110, 140))
        d = np.linspace(0.0, LAST_MM, rows)
        scale = 1.0 + 0.02 * rng.standard_normal()
        force = scale * bias_force(measured_angle(d), SHEAR, LENGTH, WIDTH) + 0.01 * rng.standard_normal(rows)
        force[0] = 0.0
        what = "Eq. 8 through Eq. 5, slip from 16.5 mm on, scatter 2 % between specimens, noise 0.01 N"
        lines = [f"# {_LABEL.format(seed=seed, what=what)}", "displacement_mm,force_N"]
        lines += [f"{a:.3f},{b:.4f}" for a, b in zip(d, force, strict=True)]
        write(f"bias-extension-{k}.csv", "\n".join(lines) + "\n")
    write("bias-extension-markers.csv", _markers(rng, seed))
    write("bias-extension-layout.toml", _layout(seed))
    write("dic-aramis.csv", _aramis(rng, seed), "windows-1252")
    write("dic-vic3d.csv", _vic3d(rng, seed))
    return written


def _instron(k: int, u: Floats, force: Floats, label: str) -> tuple[str, str]:
    lines = [
        f'"Comment","{label}"',
        '"Test method","tensile 0 deg"',
        f'"Specimen label","warp {k}"',
        f'"Length (mm)","{LENGTH:.2f}"',
        f'"Width (mm)","{WIDTH:.2f}"',
        "",
        '"Time","Extension","Load"',
        '"(s)","(mm)","(N)"',
    ]
    lines += [f'"{30 * a:.2f}","{a:.4f}","{b:.2f}"' for a, b in zip(u, force, strict=True)]
    return f"tensile-warp-{k}.csv", "\n".join(lines) + "\n"


def _french(k: int, u: Floats, force: Floats, label: str) -> tuple[str, str, str]:
    lines = [f"# {label}", f"Éprouvette trame {k}", "Déplacement (mm);Force (kN)"]
    lines += [f"{a:.4f};{b / 1000.0:.5f}".replace(".", ",") for a, b in zip(u, force, strict=True)]
    return f"tensile-weft-{k}.csv", "\n".join(lines) + "\n", "windows-1252"


_QUADS = (
    ("A upper", "A", "upper", 0.0, 65.0, 0.06),
    ("C upper", "C", "upper", 12.0, 45.0, 0.45),
    ("B upper", "B", "upper", 0.0, 18.0, 1.0),
    ("B centre", "B", "centre", 0.0, 0.0, 1.0),
    ("B lower", "B", "lower", 0.0, -18.0, 1.0),
    ("C lower", "C", "lower", -12.0, -45.0, 0.45),
    ("A lower", "A", "lower", 0.0, -65.0, 0.06),
)
"""Name, zone, half, centre [mm], share of the shear angle of zone B (A and C as in Fig. 7)."""


def _names(k: int) -> list[str]:
    return [f"{k + 1}{corner}" for corner in "nesw"]


def _markers(rng: np.random.Generator, seed: int) -> str:
    """Positions of four markers per quadruple, every 1.25 mm; three of them lost in some images."""
    what = "markers of a bias-extension test, noise 0.02 mm, slip from 16.5 mm on"
    lines = [f"# {_LABEL.format(seed=seed, what=what)}", "image,displacement_mm,marker,x_mm,y_mm"]
    side = 8.0
    for image, d in enumerate(np.arange(0.0, LAST_MM + 0.1, 1.25)):
        for k, (_, _, _, x, y, share) in enumerate(_QUADS):
            half = np.pi / 4 - 0.5 * share * float(measured_angle(np.array([d]))[0])
            across, along = side * np.sin(half), side * np.cos(half)
            centre_y = y + d * (0.5 + y / LENGTH)
            corners = [
                (x, centre_y + along),
                (x + across, centre_y),
                (x, centre_y - along),
                (x - across, centre_y),
            ]
            for name, (px, py) in zip(_names(k), corners, strict=True):
                a, b = np.array([px, py]) + 0.02 * rng.standard_normal(2)
                if name == "3e" and 12 <= image <= 14:
                    continue
                lost = name == "6s" and image == 20
                lines.append(f"{image},{d:.2f},{name}," + ("," if lost else f"{a:.3f},{b:.3f}"))
    return "\n".join(lines) + "\n"


def _layout(seed: int) -> str:
    lines = [f"# {_LABEL.format(seed=seed, what='which four markers make a rhombus, and where it lies')}"]
    for k, (name, zone, half, *_) in enumerate(_QUADS):
        markers = ", ".join(f'"{m}"' for m in _names(k))
        lines += [
            "",
            "[[quadruple]]",
            f'name = "{name}"',
            f'zone = "{zone}"',
            f'half = "{half}"',
            f"markers = [{markers}]",
        ]
    return "\n".join(lines) + "\n"


def _trellis(rng: np.random.Generator, shear: float) -> tuple[Floats, Floats, Floats, Floats]:
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(-9.0, 9.0, 7), np.linspace(-12.0, 12.0, 9)))
    u = (np.sqrt(1.0 - np.sin(shear)) - 1.0) * x + 0.003 * rng.standard_normal(x.size)
    v = (np.sqrt(1.0 + np.sin(shear)) - 1.0) * y + 0.003 * rng.standard_normal(x.size)
    return x, y, u, v


def _aramis(rng: np.random.Generator, seed: int) -> str:
    x, y, u, v = _trellis(rng, np.radians(20.0))
    e_x, e_y = (
        100.0 * (np.sqrt(1.0 - np.sin(np.radians(20.0))) - 1.0),
        100.0 * (np.sqrt(1.0 + np.sin(np.radians(20.0))) - 1.0),
    )
    lines = [
        f"# {_LABEL.format(seed=seed, what='uniform trellis shear of 20 degrees, yarns at 45 degrees')}",
        "GOM Aramis;Flächenkomponente;Stage 16",
        "Point ID;X;Y;Z;Displacement X;Displacement Y;Displacement Z;Epsilon X;Epsilon Y;Epsilon XY",
        ";[mm];[mm];[mm];[mm];[mm];[mm];[%];[%];[%]",
    ]
    for k in range(x.size):
        if k == 30:  # a facet that the system lost
            lines.append(f"{k};{x[k]:.3f};{y[k]:.3f};0,000;;;;;;".replace(".", ","))
            continue
        cells = [x[k], y[k], 0.0, u[k], v[k], 0.0, e_x, e_y, 0.0]
        lines.append(f"{k};" + ";".join(f"{c:.3f}" for c in cells).replace(".", ","))
    return "\n".join(lines) + "\n"


def _vic3d(rng: np.random.Generator, seed: int) -> str:
    x, y, u, v = _trellis(rng, np.radians(20.0))
    e_x, e_y = -np.sin(np.radians(20.0)) / 2.0, np.sin(np.radians(20.0)) / 2.0
    lines = [
        f"# {_LABEL.format(seed=seed, what='uniform trellis shear of 20 degrees, yarns at 45 degrees')}",
        '"X", "Y", "Z", "U", "V", "W", "exx", "eyy", "exy"',
    ]
    for k in range(x.size):
        lines.append(", ".join(f"{c:.5f}" for c in (x[k], y[k], 0.0, u[k], v[k], 0.0, e_x, e_y, 0.0)))
    return "\n".join(lines) + "\n"
