"""A rule of one's own beside those of situation awareness: `python examples/own_rule.py`.

Situation awareness judges the force. This rule looks at the shape: a block is `overstretched` while
an edge of the surface in it is a quarter longer than at rest. A tissue is grasped and lifted
here without any service. One sees at which tick the rule begins to hold, where, by which numbers,
and what the verdict on the force is then; at the end all fluents, the rule's among them. A planner
that is to use them needs rules that declare them, as `asp/domain.lp` does.
"""

# %% The tissue, and situation awareness of it: two libraries, no bus.
import numpy as np

from fras_sa.awareness import (
    ArmView,
    Awareness,
    AwarenessParameters,
    Evidence,
    Memory,
    RobotView,
    TissueModel,
    TissueView,
)
from fras_sim.fem import TissueParameters, TissueSimulator, ToolInput, box_mesh

mesh = box_mesh(node_counts=(11, 13, 2))
bottom_m = mesh.nodes_m[mesh.bottom_nodes]
fixed = mesh.bottom_nodes[bottom_m[:, 0] < 0.015]
parameters = TissueParameters()
tissue = TissueSimulator(mesh, parameters, fixed)
model = TissueModel(
    nodes_m=mesh.nodes_m,
    triangles=mesh.surface,
    fixed_points_m=mesh.nodes_m[fixed],
    roi_m=np.array([0.07, 0.055, 0.0]),
    dt_s=parameters.dt_s,
)
awareness = Awareness(AwarenessParameters(), model)

# %% The rule: a pure function of what is seen, that gives fluents with the numbers behind them.
STRETCH_LIMIT = 1.25
edges = np.unique(np.sort(mesh.surface[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
ends_m = mesh.nodes_m[edges]
rest_m = np.linalg.norm(ends_m[:, 1] - ends_m[:, 0], axis=1)
row_of_edge = awareness.blocks.rows_at(ends_m.mean(axis=1))


def overstretched(seen: TissueView) -> dict[str, Evidence]:
    """Return `overstretched(B)` for each block in which the surface is stretched too far."""
    now_m = seen.nodes_m[edges]
    stretch = np.linalg.norm(now_m[:, 1] - now_m[:, 0], axis=1) / rest_m
    fluents: dict[str, Evidence] = {}
    for row in np.unique(row_of_edge[(stretch > STRETCH_LIMIT) & (row_of_edge >= 0)]):
        most = float(stretch[row_of_edge == row].max())
        name = f"overstretched({awareness.blocks.names[row]})"
        fluents[name] = {"stretch_ratio": most, "limit_ratio": STRETCH_LIMIT}
    return fluents


# %% Grasp a block beside the far edge, and lift it at 20 mm/s.
grasp_m = awareness.blocks.rest_m[awareness.blocks.names.index("b(7,3)")]
resting = ArmView(np.array([0.05, 0.10, 0.1]), jaw_rad=1.0)
tissue.measure({"psm1": ToolInput(grasp_m, jaw_rad=1.0)})  # open: it grasps as it closes


def lift(tick: int) -> tuple[TissueView, RobotView]:
    """Do one tick; return what situation awareness sees then."""
    tip_m = grasp_m + np.array([0.0, 0.0, 0.02 * parameters.dt_s * tick])
    state = tissue.step({"psm1": ToolInput(tip_m, jaw_rad=0.0)})
    view = TissueView(
        tick=tick,
        nodes_m=state.nodes_m,
        max_force_n=state.max_force_n,
        tool_force_n=state.tool_force_n,
        converged=state.solver.converged,
        max_node_speed_m_s=state.max_node_speed_m_s,
    )
    return view, RobotView(tick, {"psm1": ArmView(tip_m, jaw_rad=0.0), "psm2": resting})


# %% Judge each tick, by the force and by the rule.
view, robot = lift(0)
memory, own = awareness.judge(view, robot, Memory()).memory, overstretched(view)
for tick in range(1, 90):
    before = own
    view, robot = lift(tick)
    verdict = awareness.judge(view, robot, memory)
    memory, own = verdict.memory, overstretched(view)
    for name in sorted(own.keys() - before):
        print(
            f"tick {tick}: {name}, {own[name]['stretch_ratio']:.2f} of its length at rest; "
            f"force {verdict.force_n:.2f} N, verdict {verdict.level}"
        )

# %% Both together, as a planner is told them.
context = awareness.context(view, robot, memory)
sensed = [atom for atom in context.fluents if not atom.startswith(("reachable", "fixed"))]
print("fluents:", *sensed, *own)
