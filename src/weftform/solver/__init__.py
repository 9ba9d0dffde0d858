"""Loop drivers that call the mechanics: explicit dynamics on the yarn grid, stable step, energy ledger."""

from weftform.solver.kernel_cache import use_kernel_folder
from weftform.solver.quick_start import load_arrays_of_numba

load_arrays_of_numba()
use_kernel_folder()

# ruff: noqa: E402  (both come before kernels are declared)
from weftform.solver.problem import Driven, Ledger, Motion, Problem, Settings
from weftform.solver.simulation import Simulation

__all__ = ["Driven", "Ledger", "Motion", "Problem", "Settings", "Simulation"]
