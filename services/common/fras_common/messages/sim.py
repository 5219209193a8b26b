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
    fixed_points_m : Array, shape (n_points, 3), float64
        The APs as points of a mesh-independent raster.
    """

    nodes_m: Array
    elements: Array
    surface: Array
    fixed_nodes: Array
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
    """

    nodes_m: Array
    nodal_force_n: Array
    max_force_n: float
    max_node_speed_m_s: float
    tool_force_n: dict[str, Vec3]
    grasped: dict[str, list[int]]
    solver: SolverReport

    ARRAYS: ClassVar[Mapping[str, tuple[DType, Columns]]] = {
        "nodes_m": ("<f4", 3),
        "nodal_force_n": ("<f4", 3),
    }

    def __post_init__(self) -> None:
        require_arrays(self, self.ARRAYS)
