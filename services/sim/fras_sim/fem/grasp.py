"""Which nodes a tool holds, and how they follow it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fras_sim.fem.errors import BadToolInput

GRASP_RADIUS_M = 0.005
JAW_CLOSED_RAD = float(np.deg2rad(20.0))
MAX_TOOL_STEP_M = 0.02
# A node at the radius itself counts, whatever the last bit of its distance.
DISTANCE_ROUNDING_M = 1e-9


@dataclass(frozen=True, eq=False)
class ToolInput:
    """Where a tool is in one tick.

    A tool grasps in the tick in which its jaw closes, and lets go in the one in which it opens:
    show it open first, with `TissueSimulator.measure` or a step.

    Parameters
    ----------
    position_m : ndarray, shape (3,), float64 [m]
        Tip in the world frame.
    jaw_rad : float
        Opening of the jaw; below 20 degrees it is closed.
    """

    position_m: NDArray[np.float64]
    jaw_rad: float


@dataclass(frozen=True, eq=False)
class ArmState:
    """A tool as last accepted, and what it holds.

    ``offsets_m`` (k, 3) is where each held node is, seen from the tip.
    """

    position_m: NDArray[np.float64]
    closed: bool
    nodes: NDArray[np.int32]
    offsets_m: NDArray[np.float64]

    @property
    def nodes_at_m(self) -> NDArray[np.float64]:
        """Where the tool leads its nodes, shape (k, 3) [m]."""
        return self.position_m + self.offsets_m


Arms = Mapping[str, ArmState]


def checked_position(arm: str, tool: ToolInput, before: ArmState | None) -> NDArray[np.float64]:
    """Return the tip's position as a fresh array.

    Raises
    ------
    BadToolInput
        If the pose is not finite, not three numbers, or more than 20 mm from the last one.
    """
    position_m = np.array(tool.position_m, dtype=np.float64)
    if position_m.shape != (3,) or not np.isfinite(position_m).all():
        raise BadToolInput(
            f"{arm}: position_m = {position_m} must be three finite numbers in metres",
            arm=arm,
            position_m=position_m,
        )
    if not np.isfinite(tool.jaw_rad):
        raise BadToolInput(
            f"{arm}: jaw_rad = {tool.jaw_rad} must be a finite number",
            arm=arm,
            jaw_rad=tool.jaw_rad,
        )
    if before is not None:
        jump_m = float(np.linalg.norm(position_m - before.position_m))
        if jump_m > MAX_TOOL_STEP_M:
            raise BadToolInput(
                f"{arm}: the tool jumped {1e3 * jump_m:.1f} mm in one tick, "
                f"{1e3 * MAX_TOOL_STEP_M:.0f} mm is the most: send every tick, at a lower speed",
                arm=arm,
                jump_m=jump_m,
            )
    return position_m


def nodes_in_reach(
    x: NDArray[np.float64],
    tip_m: NDArray[np.float64],
    may_be_taken: NDArray[np.bool_],
    spacing_m: float,
) -> NDArray[np.int32]:
    """Return the nodes a closing tool takes, ascending.

    Parameters
    ----------
    x : ndarray, shape (n_nodes, 3), float64 [m]
    tip_m : ndarray, shape (3,), float64 [m]
    may_be_taken : ndarray, shape (n_nodes,), bool
        False for fixed nodes and for those that another tool holds.
    spacing_m : float
        One node spacing.

    Returns
    -------
    ndarray of int32
        Every allowed node within 5 mm of the tip; if none is, the nearest within one node
        spacing; else nothing.
    """
    distance_m = np.where(may_be_taken, np.linalg.norm(x - tip_m, axis=1), np.inf)
    within = np.flatnonzero(distance_m <= GRASP_RADIUS_M + DISTANCE_ROUNDING_M)
    if len(within) == 0:
        nearest = int(np.argmin(distance_m))
        if distance_m[nearest] <= spacing_m + DISTANCE_ROUNDING_M:
            within = np.array([nearest])
    return within.astype(np.int32)


def move_arms(
    arms: Arms,
    tools: Mapping[str, ToolInput],
    x: NDArray[np.float64],
    is_fixed: NDArray[np.bool_],
    spacing_m: float,
) -> dict[str, ArmState]:
    """Return the arms one tick later; releases come before grasps, arms in order of their name.

    A tool grasps when its jaw was open in the last tick and is closed now: one that is closed when
    first seen holds nothing. Fixed nodes are never part of a grasp: they don't move, and what the
    tool exerts is the force on the nodes that it leads. A node held by one arm is not taken by
    another. An arm that is not in `tools` stays where it was.

    Raises
    ------
    BadToolInput
        See `checked_position`; also if an arm that holds tissue is missing.
    """
    missing = sorted(arm for arm, state in arms.items() if len(state.nodes) and arm not in tools)
    if missing:
        raise BadToolInput(
            f"{missing[0]} holds tissue and sent no pose: send every arm in every tick",
            arm=missing[0],
        )
    moved = dict(arms)
    closing: list[str] = []
    for arm, tool in sorted(tools.items()):
        before = arms.get(arm)
        position_m = checked_position(arm, tool, before)
        closed = tool.jaw_rad < JAW_CLOSED_RAD
        if before is not None and closed:
            moved[arm] = ArmState(position_m, closed, before.nodes, before.offsets_m)
        else:
            moved[arm] = ArmState(position_m, closed, np.zeros(0, dtype=np.int32), np.zeros((0, 3)))
        if before is not None and closed and not before.closed:
            closing.append(arm)
    may_be_taken = ~is_fixed
    for state in moved.values():
        may_be_taken[state.nodes] = False
    for arm in closing:
        state = moved[arm]
        nodes = nodes_in_reach(x, state.position_m, may_be_taken, spacing_m)
        may_be_taken[nodes] = False
        moved[arm] = ArmState(state.position_m, state.closed, nodes, x[nodes] - state.position_m)
    return moved
