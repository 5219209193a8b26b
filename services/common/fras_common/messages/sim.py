"""What the tissue simulator publishes."""

from collections.abc import Mapping
from typing import ClassVar

from fras_common.messages.base import (
    Array,
    Columns,
    DType,
    Header,
    Vec3,
    Wire,
    require_arrays,
)


class TissueModel(Header, frozen=True, kw_only=True):
    """The tissue at rest; published at each reset, latched.

    Attributes
    ----------
    nodes_m : Array, shape (n_nodes, 3), float64
        Rest positions in the world frame.
    elements : Array, shape (n_elements, 8, 4 or 10), int32
        Hexahedra, linear or quadratic tetrahedra, in VTK's order.
    surface : Array, shape (n_triangles, 3), int32
        Outer faces, wound outwards.
    fixed_nodes : Array, shape (n_fixed,), int32
        Nodes that attachment points (APs) hold.
    fixed_patch : Array, shape (n_fixed,), int32
        Patch of each of them, from 0: fixed nodes that edges of elements connect.
    fixed_points_m : Array, shape (n_points, 3), float64
        The APs as points of a mesh-independent raster.
    """

    nodes_m: Array
    elements: Array
    surface: Array
    fixed_nodes: Array
    fixed_patch: Array
    fixed_points_m: Array
    roi_m: Vec3
    young_modulus_pa: float
    poisson_ratio: float
    dt_s: float

    ARRAYS: ClassVar[Mapping[str, tuple[DType, Columns]]] = {
        "nodes_m": ("<f8", 3),
        "elements": ("<i4", "any"),
        "surface": ("<i4", 3),
        "fixed_nodes": ("<i4", None),
        "fixed_patch": ("<i4", None),
        "fixed_points_m": ("<f8", 3),
    }

    def __post_init__(self) -> None:
        require_arrays(self, self.ARRAYS)


class SolverReport(Wire, frozen=True, kw_only=True):
    """How the time step was solved; only `wall_s` may differ between two equal runs."""

    iterations: int
    residual: float
    refactored: bool
    wall_s: float
    converged: bool
    inverted_elements: int


class TissueState(Header, frozen=True, kw_only=True):
    """The tissue at one tick.

    Attributes
    ----------
    nodes_m : Array, shape (n_nodes, 3), float32
    nodal_force_n : Array, shape (n_nodes, 3), float32
        Elastic internal force of each node.
    max_force_n : float
        Largest magnitude among `nodal_force_n`, attachment points and grasped nodes included.
    tool_force_n : dict of arm to (3,)
        Force that each holding instrument exerts on the tissue.
    grasped : dict of arm to node ids
        Empty for an arm that closed on nothing; absent for an arm that holds nothing.
    grasped_force_n : dict of arm to a list of (3,)
        The share of `tool_force_n` that goes to each of those nodes.
    patch_force_n : Array, shape (n_patches, 3), float32
        Force that each patch of attachments exerts on the tissue (`TissueModel.fixed_patch`).
    balance_residual_n : float
        Norm of the sum of all forces on the tissue in this step: inertia, damping, elasticity, bed,
        weight, attachments and instruments. Zero to the tolerance of the solver.
    """

    nodes_m: Array
    nodal_force_n: Array
    max_force_n: float
    max_node_speed_m_s: float
    tool_force_n: dict[str, Vec3]
    grasped: dict[str, list[int]]
    grasped_force_n: dict[str, list[Vec3]]
    patch_force_n: Array
    balance_residual_n: float
    solver: SolverReport

    ARRAYS: ClassVar[Mapping[str, tuple[DType, Columns]]] = {
        "nodes_m": ("<f4", 3),
        "nodal_force_n": ("<f4", 3),
        "patch_force_n": ("<f4", 3),
    }

    def __post_init__(self) -> None:
        require_arrays(self, self.ARRAYS)


class HeldNodes(Wire, frozen=True, kw_only=True):
    """What one instrument holds, and where.

    Attributes
    ----------
    position_m : Vec3
        Its tip as last accepted.
    nodes : list of int
    offsets_m : list of Vec3
        Where each of these nodes is, seen from the tip.
    """

    position_m: Vec3
    closed: bool
    nodes: list[int]
    offsets_m: list[Vec3]


class SimCheckpoint(Header, frozen=True, kw_only=True):
    """Everything that the next time step starts from, to the last bit.

    A simulator of the same scenario that restores it, and is given the robot states of the ticks
    after it, publishes the same tissue states again.

    Attributes
    ----------
    nodes_m, velocity_m_s, support_n : Array, shape (n_nodes, 3), float64
        Positions, velocities, and what attachments and instruments exerted in the last step.
    balance_residual_n : float
    arms : dict of arm to HeldNodes
    settling : bool
        Whether a release was the last thing the instruments did.
    """

    nodes_m: Array
    velocity_m_s: Array
    support_n: Array
    balance_residual_n: float
    arms: dict[str, HeldNodes]
    settling: bool

    ARRAYS: ClassVar[Mapping[str, tuple[DType, Columns]]] = {
        "nodes_m": ("<f8", 3),
        "velocity_m_s": ("<f8", 3),
        "support_n": ("<f8", 3),
    }

    def __post_init__(self) -> None:
        require_arrays(self, self.ARRAYS)
