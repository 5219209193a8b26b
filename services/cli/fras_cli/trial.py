"""One trial as the command line sees it: started, followed, ended."""

import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from fras_cli.stack import UsedStack
from fras_common.bus import NoAnswer
from fras_common.errors import FrasError
from fras_common.messages import (
    ApproveRequest,
    CancelRequest,
    DecisionReply,
    Health,
    Plan,
    RejectRequest,
    RobotState,
    TaskReply,
    TaskRequest,
    TaskStatus,
    Verdict,
)
from fras_common.scenario import Scenario
from fras_common.topics import (
    APPROVE,
    CANCEL,
    HEALTH,
    PLAN,
    REJECT,
    ROBOT_STATE,
    TASK,
    TASK_STATUS,
    VERDICT,
)

START_TIMEOUT_S = 30.0
AT_ONCE_S = 0.5
POLL_S = 0.1
RATE_WINDOW_S = 1.0


class TrialRefused(FrasError):
    """The planner did not take the trial."""


class StackDied(FrasError):
    """A process of the stack ended in mid-trial."""


class NobodyRunsTrials(FrasError):
    """A campaign has no worker that can run its trials."""


@dataclass
class TrialView:
    """The latest of everything that a person wants to see."""

    task: TaskStatus | None = None
    plan: Plan | None = None
    verdict: Verdict | None = None
    robot: RobotState | None = None
    waiting: dict[str, str] = field(default_factory=dict[str, str])
    holds: str = ""
    tick_rate_hz: float = 0.0


class TrialFollower:
    """Follows the trials of one cell; callbacks of the bus update one view under a lock."""

    def __init__(self, stack: UsedStack) -> None:
        self._stack = stack
        self._changed = threading.Condition()
        self._started_ns = stack.started_ns
        self._trial = ""
        self._view = TrialView()
        self._rate_mark = (0.0, 0)
        bus = stack.link.bus
        bus.subscribe(TASK_STATUS, self._on_task)
        bus.subscribe(PLAN, self._on_plan)
        bus.subscribe(VERDICT, self._on_verdict)
        bus.subscribe(ROBOT_STATE, self._on_robot)
        bus.subscribe(HEALTH, self._on_health)

    def start(self, trial: str, scenario: Scenario, out_dir: Path, mesh: bytes = b"") -> None:
        """Ask the planner to begin.

        Raises
        ------
        TrialRefused
            With its reason.
        """
        with self._changed:
            self._trial = trial
            self._view = TrialView()
            self._rate_mark = (0.0, 0)
        request = TaskRequest(
            command="start",
            trial=trial,
            scenario=scenario,
            mesh=mesh,
            out_dir=str(out_dir.resolve()),
            started_ns=self._started_ns,
        )
        self._started_ns = 0  # only the first trial waited for the stack
        reply = self._stack.link.bus.query(TASK, request, START_TIMEOUT_S)
        if not reply.accepted:
            raise TrialRefused(f"the planner refused the trial: {reply.reason}")

    def abort(self, reason: str) -> None:
        """Ask the planner to end the trial now: the arms stop, the log is closed.

        If it does not answer at once motion is told to stop the arms all the same.

        Raises
        ------
        FrasError
            The planner does not answer at all, or refuses.
        """
        bus = self._stack.link.bus
        answers: queue.SimpleQueue[TaskReply | FrasError] = queue.SimpleQueue()
        request = TaskRequest(command="abort", trial=self._trial, reason=reason)
        bus.ask(TASK, request, answers.put, START_TIMEOUT_S)
        try:
            answer = answers.get(timeout=AT_ONCE_S)
        except queue.Empty:
            with suppress(NoAnswer):
                cancel = CancelRequest(trial=self._trial, reason=reason)
                bus.query(CANCEL, cancel, START_TIMEOUT_S)
            answer = answers.get()
        if isinstance(answer, FrasError):
            raise answer

    def decide(self, request: ApproveRequest | RejectRequest) -> DecisionReply:
        """Have the planner take a decision on the plan that waits."""
        bus = self._stack.link.bus
        if isinstance(request, ApproveRequest):
            return bus.query(APPROVE, request, START_TIMEOUT_S)
        return bus.query(REJECT, request, START_TIMEOUT_S)

    def follow(self, show: Callable[[TrialView], None], stop: Callable[[], bool]) -> bool:
        """Show the view until the trial has ended and its log is closed.

        Returns
        -------
        bool
            False if `stop` said so first.

        Raises
        ------
        StackDied
            A process of an own stack ended; the log so far is readable.
        """
        while True:
            with self._changed:
                self._changed.wait(POLL_S)
                view = self._view
            show(view)
            if view.task is not None and view.task.phase == "idle":
                return True
            if stop():
                return False
            if gone := self._stack.watch():
                raise StackDied(f"the stack broke in mid-trial: {gone}")

    def _update(self, **changes: object) -> None:
        with self._changed:
            for name, value in changes.items():
                setattr(self._view, name, value)
            self._changed.notify_all()

    def _on_task(self, status: TaskStatus) -> None:
        last = self._view.task
        if status.trial != self._trial:
            return
        # What somebody says again is over: the end of a trial would never be seen.
        if last is None or last.source != status.source or last.seq < status.seq:
            self._update(task=status)

    def _on_plan(self, plan: Plan) -> None:
        if plan.trial == self._trial:
            self._update(plan=plan)

    def _on_health(self, health: Health) -> None:
        with self._changed:
            self._view.waiting.pop(health.service, None)
            if health.state.startswith("waiting"):
                self._view.waiting[health.service] = health.state
            if health.service == "motion":
                self._view.holds = health.facts.get("holds", "")

    def _on_verdict(self, verdict: Verdict) -> None:
        # Fifty times a second: kept for the next look, waking nobody.
        if verdict.trial == self._trial:
            self._view.verdict = verdict

    def _on_robot(self, robot: RobotState) -> None:
        if robot.trial != self._trial:
            return
        self._view.robot = robot
        since_s, tick = self._rate_mark
        now_s = robot.stamp_ns * 1e-9
        if now_s - since_s >= RATE_WINDOW_S:
            self._view.tick_rate_hz = (robot.tick - tick) / (now_s - since_s) if since_s else 0.0
            self._rate_mark = (now_s, robot.tick)
