"""The sheet as a two-dimensional flex in MuJoCo; run with the Python that has mujoco, prints one number.

Has: triangles of a linear elastic membrane, damping, implicit contact with friction against one sphere (with contact).
Lacks: axial law of the yarns, die, blank-holder, energy ledger.

usage: python mujoco_sheet.py CELLS CONTACT(0|1) STEPS
"""

from __future__ import annotations

import sys
import time

import mujoco


def sheet(cells: int, contact: bool) -> str:
    """MJCF of the sheet, in metres and kilograms, above a sphere."""
    pitch = 0.15 / cells
    return f"""<mujoco>
  <option timestep="1e-5" gravity="0 0 -9.81" solver="CG" iterations="4" tolerance="1e-4" integrator="Euler">
    <flag energy="disable" eulerdamp="disable"/>
  </option>
  <size memory="800M"/>
  <worldbody>
    <geom name="punch" type="sphere" size="0.025" pos="0 0 -0.0251" contype="{int(contact)}" conaffinity="{int(contact)}"/>
    <flexcomp name="sheet" type="grid" dim="2" count="{cells + 1} {cells + 1} 1" spacing="{pitch} {pitch} {pitch}"
              mass="0.0135" radius="0.0005">
      <contact selfcollide="none" contype="{int(contact)}" conaffinity="{int(contact)}" condim="3"/>
      <edge equality="false" damping="0.001"/>
      <elasticity young="4e6" poisson="0.1" thickness="6.2e-4" elastic2d="stretch"/>
    </flexcomp>
  </worldbody>
</mujoco>"""


def main() -> None:
    cells, contact, steps = int(sys.argv[1]), sys.argv[2] == "1", int(sys.argv[3])
    model = mujoco.MjModel.from_xml_string(sheet(cells, contact))
    data = mujoco.MjData(model)
    for _ in range(60 if contact else 10):
        mujoco.mj_step(model, data)
    best = float("inf")
    for _ in range(5):
        began = time.perf_counter()
        for _ in range(steps):
            mujoco.mj_step(model, data)
        best = min(best, time.perf_counter() - began)
    if not (abs(data.qpos) < 1.0).all():
        raise SystemExit("the sheet blew up")
    if contact and data.ncon == 0:
        raise SystemExit("the sheet does not touch the sphere")
    print(best / steps / cells**2 * 1e9, data.ncon)


if __name__ == "__main__":
    main()
