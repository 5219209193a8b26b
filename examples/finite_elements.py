"""The finite elements alone, as a library: `python examples/finite_elements.py`.

A sheet of tissue, fixed along one side, is grasped at the other and lifted, so slowly that it is in
equilibrium at each height. One sees a table: how high, which force the tool bears, and the largest
force on any node. The force grows faster than the height, as the model is nonlinear. The last
column is of a tissue of twice the stiffness: at each height twice the force.
"""

# %% A mesh, a material, and what holds the body: all in SI units, all plain arrays.
import numpy as np

from fras_sim.fem import TissueParameters, TissueSimulator, ToolInput, box_mesh

mesh = box_mesh(size_m=(0.1, 0.12, 0.005), node_counts=(11, 13, 2))
fixed = np.flatnonzero(mesh.nodes_m[:, 0] == 0.0)
grasp_m = np.array([0.09, 0.06, 0.005])


def lift(young_modulus_pa: float, heights_m: list[float]) -> list[tuple[float, float]]:
    """Lift the tissue; return the tool's force and the largest nodal force at each height [N]."""
    parameters = TissueParameters(young_modulus_pa=young_modulus_pa, bed=False, quasi_static=True)
    tissue = TissueSimulator(mesh, parameters, fixed)
    # A tool grasps in the tick in which its jaw closes: it comes open.
    tissue.measure({"psm1": ToolInput(grasp_m, jaw_rad=1.0)})
    forces: list[tuple[float, float]] = []
    for height_m in heights_m:
        tip_m = grasp_m + np.array([0.0, 0.0, height_m])
        # One step is one equilibrium here; without `quasi_static` it is one tick of `dt_s`.
        result = tissue.step({"psm1": ToolInput(tip_m, jaw_rad=0.0)})
        if not result.solver.converged:
            raise SystemExit(f"no equilibrium at {height_m} m: {result.solver}")
        forces.append((float(result.tool_force_n["psm1"][2]), result.max_force_n))
    return forces


# %% Forces over the height, for two tissues.
heights_m = [0.002 * step for step in range(16)]
soft, stiff = lift(3000.0, heights_m), lift(6000.0, heights_m)
print("height   tool    node    tool, twice as stiff")
for height_m, (tool_n, node_n), (stiff_n, _) in zip(heights_m, soft, stiff, strict=True):
    forces_mn = (1000 * force_n for force_n in (tool_n, node_n, stiff_n))
    print(f"{1000 * height_m:3.0f} mm", *(f"{force_mn:7.3f}" for force_mn in forces_mn), "mN")
