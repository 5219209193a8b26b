"""`fras approve` and `fras reject`: a person's word on the plan that waits in a cell."""

import queue
import time
from collections.abc import Sequence
from typing import Any

from rich.console import Console

from fras_cli.keep import HOLDER, QUERY_TIMEOUT_S, endpoint
from fras_cli.link import Link
from fras_cli.plan_words import print_plan, told
from fras_cli.run import EXIT_NOT_SUCCESS, EXIT_OK
from fras_common.bus import Bus
from fras_common.errors import FrasError
from fras_common.messages import ApproveRequest, DecisionReply, Plan, RejectRequest, TaskStatus
from fras_common.topics import APPROVE, PLAN, REJECT, TASK_STATUS

HEARING_S = 2.5


class NothingWaits(FrasError):
    """No plan waits for a person."""


class AnotherPlan(FrasError):
    """Another plan waits than the one that was meant."""


def approve(cell: str, connect: str | None, plan: str, console: Console) -> int:
    """Let the plan that waits be done; 0 if that was taken, 1 if it was refused."""
    with Link(cell, endpoint(cell, connect), open_timeout_s=QUERY_TIMEOUT_S) as link:
        waiting, trial = _waiting(link.bus, plan)
        print_plan(waiting, console)
        reply = send(link.bus, ApproveRequest(trial=trial, plan=waiting.request_id, by=HOLDER))
    return EXIT_OK if told(reply, waiting.request_id, "approved", console) else EXIT_NOT_SUCCESS


def reject(
    cell: str,
    connect: str | None,
    plan: str,
    reason: str,
    exclude: Sequence[str],
    console: Console,
) -> int:
    """Have another plan made than the one that waits; 0 if that was taken, 1 if refused."""
    with Link(cell, endpoint(cell, connect), open_timeout_s=QUERY_TIMEOUT_S) as link:
        waiting, trial = _waiting(link.bus, plan)
        request = RejectRequest(
            trial=trial, plan=waiting.request_id, by=HOLDER, reason=reason, exclude=list(exclude)
        )
        reply = send(link.bus, request)
    return EXIT_OK if told(reply, waiting.request_id, "rejected", console) else EXIT_NOT_SUCCESS


def send(bus: Bus, request: ApproveRequest | RejectRequest) -> DecisionReply:
    """Ask the planner to take a decision."""
    if isinstance(request, ApproveRequest):
        return bus.query(APPROVE, request, QUERY_TIMEOUT_S)
    return bus.query(REJECT, request, QUERY_TIMEOUT_S)


def _waiting(bus: Bus, wanted: str) -> tuple[Plan, str]:
    """Return the plan that waits, and its trial.

    Raises
    ------
    NothingWaits, AnotherPlan
    """
    heard: queue.SimpleQueue[Any] = queue.SimpleQueue()
    bus.subscribe(TASK_STATUS, heard.put)
    bus.subscribe(PLAN, heard.put)
    status: TaskStatus | None = None
    plans: dict[tuple[str, str], Plan] = {}
    deadline_s = time.monotonic() + HEARING_S
    while (left_s := deadline_s - time.monotonic()) > 0:
        try:
            message = heard.get(timeout=left_s)
        except queue.Empty:
            break
        if isinstance(message, TaskStatus):
            status = message
        else:
            plans[message.trial, message.request_id] = message
        if status is not None and status.phase == "awaiting_approval":
            if wanted and status.plan != wanted:
                raise AnotherPlan(f"plan {status.plan!r} waits, not {wanted!r}", plan=status.plan)
            if (status.trial, status.plan) in plans:
                return plans[status.trial, status.plan], status.trial
    phase = f"the task is {status.phase}" if status is not None else "no task is known"
    raise NothingWaits(f"no plan waits for approval: {phase}")
