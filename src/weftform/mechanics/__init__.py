"""Scalar functions of the physics: connector, membrane, contact, motion, stable step.

Pure functions of numbers, compiled by Numba and called from the loops of ``weftform.solver``. They import
numba and math only, know no arrays of ours and do no input or output.
"""
