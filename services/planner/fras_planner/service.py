"""The planner's shell: one trial at a time."""

import time
from functools import partial
from pathlib import Path
from typing import Any

from fras_common.errors import FrasError
from fras_common.messages import (
    DecisionReply,
    TaskReply,
    TaskRequest,
    WhyNotReply,
    WhyNotRequest,
)
from fras_common.scenario import Scenario, check
from fras_common.service import Deferred, ServiceHost
from fras_common.topics import (
    ACTION_RESULT,
    APPROVE,
    PATIENT,
    PLAN,
    REJECT,
    TASK,
    TASK_STATUS,
    WHY_NOT,
)
from fras_planner.adapter import NOTHING_PLANNED, NothingPlanned, PlanMaker, verified
from fras_planner.admission import TaskRefused, require_abortable, startable
from fras_planner.approval import DecisionRequest, decision, judge
from fras_planner.endings import TaskAborted
from fras_planner.executive import Executive
from fras_planner.knowledge import load_knowledge
from fras_planner.log_watch import LogWatch
from fras_planner.memory import Resumption
from fras_planner.motion_watch import MotionWatch
from fras_planner.performer import Performer
from fras_planner.restart import Restart


class PlannerService:
    """Serves `planner/task`; publishes plans and the task's status."""

    def __init__(self, host: ServiceHost, asp_dir: Path | None = None) -> None:
        self._host = host
        self._knowledge = load_knowledge(asp_dir)
        host.facts["asp_digest"] = self._knowledge.digest
        self._performer = Performer(
            host,
            plans=host.publisher(PLAN),
            statuses=host.publisher(TASK_STATUS),
            on_accept=lambda: self._answer(TaskReply(accepted=True, reason="")),
            on_end=self._on_end,
            clock=time.monotonic,
        )
        self._executive: Executive | None = None
        self._plans: PlanMaker | None = None
        self._starter: Deferred[TaskRequest, TaskReply] | None = None
        self._motion = MotionWatch(host, self._performer)
        host.require("sim", "sa", "recorder")
        host.subscribe(ACTION_RESULT, self._performer.deliver)
        self._log = LogWatch(host, self._performer)
        host.serve_deferred(TASK, self._on_task)
        host.serve(WHY_NOT, self._on_why_not)
        host.serve_deferred(APPROVE, self._on_decision)
        host.serve_deferred(REJECT, self._on_decision)
        self._restart = Restart(host, self._performer, self._enter)

    def _on_task(self, pending: Deferred[TaskRequest, TaskReply]) -> None:
        do = self._abort if pending.request.command == "abort" else self._start
        try:
            do(pending)
        except TaskRefused as refusal:
            pending.reply(TaskReply(accepted=False, reason=str(refusal)))

    def _start(self, pending: Deferred[TaskRequest, TaskReply]) -> None:
        request, here = pending.request, self._host.present(f"alive/{PATIENT.service}")
        scenario = check(startable(request, self._executive, patient_is_here=here))
        # A start that is refused leaves what is being taken up as it is.
        self._restart.give_up()
        executive, _ = self._enter(request, scenario)
        self._performer.forget_results()
        self._starter = pending
        self._performer.start(executive.run(), scenario.run.peer_timeout_s)

    def _abort(self, pending: Deferred[TaskRequest, TaskReply]) -> None:
        require_abortable(pending.request, self._executive)
        pending.reply(TaskReply(accepted=True, reason=""))
        self._performer.drive(TaskAborted(pending.request.reason or "aborted on request"))

    def _enter(
        self, request: TaskRequest, scenario: Scenario, resumed: Resumption | None = None
    ) -> tuple[Executive, PlanMaker]:
        plans = PlanMaker(self._knowledge, scenario, time.perf_counter)
        verify = partial(verified, self._knowledge)
        rules = self._knowledge.files
        executive = Executive(request, scenario, plans, verify, rules, resumed)
        self._executive, self._plans = executive, plans
        self._log.begin(executive, required=scenario.run.require_log)
        self._motion.begin(scenario.run.peer_timeout_s)
        self._host.enter_trial(request.trial)
        return executive, plans

    def _on_decision(self, pending: Deferred[Any, DecisionReply]) -> None:
        """Go on as a person decided, and say so, before the answer: what is answered is known."""
        request: DecisionRequest = pending.request
        running = self._executive
        waits = running.proposal if running is not None else None
        reply = judge(request, running.status if running is not None else None, waits)
        if reply.accepted and waits is not None and waits.plan.request_id == request.plan:
            self._performer.drive(decision(request, reply))
        pending.reply(reply)

    def _on_why_not(self, request: WhyNotRequest) -> WhyNotReply:
        """Answer about the latest plan, of a trial that runs or has ended."""
        if self._plans is None:
            raise NothingPlanned(NOTHING_PLANNED)
        return self._plans.why_not(request.question)

    def _on_end(self, error: FrasError | None) -> None:
        if error is not None:
            self._host.log.error("the trial did not end in order", problem=str(error))
        reason = self._executive.status.reason if self._executive is not None else ""
        self._executive = None
        self._log.end()
        self._answer(TaskReply(accepted=False, reason=reason))

    def _answer(self, reply: TaskReply) -> None:
        """Answer whoever started the trial, once."""
        starter, self._starter = self._starter, None
        if starter is not None:
            starter.reply(reply)

    def wake(self) -> float | None:
        """Ask again who was away; give up on an action whose motion is away for too long."""
        self._host.waiting_for = self._performer.missing
        waits_s = (
            self._restart.wake(time.monotonic()),
            self._performer.wake(),
            self._motion.wake(time.monotonic()),
        )
        return min((wait_s for wait_s in waits_s if wait_s is not None), default=None)

    def close(self) -> None:
        """Nothing to put in order: the status is latched, the recorder closes its file."""
