"""The time loop on a GPU, by numba-cuda: the same scalar functions, the whole state on the device.

Imported only where ``--device cuda`` was asked for. :mod:`~weftform.solver.cuda.gpu` says whether there is a GPU to
use, :class:`~weftform.solver.cuda.driver.CudaDriver` runs the steps. Tested under Numba's CUDA simulator and compiled for
sm_90; it has never run on a real GPU.
"""
