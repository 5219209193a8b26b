"""What situation awareness sees: the paper's S_E and S_R as plain values.

Every position is in the world frame. Arrays are never written to; float32 ones (as the bus
carries them) are as good as float64 ones.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .errors import TwoTicks

FloatArray: TypeAlias = NDArray[np.floating[Any]]
IndexArray: TypeAlias = NDArray[np.integer[Any]]
Level: TypeAlias = Literal["ok", "soft", "hard", "invalid"]
Evidence: TypeAlias = dict[str, float]

ARMS = ("psm1", "psm2")
"""The arms of the task, in the order of the paper's indices."""

ACTIONS = ("reach", "grasp", "release", "pull", "move")
"""The actions of the paper's signature."""

FINAL_PHASES = frozenset({"done", "interrupted"})
"""Phases that an action shows in its last tick only."""


@dataclass(frozen=True, slots=True, eq=False)
class TissueModel:
    """The scene at rest.

    Parameters
    ----------
    nodes_m : ndarray, shape (n_nodes, 3) [m]
        Rest positions of the mesh's nodes.
    triangles : ndarray of int, shape (n_triangles, 3)
        The mesh's surface, all of its sides.
    fixed_points_m : ndarray, shape (n_fixed, 3) [m]
        Attachment points (P_f); may be empty.
    roi_m : ndarray, shape (3,) [m]
        The region of interest (p_ROI).
    dt_s : float [s]
        Duration of a tick.
    """

    nodes_m: FloatArray
    triangles: IndexArray
    fixed_points_m: FloatArray
    roi_m: FloatArray
    dt_s: float


@dataclass(frozen=True, slots=True, eq=False)
class TissueView:
    """The tissue at one tick (P_t and what is needed of the forces).

    Parameters
    ----------
    tick : int
        Tick of the simulator.
    nodes_m : ndarray, shape (n_nodes, 3) [m]
        Current positions.
    max_force_n : float [N]
        Largest norm of the elastic internal force of any node.
    tool_force_n : mapping of str to ndarray, shape (3,) [N]
        Force of the tissue on the tool, by arm.
    converged : bool
        Whether the solver converged in this tick.
    max_node_speed_m_s : float [m/s]
        Speed of the fastest node.
    """

    tick: int
    nodes_m: FloatArray
    max_force_n: float
    tool_force_n: Mapping[str, FloatArray]
    converged: bool
    max_node_speed_m_s: float = 0.0


def believed_where_seen(believed: TissueView, seen: TissueView) -> TissueView:
    """Return the tissue where it is seen to be, with the force that its model bears.

    Parameters
    ----------
    believed : TissueView
        By the model: its forces count.
    seen : TissueView
        By whoever sees the tissue: its positions and its speed count.

    Returns
    -------
    TissueView
        It converged where both did. Where both are one it is that one.

    Raises
    ------
    TwoTicks
        They are of two ticks: no force belongs to these positions.
    """
    if believed.tick != seen.tick:
        raise TwoTicks(believed.tick, seen.tick)
    return TissueView(
        tick=believed.tick,
        nodes_m=seen.nodes_m,
        max_force_n=believed.max_force_n,
        tool_force_n=believed.tool_force_n,
        converged=believed.converged and seen.converged,
        max_node_speed_m_s=seen.max_node_speed_m_s,
    )


@dataclass(frozen=True, slots=True, eq=False)
class ArmView:
    """One arm at one tick.

    Parameters
    ----------
    tip_m : ndarray, shape (3,) [m]
        Tip of the instrument (p_i).
    jaw_rad : float [rad]
        Opening of the jaw (j_i).
    """

    tip_m: FloatArray
    jaw_rad: float


class ActionView(NamedTuple):
    """The action in progress, as `robot/state` shows it."""

    name: str
    arm: str
    block: str
    phase: str


@dataclass(frozen=True, slots=True, eq=False)
class RobotView:
    """The robot at one tick.

    Parameters
    ----------
    tick : int
        As motion counts it; the tissue's must be the same.
    arms : mapping of str to ArmView
        Each of `ARMS`, by name.
    action : ActionView or None
        The action in progress.
    """

    tick: int
    arms: Mapping[str, ArmView]
    action: ActionView | None = None
