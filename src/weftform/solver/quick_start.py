"""Loading Numba in less time."""

from __future__ import annotations

import sys


def load_arrays_of_numba() -> None:
    """Load what Numba knows of arrays, without SciPy's linear algebra.

    Numba imports that only to see whether it is there, which takes longer than all else it loads (0.15 s of one second
    to the first step). It is there, since weftform depends on SciPy; and what needs it imports it at that time.
    """
    if "scipy.linalg" in sys.modules or "numba.np.arraymath" in sys.modules:
        return
    sys.modules["scipy.linalg"] = None  # type: ignore[assignment]
    try:
        from numba.np import arraymath
    finally:
        del sys.modules["scipy.linalg"]
    arraymath._HAVE_BLAS = True
