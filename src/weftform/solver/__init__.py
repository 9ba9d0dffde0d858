"""Loop drivers that call the mechanics: explicit dynamics on the yarn grid, stable step, energy ledger."""

from weftform.solver.kernel_cache import use_kernel_folder

use_kernel_folder()

# ruff: noqa: E402  (the cache folder must be set before kernels are declared)
from weftform.solver.problem import Driven, Ledger, Motion, Problem, Settings
from weftform.solver.simulation import Simulation

__all__ = ["Driven", "Ledger", "Motion", "Problem", "Settings", "Simulation"]
