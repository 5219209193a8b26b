"""The executive again: given what it was answered, what it must have asked and said."""

from collections import deque
from functools import partial
from typing import Any

from fras_audit.comparison import Tally, unstamped
from fras_audit.recorded import Recorded, reply_of, request_of
from fras_common.bus import NoAnswer, RemoteFault
from fras_common.errors import FrasError
from fras_common.messages import (
    ActionResult,
    Context,
    Plan,
    RpcRecord,
    TaskRequest,
    TaskStatus,
)
from fras_common.topics import (
    ACTION_RESULT,
    PLAN,
    RECORDER_CLOSE,
    RECORDER_OPEN,
    RECORDER_STATUS,
    TASK,
    TASK_STATUS,
)
from fras_planner.adapter import verified
from fras_planner.effects import Accept, Ask, AwaitResult, Effect, Say
from fras_planner.executive import Executive, PeerLost, PlanRequest, TaskAborted
from fras_planner.planning import Knowledge

CANCELLED = "cancelled"


class _Lost(Exception):
    """The log does not hold what the executive went on with."""


def audit_executive(recorded: Recorded, knowledge: Knowledge) -> list[Tally]:
    """Drive the executive with the recorded answers.

    Its plans are the recorded ones, so that one altered plan does not pass for a fault of the
    loop; what they were asked for with is compared.

    Returns
    -------
    list of Tally
        Questions, and statuses.
    """
    return _Audit(recorded, knowledge).run()


class _Audit:
    def __init__(self, recorded: Recorded, knowledge: Knowledge) -> None:
        self._recorded = recorded
        self._knowledge = knowledge
        self._answers: dict[str, deque[RpcRecord]] = {}
        self._results = {one.goal_id: one for one in recorded.of(ACTION_RESULT)}
        self._plans = deque(recorded.of(PLAN))
        self._statuses = deque(recorded.of(TASK_STATUS))
        self._interruption = _interruption(recorded)
        self._asked = Tally("planner", "questions and requests", 0)
        self._said = Tally("planner", "task statuses", len(self._statuses))

    def run(self) -> list[Tally]:
        tallies = [self._asked, self._said]
        start = _start(self._recorded)
        if start is None or start.scenario is None:
            self._said.notes.append("nothing derived: the log lacks the request that began it")
            return tallies
        executive = Executive(start, start.scenario, self._plan, partial(verified, self._knowledge))
        try:
            self._drive(executive)
        except _Lost as lost:
            self._said.notes.append(f"not derived from here on: {lost}")
        self._asked.total = self._asked.seen
        return tallies

    def _drive(self, executive: Executive) -> None:
        steps = executive.run()
        outcome: Any = None
        while True:
            try:
                effect: Effect = (
                    steps.throw(outcome) if isinstance(outcome, FrasError) else steps.send(outcome)
                )
            except (StopIteration, FrasError):
                return
            match effect:
                case Say(TaskStatus() as status):
                    outcome = self._say(status)
                case Say():
                    outcome = self._plans.popleft()
                case Accept():
                    outcome = None
                case AwaitResult(goal_id):
                    outcome = self._result(goal_id)
                case Ask(query) if query is RECORDER_CLOSE:
                    # The log ends with its closing: neither the answer nor what follows is in it.
                    return
                case Ask():
                    outcome = self._answer(effect)

    # --- what the world said ----------------------------------------------------------------

    def _answer(self, ask: Ask) -> Any:
        queue = self._answers.setdefault(ask.query.key, deque(self._recorded.mirrors(ask.query)))
        mirror = _matching(queue, ask) or (queue.popleft() if queue else None)
        if mirror is None:
            return self._interrupted() or self._unanswered(ask)
        asked = request_of(ask.query, mirror)
        where = f"{ask.query.key} after {self._said.seen} statuses"
        self._asked.compare(where, asked, ask.request, mirror.seq)
        if mirror.fault is not None:
            return RemoteFault(ask.query.key, mirror.fault)
        return reply_of(ask.query, mirror)

    def _result(self, goal_id: str) -> ActionResult | FrasError:
        result = self._results.get(goal_id)
        if result is None or result.reason == CANCELLED:
            interruption = self._interrupted()
            if interruption is not None:
                return interruption
        if result is not None:
            return result
        if self._ended_for("motion"):
            return PeerLost("motion is gone", service="motion")
        raise _Lost(f"the log lacks the result of {goal_id}")

    def _unanswered(self, ask: Ask) -> FrasError:
        if self._ended_for(ask.query.server):
            return NoAnswer(ask.query.key, ask.timeout_s)
        raise _Lost(f"the log lacks the answer to {ask.query.key}")

    def _interrupted(self) -> FrasError | None:
        """Return what ended the trial from outside, once."""
        interruption, self._interruption = self._interruption, None
        return interruption

    def _ended_for(self, service: str) -> bool:
        """Whether the trial ended because a service was gone."""
        return any(one.reason == f"hold:{service}" for one in self._statuses)

    # --- what the executive does --------------------------------------------------------------

    def _plan(self, context: Context, request: PlanRequest) -> Plan:
        if not self._plans:
            raise _Lost(f"the log lacks the plan for {context.request_id}")
        plan = self._plans[0]
        made_with = PlanRequest(
            request_id=plan.request_id,
            reason=plan.reason,
            ignore_ap=plan.ignore_ap,
            tried=tuple(plan.tried),
        )
        where = f"what the plan for {context.request_id} was made with"
        self._asked.compare(where, made_with, request, plan.seq)
        return plan

    def _say(self, status: TaskStatus) -> TaskStatus:
        waiting = self._statuses[0] if self._statuses else None
        if RECORDER_OPEN.key not in self._answers and (
            waiting is None or waiting.phase != status.phase
        ):
            # Said before there was a log.
            return status
        if waiting is None:
            if not self._recorded.damage:
                self._said.lacks(f"after {self._said.seen} statuses", unstamped(status))
            raise _Lost("the log ends before this was said")
        said = self._statuses.popleft()
        where = f"status {said.seq}, {said.phase} at tick {said.tick}"
        self._said.compare_messages(where, said, status)
        return said


def _matching(queue: deque[RpcRecord], ask: Ask) -> RpcRecord | None:
    """Take the first mirror of this very question; others may ask the same service, too."""
    for mirror in queue:
        if request_of(ask.query, mirror) == ask.request:
            queue.remove(mirror)
            return mirror
    return None


def _start(recorded: Recorded) -> TaskRequest | None:
    for mirror in recorded.mirrors(TASK):
        request = request_of(TASK, mirror)
        if request.command == "start" and request.trial == recorded.trial and mirror.fault is None:
            return request
    return None


def _interruption(recorded: Recorded) -> TaskAborted | None:
    """Find who ended the trial from outside: somebody who asked for it, or a log that failed."""
    for mirror in recorded.mirrors(TASK):
        request = request_of(TASK, mirror)
        if (
            request.command == "abort"
            and request.trial == recorded.trial
            and mirror.fault is None
            and reply_of(TASK, mirror).accepted
        ):
            return TaskAborted(request.reason or "aborted on request")
    for status in recorded.of(RECORDER_STATUS):
        if status.state == "error":
            return TaskAborted(f"hold:recorder: {status.reason}")
    return None
