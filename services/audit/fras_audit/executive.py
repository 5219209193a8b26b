"""The executive again: given what it was answered, what it must have asked and said."""

from collections import deque
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

from fras_audit.comparison import Tally, unstamped
from fras_audit.recorded import Recorded, reply_of, request_of
from fras_common.bus import NoAnswer, RemoteFault
from fras_common.errors import FrasError
from fras_common.messages import (
    ActionResult,
    Context,
    DecisionReply,
    Header,
    Plan,
    PlanDecision,
    RpcRecord,
    TaskRequest,
    TaskStatus,
)
from fras_common.service.recall import Asked
from fras_common.topics import (
    ACTION_RESULT,
    APPROVE,
    CONTEXT,
    EXECUTE,
    PLAN,
    RECORDER_CLOSE,
    RECORDER_OPEN,
    RECORDER_STATUS,
    REJECT,
    ROBOT_STATE,
    TASK,
    TASK_STATUS,
    Query,
)
from fras_planner.adapter import verified
from fras_planner.approval import DecisionRequest, decision, judge
from fras_planner.effects import Accept, Ask, AwaitDecision, AwaitResult, Effect, Pause, Say
from fras_planner.endings import PeerLost, TaskAborted
from fras_planner.executive import Executive
from fras_planner.memory import PlanRequest, Resumption
from fras_planner.planning import Knowledge
from fras_planner.resumption import has_started

H = TypeVar("H", bound=Header)

CANCELLED = "cancelled"
_DECIDING: tuple[Query[Any, DecisionReply], ...] = (APPROVE, REJECT)


class _Lost(Exception):
    """The log does not hold what the executive went on with."""


class _Killed(Exception):
    """Here the executive was killed, and another one goes on."""


def audit_executive(
    recorded: Recorded, knowledge: Knowledge, sent: Mapping[str, str]
) -> list[Tally]:
    """Drive the executive with the recorded answers.

    Its plans are the recorded ones, so that one altered plan does not pass for a fault of the
    loop; what they were asked for with is compared.

    Parameters
    ----------
    recorded : Recorded
    knowledge : Knowledge
        What is verified by.
    sent : mapping of str to str
        The rule files that it must have sent for the log; none by an older version.

    Returns
    -------
    list of Tally
        Questions, and statuses.
    """
    return _Audit(recorded, knowledge, sent).run()


class _Audit:
    def __init__(self, recorded: Recorded, knowledge: Knowledge, sent: Mapping[str, str]) -> None:
        self._recorded = recorded
        self._knowledge = knowledge
        self._sent = sent
        self._answers: dict[str, deque[RpcRecord]] = {}
        self._results = {one.goal_id: one for one in recorded.of(ACTION_RESULT)}
        self._plans = deque(recorded.of(PLAN))
        self._statuses = deque(recorded.of(TASK_STATUS))
        self._interruption = _interruption(recorded)
        self._source = ""
        # Whatever another executive was told is later than its first word.
        self._until_ns: int | None = None
        self._asked = Tally("planner", "questions and requests", 0)
        self._said = Tally("planner", "task statuses", len(self._statuses))

    def run(self) -> list[Tally]:
        tallies = [self._asked, self._said]
        start = _start(self._recorded)
        if start is None or start.scenario is None:
            self._said.notes.append("nothing derived: the log lacks the request that began it")
            return tallies
        resumed: Resumption | None = None
        firsts = _first_words(self._recorded)
        try:
            for number in range(max(1, len(firsts))):
                later = firsts[number + 1 :]
                self._source = firsts[number].source if firsts else ""
                self._until_ns = later[0].stamp_ns if later else None
                verify = partial(verified, self._knowledge)
                executive = Executive(
                    start, start.scenario, self._plan, verify, self._sent, resumed
                )
                self._drive(executive)
                if later:
                    self._said.notes.append(f"another planner took over: {later[0].source}")
                    resumed = self._left(start, later[0].stamp_ns)
        except _Lost as lost:
            self._said.notes.append(f"not derived from here on: {lost}")
        self._asked.total = self._asked.seen
        return tallies

    def _left(self, start: TaskRequest, until_ns: int) -> Resumption:
        """Return what an executive that begins to speak at `until_ns` had recalled."""
        recorded = self._recorded
        status = _latest(recorded.of(TASK_STATUS), until_ns)
        mirror = _latest(recorded.mirrors(EXECUTE), until_ns)
        if status is None:
            raise _Lost("the log lacks what the executive before had said")
        started = has_started(
            status,
            _latest(recorded.of(ACTION_RESULT), until_ns),
            _latest(recorded.of(ROBOT_STATE), until_ns),
            _asked(mirror) if mirror is not None else None,
        )
        contexts = {c.request_id: c for c in recorded.of(CONTEXT) if c.stamp_ns < until_ns}
        plans = {p.request_id: p for p in recorded.of(PLAN) if p.stamp_ns < until_ns}
        return Resumption(status, started, contexts, plans, start)

    def _drive(self, executive: Executive) -> None:
        steps = executive.run()
        outcome: Any = None
        while True:
            try:
                effect: Effect = (
                    steps.throw(outcome) if isinstance(outcome, FrasError) else steps.send(outcome)
                )
                outcome = self._perform(executive, effect)
            except (StopIteration, FrasError, _Killed):
                return

    def _perform(self, executive: Executive, effect: Effect) -> Any:
        match effect:
            case Say(TaskStatus() as status):
                return self._say(status)
            case Say():
                return self._plans.popleft()
            case Accept() | Pause():
                return None
            case AwaitDecision(plan):
                return self._decision(executive, plan)
            case AwaitResult(goal_id):
                return self._result(goal_id)
            case Ask(query) if query is RECORDER_CLOSE:
                # The log ends with its closing: neither the answer nor what follows is in it.
                raise _Killed
            case Ask():
                return self._answer(effect)

    # --- what the world said ----------------------------------------------------------------

    def _answer(self, ask: Ask) -> Any:
        queue = self._answers.setdefault(ask.query.key, deque(self._recorded.mirrors(ask.query)))
        mirror = _matching(queue, ask, self._until_ns)
        if mirror is None and self._until_ns is not None:
            raise _Killed
        if mirror is None and queue:
            mirror = queue.popleft()
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
        if self._until_ns is not None and (result is None or result.stamp_ns >= self._until_ns):
            raise _Killed
        if result is None or result.reason == CANCELLED:
            interruption = self._interrupted()
            if interruption is not None:
                return interruption
        if result is not None:
            return result
        if self._ended_for("motion"):
            return PeerLost("motion is gone", service="motion")
        raise _Lost(f"the log lacks the result of {goal_id}")

    def _decision(self, executive: Executive, plan: str) -> PlanDecision | FrasError:
        """Return what a person decided on a plan; compare what was answered."""
        for mirror, request, reply in _decisions(self._recorded, plan):
            if self._until_ns is not None and mirror.stamp_ns >= self._until_ns:
                raise _Killed
            derived = judge(request, executive.status, executive.proposal)
            self._asked.compare(f"decision on plan {plan}", reply, derived, mirror.seq)
            return decision(request, reply)
        if self._until_ns is not None:
            raise _Killed
        interruption = self._interrupted()
        if interruption is None:
            raise _Lost(f"the log lacks what was decided on plan {plan}")
        return interruption

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

    def _is_mine(self, said: Header) -> bool:
        """Whether it was the executive at hand that said it."""
        return said.source == self._source

    # --- what the executive does --------------------------------------------------------------

    def _plan(self, context: Context, request: PlanRequest) -> Plan:
        if self._until_ns is not None and (not self._plans or not self._is_mine(self._plans[0])):
            raise _Killed
        if not self._plans:
            raise _Lost(f"the log lacks the plan for {context.request_id}")
        plan = self._plans[0]
        made_with = PlanRequest.of(plan)
        where = f"what the plan for {context.request_id} was made with"
        self._asked.compare(where, made_with, request, plan.seq)
        return plan

    def _say(self, status: TaskStatus) -> TaskStatus:
        waiting = self._statuses[0] if self._statuses else None
        if waiting is not None and not self._is_mine(waiting):
            raise _Killed
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


def _matching(queue: deque[RpcRecord], ask: Ask, until_ns: int | None) -> RpcRecord | None:
    """Take the first mirror of this very question; others may ask the same service, too."""
    for mirror in queue:
        is_late = until_ns is not None and mirror.stamp_ns >= until_ns
        if not is_late and request_of(ask.query, mirror) == ask.request:
            queue.remove(mirror)
            return mirror
    return None


def _decisions(
    recorded: Recorded, plan: str
) -> list[tuple[RpcRecord, DecisionRequest, DecisionReply]]:
    """Return the decisions on a plan that were taken, the first one first."""
    taken: list[tuple[RpcRecord, DecisionRequest, DecisionReply]] = []
    for query in _DECIDING:
        for mirror in recorded.mirrors(query):
            request: DecisionRequest = request_of(query, mirror)
            if mirror.fault is not None or (request.trial, request.plan) != (recorded.trial, plan):
                continue
            if (reply := reply_of(query, mirror)).accepted:
                taken.append((mirror, request, reply))
    return sorted(taken, key=lambda one: one[0].stamp_ns)


def _first_words(recorded: Recorded) -> list[TaskStatus]:
    """Return the first status of each executive."""
    found: dict[str, TaskStatus] = {}
    for status in recorded.of(TASK_STATUS):
        found.setdefault(status.source, status)
    return list(found.values())


def _latest(messages: Sequence[H], until_ns: int) -> H | None:
    return max(
        (one for one in messages if one.stamp_ns < until_ns),
        key=lambda one: one.stamp_ns,
        default=None,
    )


def _asked(mirror: RpcRecord) -> Asked:
    reply = reply_of(EXECUTE, mirror) if mirror.fault is None else None
    return Asked(mirror, request_of(EXECUTE, mirror), reply)


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
