"""Failure: the level of a tick (check_failure in Algorithm 1, on every tick and action)."""

import math
from dataclasses import dataclass

import numpy as np

from .parameters import AwarenessParameters
from .views import ARMS, Level, RobotView, TissueView


@dataclass(frozen=True, slots=True)
class Failure:
    """What a tick is worth.

    Parameters
    ----------
    level : {"ok", "soft", "hard", "invalid"}
        soft: above the limit in a pull; hard: above the hard limit in any action; invalid: the
        state is no basis for moving on.
    reason : str
        Empty if ok, else `force_soft`, `force_hard`, `solver`, `robot` or `stale`.
    force_n : float [N]
        The force by the chosen metric; NaN if it was not finite.
    """

    level: Level
    reason: str
    force_n: float


def measured_force(parameters: AwarenessParameters, tissue: TissueView) -> float:
    """Return the force that is held against the limits [N].

    With the metric `tool` it is the largest norm over the arms, 0 if none touches the tissue.
    """
    if parameters.force_metric == "nodal_max":
        return tissue.max_force_n
    forces = [math.hypot(*(float(v) for v in force)) for force in tissue.tool_force_n.values()]
    # Not max(): it loses a NaN that is not its first argument.
    return float(np.max(forces, initial=0.0))


def tissue_problem(tissue: TissueView, n_nodes: int) -> str:
    """Return what in the tissue's state makes it unusable; empty if nothing does."""
    if tissue.nodes_m.shape != (n_nodes, 3):
        return f"nodes_m has shape {tissue.nodes_m.shape} instead of {(n_nodes, 3)}"
    if not np.isfinite(tissue.nodes_m).all():
        return "nodes_m is not finite"
    numbers = [tissue.max_force_n, tissue.max_node_speed_m_s]
    if min(numbers) < 0.0:
        return "a force or a speed is negative"
    numbers += [float(v) for force in tissue.tool_force_n.values() for v in force]
    return "" if all(map(math.isfinite, numbers)) else "a force or a speed is not finite"


def robot_problem(robot: RobotView) -> str:
    """Return what in the robot's state makes it unusable; empty if nothing does."""
    for name, arm in robot.arms.items():
        if not (np.isfinite(arm.tip_m).all() and math.isfinite(arm.jaw_rad)):
            return f"tip or jaw of {name} is not finite"
    if robot.action is not None and robot.action.arm not in robot.arms:
        return f"the action's arm {robot.action.arm!r} is not among the arms"
    return ""


def staleness(tissue: TissueView, robot: RobotView) -> str:
    """Return what shows that a state is old or missing; empty if nothing does."""
    if robot.tick != tissue.tick:
        return f"robot of tick {robot.tick} with tissue of tick {tissue.tick}"
    missing = [arm for arm in ARMS if arm not in robot.arms]
    return f"no state of {' and '.join(missing)}" if missing else ""


def binding_limit(parameters: AwarenessParameters, robot: RobotView) -> float:
    """Return the limit that the action under way meets first [N]; infinite if none binds."""
    if parameters.no_limit:
        return math.inf
    return parameters.force_limit_n if _pulling(robot) else parameters.hard_n


def check_failure(
    parameters: AwarenessParameters,
    tissue: TissueView,
    robot: RobotView,
    *,
    n_nodes: int,
    last_tick: int,
) -> Failure:
    """Return the level of one tick.

    Parameters
    ----------
    parameters : AwarenessParameters
        Limits and metric.
    tissue, robot : TissueView, RobotView
        Both of the same tick.
    n_nodes : int
        Nodes of the model.
    last_tick : int
        The tick judged before; this one must follow it.

    Returns
    -------
    Failure

    Notes
    -----
    The paper checks max Sigma < epsilon while pulling only; the hard limit is ours and binds
    every action. `no_limit` switches both off, an invalid state stays one.
    """
    force = measured_force(parameters, tissue)
    if not tissue.converged or tissue_problem(tissue, n_nodes):
        return Failure("invalid", "solver", force if math.isfinite(force) else math.nan)
    if tissue.tick != last_tick + 1 or staleness(tissue, robot):
        return Failure("invalid", "stale", force)
    if robot_problem(robot):
        return Failure("invalid", "robot", force)
    if parameters.no_limit:
        return Failure("ok", "", force)
    if force > parameters.hard_n:
        return Failure("hard", "force_hard", force)
    if _pulling(robot) and force > parameters.force_limit_n:
        return Failure("soft", "force_soft", force)
    return Failure("ok", "", force)


def _pulling(robot: RobotView) -> bool:
    return robot.action is not None and robot.action.name == "pull"
