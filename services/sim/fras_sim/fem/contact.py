"""The bed under the tissue: a one-sided spring on every node of the surface."""

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.mesh import Mesh


def bed_stiffness(mesh: Mesh, stiffness_pa_m: float) -> NDArray[np.float64]:
    """Return the spring of each node against the plane z = 0.

    Parameters
    ----------
    mesh : Mesh
    stiffness_pa_m : float
        Pressure for each metre of depth [Pa/m].

    Returns
    -------
    ndarray, shape (n_nodes,), float64 [N/m]
        Zero inside the body.

    Notes
    -----
    The bed's energy is ``k/2 min(z, 0)²`` for each node (`kernels.nodal_terms`): a penalty, once
    continuously differentiable, frictionless, that never pulls. It scales with the node's share of
    the surface, so the pressure doesn't depend on the mesh.
    """
    return stiffness_pa_m * mesh.surface_area_m2


def penetrating(x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which nodes are below the bed: only these may stiffen the Hessian."""
    return x[:, 2] < 0.0
