"""What a planner that starts again has to know of the trial under way."""

from collections.abc import Iterable
from dataclasses import dataclass

from fras_common import messages as m
from fras_common.codec import decode
from fras_common.service.recall import Asked, Last, LastAsked, Recalling, Since
from fras_common.topics import (
    ACTION_RESULT,
    CONTEXT,
    EXECUTE,
    PLAN,
    ROBOT_STATE,
    RPC,
    TASK,
    TASK_STATUS,
)
from fras_planner.memory import Resumption


@dataclass(frozen=True)
class TakenUp:
    """All that was recalled.

    Parameters
    ----------
    resumption : Resumption
    record : RpcRecord or None
        The mirror of the request that began the trial.
    result : ActionResult or None
        The last one of the trial.
    """

    resumption: Resumption
    record: m.RpcRecord | None
    result: m.ActionResult | None


def take_up() -> Recalling:
    """Recall the trial under way; returns it as `TakenUp`, or None if there is none."""
    status: m.TaskStatus | None = yield Last(TASK_STATUS)
    if status is None or status.phase == "idle":
        return None
    trial = status.trial
    mirrors: list[m.RpcRecord] = yield Since(RPC.of(service="planner", name="task"), -1)
    contexts: list[m.Context] = yield Since(CONTEXT, 0)
    plans: list[m.Plan] = yield Since(PLAN, 0)
    result: m.ActionResult | None = yield Last(ACTION_RESULT)
    robot: m.RobotState | None = yield Last(ROBOT_STATE)
    executed: Asked | None = yield LastAsked(EXECUTE)
    if result is not None and result.trial != trial:
        result = None
    if robot is not None and robot.trial != trial:
        robot = None
    record, request = _start(trial, mirrors)
    return TakenUp(
        Resumption(
            status,
            has_started(status, result, robot, executed),
            {one.request_id: one for one in contexts if one.trial == trial},
            {one.request_id: one for one in plans if one.trial == trial},
            request,
        ),
        record,
        result,
    )


def has_started(
    status: m.TaskStatus,
    result: m.ActionResult | None,
    robot: m.RobotState | None,
    executed: Asked | None,
) -> bool:
    """Whether motion took the goal that a status tells to be under way.

    Parameters
    ----------
    status : TaskStatus
    result, robot, executed
        The last result and robot state of the trial, and the last goal that motion answered.
    """
    goal_id = status.goal_id
    if status.phase != "acting" or not goal_id:
        return False
    taken = (
        executed is not None
        and executed.reply is not None
        and executed.reply.accepted
        and executed.request.trial == status.trial
        and executed.request.goal_id == goal_id
    )
    moves = robot is not None and robot.action is not None and robot.action.goal_id == goal_id
    return taken or moves or (result is not None and result.goal_id == goal_id)


def _start(
    trial: str, mirrors: Iterable[m.RpcRecord]
) -> tuple[m.RpcRecord | None, m.TaskRequest | None]:
    for record in mirrors:
        request = decode(TASK.request, bytes(record.request), TASK.key)
        if request.command == "start" and request.trial == trial and request.scenario is not None:
            return record, request
    return None, None
