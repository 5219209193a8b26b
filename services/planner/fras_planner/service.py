"""The planner's shell: one trial at a time."""

import time
from functools import partial
from pathlib import Path

from fras_common.errors import FrasError
from fras_common.messages import (
    RecorderStatus,
    TaskReply,
    TaskRequest,
    WhyNotReply,
    WhyNotRequest,
)
from fras_common.service import Deferred, ServiceHost
from fras_common.topics import ACTION_RESULT, PLAN, RECORDER_STATUS, TASK, TASK_STATUS, WHY_NOT
from fras_planner.adapter import NOTHING_PLANNED, NothingPlanned, PlanMaker, verified
from fras_planner.executive import Executive, PeerLost, TaskAborted
from fras_planner.knowledge import load_knowledge
from fras_planner.performer import Performer

WATCH_S = 0.5


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

    def _on_task(self, pending: Deferred[TaskRequest, TaskReply]) -> None:
        request = pending.request
        if request.command == "abort":
            self._abort(pending)
        elif self._executive is not None:
            running = self._executive.status.trial
            pending.reply(TaskReply(accepted=False, reason=f"trial {running} is under way"))
        elif request.scenario is None or request.scenario.scene is None:
            pending.reply(TaskReply(accepted=False, reason="start needs a resolved scenario"))
        else:
            scenario = request.scenario
            self._peer_timeout_s = scenario.run.peer_timeout_s
            self._requires_log = scenario.run.require_log
            self._starter = pending
            make_plan = PlanMaker(self._knowledge, scenario, time.perf_counter)
            self._plans = make_plan
            verify = partial(verified, self._knowledge)
            self._executive = Executive(request, scenario, make_plan, verify)
            self._host.enter_trial(request.trial)
            self._performer.start(self._executive.run())

    def _abort(self, pending: Deferred[TaskRequest, TaskReply]) -> None:
        if self._executive is None or self._executive.status.trial != pending.request.trial:
            pending.reply(TaskReply(accepted=False, reason="no such trial is under way"))
            return
        if self._executive.ending:
            pending.reply(TaskReply(accepted=False, reason="the trial is ending already"))
            return
        pending.reply(TaskReply(accepted=True, reason=""))
        self._performer.drive(TaskAborted(pending.request.reason or "aborted on request"))

    def _on_why_not(self, request: WhyNotRequest) -> WhyNotReply:
        """Answer about the latest plan, of a trial that runs or has ended."""
        if self._plans is None:
            raise NothingPlanned(NOTHING_PLANNED)
        return self._plans.why_not(request.question)

    def _on_recorder(self, status: RecorderStatus) -> None:
        """End the trial whose log can't be written any more: nothing moves unrecorded."""
        running = self._executive
        if running is None or running.ending or status.trial != running.status.trial:
            return
        if status.state == "error" and self._requires_log:
            self._performer.drive(TaskAborted(f"hold:recorder: {status.reason}"))

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
        """Give up on an action whose motion service has been away for too long."""
        if not self._performer.awaited:
            self._motion_gone_since_s = None
            self._host.waiting_for = ""
            return None
        now_s = time.monotonic()
        if self._host.present("alive/motion"):
            self._motion_gone_since_s = None
            self._host.waiting_for = ""
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
