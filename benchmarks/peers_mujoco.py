"""The task of `benchmarks.fe` in MuJoCo, as a flex of three dimensions.

What is the same: nodes, attached and led nodes, lift per tick, elastic constants (MuJoCo's flex is
St Venant-Kirchhoff), lumped masses, viscosity 0.01 s, time step. What differs: each hexahedron is
six linear tetrahedra (MuJoCo has no other solid element; they are stiffer), there is no bed and no
contact at all, no drag (flex vertices can't have joint damping). A step is one linearly implicit
solve, without iteration on the nonlinear equations: MuJoCo answers a simpler question a tick.

`integrator="discrete"` is the one that takes the flex's stiffness implicitly: stable at 20 ms,
where `Euler` blew up even at an eightieth of it (11x13x2). The linear solver's tolerance is 1e-6
with 500 iterations: with MuJoCo's defaults it warned in every step that it gave up, at no gain in
speed; at 41x49x3 it still does, and how often is in the JSON (`warnings`).
Led nodes are bodies of a tonne whose velocity is set before each step: MuJoCo refuses kinematic
(mocap) vertices on an elastic flex.
"""

# MuJoCo's stubs leave much open.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportMissingTypeStubs=false
# pyright: reportAttributeAccessIssue=false, reportMissingImports=false

import time
from collections.abc import Iterable

import mujoco
import numpy as np
from benchmarks.fe_task import DT_S, LIFT_PER_TICK_M, TICKS, Measured, Task

KUHN = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
LED_KG = 1000.0
SLIDES = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))


def measure(task: Task, budget_s: float) -> Measured:
    """Pull until the end or until the budget is spent."""
    model = mujoco.MjModel.from_xml_string(_xml(task))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    joints = [model.body(f"n{node}").jntadr[0] for node in task.held]
    led = model.jnt_dofadr[joints]
    height = model.jnt_qposadr[joints] + 2
    result = Measured()
    began_s = time.perf_counter()
    for tick in range(1, TICKS + 1):
        data.qvel[led], data.qvel[led + 1], data.qvel[led + 2] = 0.0, 0.0, LIFT_PER_TICK_M / DT_S
        with result.tick():
            mujoco.mj_step(model, data)
        if not np.isfinite(data.qpos).all() or np.abs(data.qpos).max() > 0.1:
            raise RuntimeError(f"MuJoCo became unstable in tick {tick}")
        if time.perf_counter() - began_s > budget_s:
            break
    off_m = float(np.abs(data.qpos[height] - len(result.tick_ms) * LIFT_PER_TICK_M).max())
    result.notes = {
        "version": mujoco.__version__,
        "warnings": sum(int(warning.number) for warning in data.warning),
        "led_nodes_off_m": off_m,
    }
    return result


def _xml(task: Task) -> str:
    parameters, mesh = task.parameters, task.mesh
    volume_m3 = np.zeros(len(mesh.nodes_m))
    np.add.at(volume_m3, mesh.elements, np.prod(np.ptp(mesh.nodes_m, axis=0)) / mesh.elements.size)
    tetrahedra = mesh.elements[:, np.array(KUHN)].reshape(-1, 4)
    bodies = [
        _body(node, position, mass)
        for node, (position, mass) in enumerate(
            zip(mesh.nodes_m, _masses(task, volume_m3), strict=True)
        )
    ]
    return f"""<mujoco>
      <option timestep="{DT_S}" gravity="0 0 0" integrator="discrete" tolerance="1e-6"
              iterations="500"><flag contact="disable"/></option>
      <size memory="1G"/>
      <worldbody>{"".join(bodies)}</worldbody>
      <deformable>
        <flex name="tissue" dim="3" radius="0.0005" element="{_listed(tetrahedra.ravel())}"
              body="{" ".join(f"n{node}" for node in range(len(bodies)))}">
          <elasticity young="{parameters.young_modulus_pa}" poisson="{parameters.poisson_ratio}"
                      damping="{parameters.stiffness_damping_s}"/>
          <contact selfcollide="none" contype="0" conaffinity="0"/>
        </flex>
      </deformable>
    </mujoco>"""


def _masses(task: Task, volume_m3: np.ndarray) -> list[float | None]:
    """Mass of each node; None where it is attached."""
    masses: list[float | None] = [float(m) for m in task.parameters.density_kg_m3 * volume_m3]
    for node in task.fixed:
        masses[node] = None
    for node in task.held:
        masses[node] = LED_KG
    return masses


def _body(node: int, position_m: np.ndarray, mass_kg: float | None) -> str:
    opening = f'<body name="n{node}" pos="{_listed(position_m)}">'
    if mass_kg is None:
        return opening + "</body>"
    inertia = f'<inertial pos="0 0 0" mass="{mass_kg}" diaginertia="1e-6 1e-6 1e-6"/>'
    return f"{opening}{inertia}{SLIDES}</body>"


def _listed(values: Iterable[float]) -> str:
    return " ".join(str(value) for value in np.asarray(values).tolist())
