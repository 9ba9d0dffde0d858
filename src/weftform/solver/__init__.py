"""Loop drivers that call the mechanics: explicit dynamics on the yarn grid, stable step, energy ledger."""

from weftform.solver.kernel_cache import use_kernel_folder

use_kernel_folder()

from weftform.solver.simulation import (  # noqa: E402  (the cache folder must be set before kernels are declared)
    Driven,
    Ledger,
    Motion,
    Problem,
    Settings,
    Simulation,
)

__all__ = ["Driven", "Ledger", "Motion", "Problem", "Settings", "Simulation"]
