"""Where compiled kernels are kept: one folder per user and per version of the sources that go into them.

Numba's own cache looks only at the file that defines a function; a kernel here is made of functions of several
files, so the folder's name carries a hash of all of them.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from pathlib import Path

import numba
import platformdirs


def user_folder() -> Path:
    """Where the user's programs keep what they can make again."""
    return Path(platformdirs.user_cache_dir("weftform", appauthor=False))


def kernel_folder() -> Path:
    """The folder for this version of the kernels; in the temporary folder where the user's cache cannot be written."""
    package = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256(f"{numba.__version__} {sys.version}".encode())
    for part in ("mechanics", "solver"):
        for source in sorted((package / part).glob("*.py")):
            digest.update(source.read_bytes())
    name = f"kernels-{digest.hexdigest()[:16]}"
    for base in (
        user_folder(),
        Path(tempfile.gettempdir()) / f"weftform-{os.getuid() if hasattr(os, 'getuid') else 'user'}",
    ):
        folder = base / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    raise OSError("neither the user's cache folder nor the temporary folder can be written")


def use_kernel_folder() -> None:
    """Point Numba's cache there, unless the user has set NUMBA_CACHE_DIR."""
    if not os.environ.get("NUMBA_CACHE_DIR"):
        numba.config.CACHE_DIR = str(kernel_folder())  # type: ignore[attr-defined]
