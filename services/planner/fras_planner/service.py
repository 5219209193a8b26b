"""The planner's shell: one trial at a time."""

import time
from functools import partial
from pathlib import Path
from typing import Any

from fras_common.bus import NoAnswer
from fras_common.errors import FrasError
from fras_common.messages import (
    DecisionReply,
    RecorderStatus,
    ResetReply,
    TaskReply,
    TaskRequest,
    WhyNotReply,
    WhyNotRequest,
)
from fras_common.scenario import Scenario, check
from fras_common.service import Deferred, ServiceHost
from fras_common.service.recall import Recall
from fras_common.topics import (
    ACTION_RESULT,
    APPROVE,
    PATIENT,
    PLAN,
    RECORDER_OPEN,
    RECORDER_STATUS,
    REJECT,
    TASK,
    TASK_STATUS,
    WHY_NOT,
)
from fras_planner.adapter import NOTHING_PLANNED, NothingPlanned, PlanMaker, verified
from fras_planner.approval import DecisionRequest, decision, judge
from fras_planner.endings import PeerLost, TaskAborted
from fras_planner.executive import Executive
from fras_planner.knowledge import load_knowledge
from fras_planner.memory import Resumption
from fras_planner.performer import Performer
from fras_planner.requests import REOPEN_TIMEOUT_S
from fras_planner.resumption import TakenUp, take_up

WATCH_S = 0.5
NO_PATIENT = (
    "the scenario has a [patient], and no process `patient` is in this cell: start the stack with "
    "`fras up --compose twin`, or leave the section out"
)


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
        self._peer_timeout_s = 0.0
        self._requires_log = True
        self._motion_gone_since_s: float | None = None
        host.require("sim", "sa", "recorder")
        host.subscribe(ACTION_RESULT, self._performer.deliver)
        host.subscribe(RECORDER_STATUS, self._on_recorder)
        host.serve_deferred(TASK, self._on_task)
        host.serve(WHY_NOT, self._on_why_not)
        host.serve_deferred(APPROVE, self._on_decision)
        host.serve_deferred(REJECT, self._on_decision)
        self._recall = Recall(host, take_up(), self._take_up)

    def _on_task(self, pending: Deferred[TaskRequest, TaskReply]) -> None:
        request = pending.request
        if request.command == "abort":
            self._abort(pending)
        elif self._executive is not None:
            running = self._executive.status.trial
            pending.reply(TaskReply(accepted=False, reason=f"trial {running} is under way"))
        elif request.scenario is None or request.scenario.scene is None:
            pending.reply(TaskReply(accepted=False, reason="start needs a resolved scenario"))
        elif request.scenario.has_patient and not self._host.present(f"alive/{PATIENT.service}"):
            pending.reply(TaskReply(accepted=False, reason=NO_PATIENT))
        else:
            self._recall.give_up()
            self._starter = pending
            executive = self._new_executive(request, check(request.scenario))
            self._performer.start(executive.run(), self._peer_timeout_s)

    def _new_executive(
        self, request: TaskRequest, scenario: Scenario, resumed: Resumption | None = None
    ) -> Executive:
        self._peer_timeout_s = scenario.run.peer_timeout_s
        self._requires_log = scenario.run.require_log
        self._plans = plans = PlanMaker(self._knowledge, scenario, time.perf_counter)
        verify = partial(verified, self._knowledge)
        rules = self._knowledge.files
        executive = Executive(request, scenario, plans, verify, rules, resumed)
        self._executive = executive
        self._host.enter_trial(request.trial)
        return executive

    def _take_up(self, taken: TakenUp | None) -> None:
        """Go on with the trial that the planner before this one has left."""
        if taken is None:
            return
        resumed = taken.resumption
        status, request = resumed.status, resumed.request
        if request is None:
            # Nobody knows any more what was to be done: it can only be ended.
            request = TaskRequest(command="start", trial=status.trial)
        executive = self._new_executive(request, request.scenario or Scenario(), resumed)
        self._recall_plan(resumed)
        # This process speaks for what the one before it was told.
        if taken.record is not None:
            self._host.publish_mirror(TASK, taken.record)
        self._host.log.warning("trial taken up", trial=status.trial, phase=status.phase)
        self._performer.start(executive.run(), self._peer_timeout_s, taken.result)

    def _recall_plan(self, resumed: Resumption) -> None:
        """Know the plan that is followed, for whoever asks about it."""
        plan = resumed.plans.get(resumed.status.plan)
        context = resumed.contexts.get(resumed.status.plan)
        if self._plans is None or plan is None or context is None:
            return
        try:
            self._plans.recall(plan, context)
        except FrasError as error:
            self._host.log.warning("the last plan can't be told", problem=str(error))

    def _abort(self, pending: Deferred[TaskRequest, TaskReply]) -> None:
        if self._executive is None or self._executive.status.trial != pending.request.trial:
            pending.reply(TaskReply(accepted=False, reason="no such trial is under way"))
            return
        if self._executive.ending:
            pending.reply(TaskReply(accepted=False, reason="the trial is ending already"))
            return
        pending.reply(TaskReply(accepted=True, reason=""))
        self._performer.drive(TaskAborted(pending.request.reason or "aborted on request"))

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

    def _on_recorder(self, status: RecorderStatus) -> None:
        """Have a recorder that has just started go on with the log; end the trial of a lost one."""
        running = self._executive
        if running is None:
            return
        if status.state == "idle" and running.log_open:
            self._reopen_log(running)
        elif status.state == "error" and status.trial == running.status.trial:
            self._lose_log(running, status.reason)

    def _reopen_log(self, running: Executive) -> None:
        def reopened(outcome: ResetReply | FrasError) -> None:
            if running is not self._executive or not isinstance(outcome, FrasError):
                return
            self._host.log.error("the log is not gone on with", problem=str(outcome))
            # One that does not answer has gone again; the next one will say that it is there.
            if not isinstance(outcome, NoAnswer):
                self._lose_log(running, str(outcome))

        self._host.bus.ask(
            RECORDER_OPEN,
            running.log_request,
            lambda outcome: self._host.post(lambda: reopened(outcome)),
            REOPEN_TIMEOUT_S,
        )

    def _lose_log(self, running: Executive, reason: str) -> None:
        """End the trial whose log can't be written any more: nothing moves unrecorded."""
        if self._requires_log and not running.ending:
            self._performer.drive(TaskAborted(f"hold:recorder: {reason}"))

    def _on_end(self, error: FrasError | None) -> None:
        if error is not None:
            self._host.log.error("the trial did not end in order", problem=str(error))
        reason = self._executive.status.reason if self._executive is not None else ""
        self._executive = None
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
            self._recall.wake(time.monotonic()),
            self._performer.wake(),
            self._watch_motion(time.monotonic()),
        )
        return min((wait_s for wait_s in waits_s if wait_s is not None), default=None)

    def _watch_motion(self, now_s: float) -> float | None:
        if not self._performer.awaited:
            self._motion_gone_since_s = None
            return None
        # One that starts again is alive before it knows what it was about to do.
        if self._host.present("ready/motion"):
            self._motion_gone_since_s = None
            return WATCH_S
        if self._motion_gone_since_s is None:
            self._motion_gone_since_s = now_s
        self._host.waiting_for = "motion"
        if now_s - self._motion_gone_since_s > self._peer_timeout_s:
            self._host.waiting_for = ""
            self._performer.drive(PeerLost("motion is gone", service="motion"))
        return WATCH_S

    def close(self) -> None:
        """Nothing to put in order: the status is latched, the recorder closes its file."""
