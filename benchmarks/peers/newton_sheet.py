"""The sheet as cloth in Newton on Warp's processor backend, semi-implicit solver; run with the Python that has newton.

Has: triangles of a Neo-Hookean membrane, springs along the edges, damping, penalty contact with one sphere (with contact).
Lacks: axial law of the yarns, die, blank-holder, energy ledger. Warp's processor backend: single precision,
one thread.

usage: python newton_sheet.py CELLS CONTACT(0|1) STEPS
"""

from __future__ import annotations

import sys
import time

import newton
import numpy as np
import warp as wp


def main() -> None:
    cells, contact, steps = int(sys.argv[1]), sys.argv[2] == "1", int(sys.argv[3])
    wp.config.quiet = True
    pitch = 0.15 / cells
    with wp.ScopedDevice("cpu"):
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
        builder.add_cloth_grid(
            pos=wp.vec3(-0.075, -0.075, 0.0), rot=wp.quat_identity(), vel=wp.vec3(0.0, 0.0, -0.02),
            dim_x=cells, dim_y=cells, cell_x=pitch, cell_y=pitch, mass=0.6 * pitch**2,
            tri_ke=1.0e3, tri_ka=1.0e3, tri_kd=1.0e-3, edge_ke=0.0, add_springs=True, spring_ke=1.0e2, spring_kd=1.0e-4,
            particle_radius=0.0005,
        )  # fmt: skip
        if contact:
            builder.add_shape_sphere(
                -1, xform=wp.transform(wp.vec3(0.0, 0.0, -0.0253), wp.quat_identity()), radius=0.025
            )
        model = builder.finalize()
        solver = newton.solvers.SolverSemiImplicit(model, enable_tri_contact=False)
        states = [model.state(), model.state()]
        control = model.control()
        contacts = model.contacts() if contact else None

        def advance(count: int) -> None:
            for _ in range(count):
                states[0].clear_forces()
                if contact:
                    model.collide(states[0], contacts)
                solver.step(states[0], states[1], control, contacts, 5.0e-6)
                states.reverse()

        advance(20)
        best = float("inf")
        for _ in range(8):
            began = time.perf_counter()
            advance(steps)
            best = min(best, time.perf_counter() - began)
        positions = states[0].particle_q.numpy()
        touching = int(contacts.soft_contact_count.numpy()[0]) if contact else 0
    if not np.isfinite(positions).all() or abs(positions).max() > 1.0:
        raise SystemExit("the sheet blew up")
    if contact and touching == 0:
        raise SystemExit("the sheet does not touch the sphere")
    print(best / steps / cells**2 * 1e9, touching)


if __name__ == "__main__":
    main()
