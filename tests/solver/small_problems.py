"""Small problems for the tests of the solver.

Compiled loops are cached per layout. All problems here keep to four: (whole | with half cells) x (at most 8 columns,
driven, no tool | 9 to 24 columns, three tools, not driven). A free patch is one whose set of driven crossings is empty.
"""

from __future__ import annotations

import math

import numpy as np

from weftform.blank import build_grid, rectangle
from weftform.fabric import Fabric
from weftform.solver import Driven, Motion, Problem, Settings, Simulation
from weftform.solver import layout as at
from weftform.tooling import RigidTool, flat_punch, hemisphere

FABRIC = Fabric.load("hexforce-48600-c1300")
SMOOTH = Fabric.load("hexforce-48600-c1300", override={"tension": {"warp": {"slack_ratio": 1.0}}})
"""Yarns that push as they pull: no kink at zero elongation, where a yarn that goes slack makes a vibration chaotic."""
THICKNESS = FABRIC.thickness
NOBODY = Driven(np.zeros(0, np.int64), np.zeros((0, 3), bool), np.zeros((1, 0, 3)), (0,), (0,))
STILL = Motion((0.0, 1.0), (0.0, 0.0))


def whole_grid(columns=6, rows=5, length=2.7, planes=()):
    """Whole cells along x and y."""
    return build_grid(rectangle(columns * length, rows * length), cell_length=length, warp_angle=0.0, planes=planes)


def bias_grid(diagonals=3, length=2.7, planes=()):
    """A square along the bias: half cells all around."""
    side = diagonals * math.sqrt(2.0) * length
    return build_grid(rectangle(side, side), cell_length=length, warp_angle=math.pi / 4, planes=planes)


def free(grid, fabric=FABRIC, threads=1, **settings):
    """A patch that nothing holds."""
    assert fabric.balanced
    return Simulation(Problem(grid, fabric, motions=(STILL,), driven=NOBODY, settings=Settings(**settings)), threads)


def driven(grid, nodes, displacements, motions, fabric=FABRIC, threads=1, **settings):
    """Crossings ``nodes`` (flat indices) driven by ``displacements``, shape [motions, nodes, 3], each times its
    motion."""
    held = np.ones((len(nodes), 3), bool)
    drive = Driven(np.asarray(nodes), held, np.asarray(displacements), tuple(range(len(motions))), (0,) * len(motions))
    return Simulation(
        Problem(grid, fabric, motions=tuple(motions), driven=drive, settings=Settings(**settings)), threads
    )


def all_nodes(grid):
    return np.flatnonzero(grid.active.ravel())


def edge_nodes(grid):
    return np.unique(np.concatenate(grid.edge_loops))


def held_at(grid, displacement, fabric=FABRIC, **settings):
    """Every crossing moved by ``displacement`` [rows, columns, 3] and held; returns the internal forces [nodes, 3]
    there.

    There is nothing dynamic in it: the forces are those of the positions.
    """
    nodes = all_nodes(grid)
    field = np.asarray(displacement).reshape(-1, 3)[nodes][None]
    simulation = driven(grid, nodes, field, [Motion((0.0, 1e-4), (0.0, 1.0))], fabric, **settings)
    simulation.advance_to(1e-4)
    for _ in range(4):
        simulation.advance_to(simulation.time + 0.5 * simulation.step)
    moved = simulation.positions - grid.flat
    np.testing.assert_allclose(moved.reshape(-1, 3)[nodes], field[0], atol=1e-11)
    return simulation, simulation.driven_forces


def affine(grid, gradient, origin=(0.0, 0.0, 0.0)):
    """Displacement of the crossings by a deformation gradient, shape [3, 2] or [3, 3] of yarn axes, [rows, columns,
    3]."""
    gradient = np.asarray(gradient, float)
    flat = grid.flat
    if gradient.shape == (2, 2):
        gradient = np.vstack([gradient, [0.0, 0.0]])
    return flat[..., :2] @ gradient[:, :2].T - flat + np.asarray(origin)


def put(simulation, positions):
    """Place the crossings of a simulation."""
    for c in range(3):
        simulation.sheet.state[simulation.sheet.row_index, at.POSITION + c, : simulation.columns] = positions[..., c]


def first_forces(simulation):
    """Forces on the crossings [rows, columns, 3], from the velocities that one step gives a patch at rest.

    The first kick lasts half a step.
    """
    simulation.velocities = np.zeros((*simulation.problem.grid.shape, 3))
    step = simulation.step
    assert simulation.steps == 0
    simulation._advance(1, 1.0)
    return simulation.velocities * simulation.masses[..., None] / (0.5 * step)


def rotation(axis, degrees):
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    a = math.radians(degrees)
    return np.eye(3) + math.sin(a) * k + (1 - math.cos(a)) * k @ k


def smooth_velocities(grid, speed, seed=1):
    """A smooth random velocity field [mm/s], zero outside the blank."""
    rng = np.random.default_rng(seed)
    size = np.abs(grid.flat[grid.active]).max()
    x, y = grid.flat[..., 0] / size, grid.flat[..., 1] / size
    waves = np.stack([np.cos(1.5 * x) * np.sin(y), np.sin(1.5 * x), x * y, np.cos(2 * y), np.ones_like(x)], axis=-1)
    return speed * (waves @ rng.uniform(-1, 1, (5, 3))) * grid.active[..., None]


# -- with tools ------------------------------------------------------------------------------------


def plate(name, up, motion="fixed", friction=0.0, stiffness=30.0, force=0.0, away=0.0):
    """A flat plate that covers everything, ``away`` from the fabric."""
    side_s, s0, side_z, z0, radius = flat_punch(2000.0, 1.0, THICKNESS, up)
    return RigidTool(
        name, side_s, s0, side_z, z0 - up * away, radius, up, motion, friction, stiffness, 0.5, force=force
    )


def ball(up, away=0.0, friction=0.0, motion="stroke"):
    """A hemisphere of diameter 50 mm."""
    side_s, s0, side_z, z0, radius = hemisphere(50.0, THICKNESS, up)
    return RigidTool("ball", side_s, s0, side_z, z0 - up * away, radius, up, motion, friction, 30.0, 0.5)


def pressed(grid, friction=0.0, force=40.0, closing=0.01, threads=1, **settings):
    """A patch between a fixed plate above and one pushed from below; a ball stands far away."""
    tools = (
        plate("above", -1.0, friction=friction),
        plate("below", 1.0, "force", friction=friction, force=force),
        ball(1.0, away=500.0),
    )
    problem = Problem(
        grid,
        FABRIC,
        tools,
        (STILL, Motion((0.0, closing), (0.0, 1.0))),
        stroke=0,
        holding=1,
        settings=Settings(**settings),
    )
    return Simulation(problem, threads)
