"""Small problems on both devices. As a program: run one on the CUDA simulator and keep what it computed.

NUMBA_ENABLE_CUDASIM=1 python cuda_cases.py CASE STEPS THREADS FILE
"""

from __future__ import annotations

import dataclasses
import sys

import numpy as np
from small_problems import (
    FABRIC,
    STILL,
    affine,
    ball,
    bias_grid,
    edge_nodes,
    plate,
    smooth_velocities,
    whole_grid,
)

from weftform.fabric import Fabric
from weftform.solver import Driven, Motion, Problem, Settings, Simulation, loop, survey

TABULATED = Fabric.load(
    "hexforce-48600-c1300",
    override={
        "shear": {
            "law": "tabulated",
            "quantity": "shear-stress",
            "shear_angle_deg": [0.0, 10.0, 30.0, 50.0, 70.0],
            "values": [0.0, 0.001, 0.02, 0.03, 0.4],
        }
    },
)
"""A shear law that no polynomial follows: many pieces, which the kernels read from an array."""


def between_tools(grid, **settings):
    """A ball pushed into a patch between a fixed plate and one under a force, with friction."""
    tools = (
        plate("above", -1.0, friction=0.2),
        plate("below", 1.0, "force", friction=0.2, force=20.0),
        ball(1.0, away=0.002, friction=0.2),
    )
    motions = (Motion((0.0, 0.001), (0.0, 0.2)), Motion((0.0, 0.0002), (0.0, 1.0)))
    return Problem(grid, FABRIC, tools, motions, stroke=0, holding=1, settings=Settings(**settings))


def gripped(grid, fabric=FABRIC):
    """A patch sheared by its edges, which also turn; the upper row is held along x only."""
    nodes = edge_nodes(grid)
    held = np.ones((len(nodes), 3), bool)
    held[nodes >= grid.shape[1] * (grid.shape[0] - 1), 1:] = False
    turn = affine(grid, [[0.0, -1.0], [1.0, 0.0]]).reshape(-1, 3)[nodes]
    shear = affine(grid, [[1.0, 0.3], [0.3, 1.0]]).reshape(-1, 3)[nodes]
    shrink = affine(grid, [[2.0, 0.0], [0.0, 2.0]]).reshape(-1, 3)[nodes]
    motions = (Motion((0.0, 0.001, 0.002), (0.0, 1.0, 0.2)), Motion((0.0, 0.003), (0.0, 0.4)))
    drive = Driven(nodes, held, np.stack([shear, shrink, turn]), (0, 1, 1), (loop.IDENTITY, loop.COSINE, loop.SINE))
    return Problem(grid, fabric, motions=motions, driven=drive, settings=Settings(damping=200.0, hourglass=0.05))


def free(grid):
    nobody = Driven(np.zeros(0, np.int64), np.zeros((0, 3), bool), np.zeros((1, 0, 3)), (0,), (0,))
    return Problem(grid, FABRIC, motions=(STILL,), driven=nobody)


CASES = {
    "tools": lambda: between_tools(whole_grid(8, 1), damping=300.0, least_step=4e-6),
    "tools and half cells": lambda: between_tools(bias_grid(5), mass_scaling=2.0),
    "quarter along the bias": lambda: between_tools(bias_grid(9, planes=("x", "y"))),
    "grips": lambda: gripped(whole_grid(4, 4)),
    "tabulated shear": lambda: gripped(whole_grid(4, 4), TABULATED),
    "free half cells": lambda: free(bias_grid(2)),
}


def march(simulation, steps):
    """Go on until so many steps are made."""
    while simulation.steps < steps:
        # a little less than whole steps, so that rounding of the time does not decide about one more
        simulation.advance_to(simulation.time + (min(40, steps - simulation.steps) - 0.5) * simulation.step)


def compute(case, steps, device):
    """What a case looks like after ``steps`` steps, half of them from a checkpoint."""
    problem = CASES[case]()
    grid = problem.grid
    simulation = Simulation(problem, device=device)
    simulation.velocities = smooth_velocities(grid, 50.0)
    simulation.compile()
    march(simulation, steps // 2)
    saved = simulation.checkpoint()
    simulation = Simulation(problem, device=device)
    simulation.restore(saved)
    march(simulation, steps)
    saved = simulation.checkpoint()
    return {
        "steps": np.array(float(simulation.steps)),
        "step": np.array(simulation.step),
        "inertia": saved["inertia"],
        "displacements": (simulation.positions - grid.flat)[grid.active],
        "velocities": simulation.velocities[grid.active],
        "contact forces": simulation.contact_forces[grid.active],
        "driven forces": simulation.driven_forces,
        "tools": saved["poses"],
        "strains": simulation.last[[survey.WARP_STRAIN, survey.WEFT_STRAIN, survey.HALF_TANGENT, survey.SLACKEST]],
        "penetration": simulation.last[survey.PENETRATION],
        "fastest": simulation.last[survey.FASTEST],
        "energies": np.array(dataclasses.astuple(simulation.ledger())),
        "shear": np.array([simulation.largest_shear]),
    }


def spare_the_waiting():
    """The simulator polls the threads of a block. Where a block has one thread, that has nobody to wait for."""
    from numba.cuda.simulator.kernel import BlockThread

    begin = BlockThread.start

    def start(thread):
        begin(thread)
        thread.join()

    BlockThread.start = start
    BlockThread.syncthreads = lambda thread: None


if __name__ == "__main__":
    # the simulator polls the threads of a block; with the usual interval it mostly waits for its turn
    sys.setswitchinterval(1e-5)
    from weftform.solver.cuda import driver

    if sys.argv[3] == "1":
        spare_the_waiting()
    driver.SIMULATOR_TILE = dataclasses.replace(driver.SIMULATOR_TILE, threads=int(sys.argv[3]))
    np.savez(sys.argv[4], **compute(sys.argv[1], int(sys.argv[2]), "cuda"))
