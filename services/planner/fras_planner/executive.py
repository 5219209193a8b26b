"""The executive: context -> plan -> action -> result, until the trial has a named end.

A coroutine that yields effects and knows no bus and no clock. What a plan may contain and when
the goal is reached is knowledge and stands in `asp/`; here stands only the order of the loop and
the bookkeeping of section "Pull, move, re-plan": which blocks have been tried.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from fras_common.bus import NoAnswer
from fras_common.codec import content_digest
from fras_common.errors import FrasError
from fras_common.executed import history_step
from fras_common.messages import (
    ActionResult,
    CancelReply,
    CancelRequest,
    CloseRequest,
    Context,
    ContextRequest,
    ExecuteReply,
    ExecuteRequest,
    OpenRequest,
    Plan,
    PlannedAction,
    ResetReply,
    ResetRequest,
    TargetReply,
    TargetRequest,
    TaskRequest,
    TaskStatus,
)
from fras_common.scenario import Scenario
from fras_common.topics import (
    CANCEL,
    EXECUTE,
    MOTION_RESET,
    RECORDER_CLOSE,
    RECORDER_OPEN,
    SA_CONTEXT,
    SA_RESET,
    SA_TARGET,
    SIM_RESET,
)
from fras_planner.deviation import first_deviation
from fras_planner.effects import Accept, Ask, AwaitResult, Effect, Say
from fras_planner.tried import Held, newly_tried

RESET_TIMEOUT_S = 60.0
CLOSE_TIMEOUT_S = 15.0

MakePlan = Callable[[Context, "PlanRequest"], Plan]
# Says which safety specifications a history breaks: for each step what held, and what was done.
Verify = Callable[[dict[int, list[str]]], list[str]]
Steps = Generator[Effect, Any, Any]


class PlanRequest(msgspec.Struct, frozen=True, kw_only=True):
    """What a plan depends on beside the context."""

    request_id: str
    reason: str
    ignore_ap: bool
    tried: tuple[str, ...]


@dataclass(frozen=True)
class Ended:
    """An action that ended, and what is true now; no result if motion refused it."""

    action: PlannedAction
    result: ActionResult | None
    refusal: str
    context: Context


def reason_to_replan(ended: Ended) -> str:
    """Return why an action's end asks for a new plan, or nothing."""
    result = ended.result
    if result is None:
        return f"refused: {ended.refusal}"
    if result.outcome == "interrupted":
        return "hold" if result.reason == "hold" else "force"
    if result.outcome == "failed":
        return result.reason
    return first_deviation(ended.action, ended.context.monitored)


class TaskAborted(FrasError):
    """Someone ended the trial; thrown into the executive at whatever it waits for."""


class ActionAborted(FrasError):
    """Motion gave an action up, and with it the trial."""


class PeerLost(FrasError):
    """A service that the executive waits for has gone."""

    service: str


class DigestMismatch(FrasError):
    """A service understood the scenario differently."""


class Executive:
    """One trial.

    Parameters
    ----------
    request : TaskRequest
        A start, its scenario resolved.
    scenario : Scenario
    make_plan : callable
        The planner core, on messages.
    verify : callable
        The verifier, on what was done.
    """

    def __init__(
        self, request: TaskRequest, scenario: Scenario, make_plan: MakePlan, verify: Verify
    ) -> None:
        self._request = request
        self._scenario = scenario
        self._make_plan = make_plan
        self._verify = verify
        self._done: dict[int, list[str]] = {}
        self._timeout_s = scenario.run.peer_timeout_s
        self._status = TaskStatus(
            trial=request.trial,
            phase="resetting",
            action="",
            goal_id="",
            tried=[],
            plans=0,
            replans=0,
            scenario_kind="A",
            actions=[],
            outcome="",
            reason="",
            violations=[],
        )
        self._held: Held | None = None
        self._goals = 0
        self._contexts = 0
        self._last_tick = 0
        self._log_open = False
        self._moved = False
        self._ending = False

    @property
    def status(self) -> TaskStatus:
        """The executive's memory as last published."""
        return self._status

    @property
    def ending(self) -> bool:
        """Whether the trial is over and only has to be put in order; it can't be aborted twice."""
        return self._ending

    def run(self) -> Steps:
        """Begin, loop, end, and close the log; whatever happens, the end is said."""
        yield from self._say()
        try:
            yield from self._open_log()
            yield Accept()
            yield from self._reset()
            outcome, reason = yield from self._retract()
        except PeerLost as error:
            outcome, reason = "aborted", f"hold:{error.service}"
        except NoAnswer as error:
            outcome, reason = "aborted", f"hold:{error.key.partition('/')[0]}"
        except FrasError as error:
            outcome, reason = "aborted", str(error)
        self._ending = True
        failures: list[FrasError] = []
        yield from self._leave_motion(failures)
        seq = yield from self._say(
            phase="ended",
            action="",
            goal_id="",
            outcome=outcome,
            reason=reason,
            violations=self._verify(self._done),
        )
        yield from self._close_log(seq, failures)
        yield from self._say(phase="idle")
        if failures:
            raise failures[0]

    def _leave_motion(self, failures: list[FrasError]) -> Steps:
        """Have motion forget the trial: no goal of it moves the arms any more."""
        if not self._moved:
            return
        request = CancelRequest(trial=self._request.trial, reason="the trial has ended")
        try:
            reply: CancelReply = yield Ask(CANCEL, request, self._timeout_s)
            self._last_tick = max(self._last_tick, reply.tick)
        except FrasError as error:
            failures.append(error)

    def _close_log(self, status_seq: int, failures: list[FrasError]) -> Steps:
        """Have the log closed; then, and not before, another trial may start."""
        if not self._log_open:
            return
        closing = CloseRequest(
            trial=self._request.trial, last_tick=self._last_tick, status_seq=status_seq
        )
        try:
            yield Ask(RECORDER_CLOSE, closing, CLOSE_TIMEOUT_S)
        except FrasError as error:
            failures.append(error)

    # --- beginning ------------------------------------------------------------------------

    def _open_log(self) -> Steps:
        request = self._request
        opening = OpenRequest(
            trial=request.trial,
            scenario=self._scenario,
            mesh=request.mesh,
            directory=request.out_dir,
        )
        reply: ResetReply = yield Ask(RECORDER_OPEN, opening, self._timeout_s)
        self._log_open = True
        self._compare(reply, "recorder")

    def _reset(self) -> Steps:
        request = self._request
        reset = ResetRequest(trial=request.trial, scenario=self._scenario, mesh=request.mesh)
        for query in (MOTION_RESET, SIM_RESET, SA_RESET):
            self._moved = self._moved or query is MOTION_RESET
            reply: ResetReply = yield Ask(query, reset, RESET_TIMEOUT_S)
            self._compare(reply, query.server)

    def _compare(self, reply: ResetReply, service: str) -> None:
        request = self._request
        expected = content_digest(request.trial, self._scenario, request.mesh)
        if reply.digest != expected:
            raise DigestMismatch(
                f"{service} read another scenario (digest {reply.digest[:12]}, expected "
                f"{expected[:12]}): do all services run the same version?",
                service=service,
            )

    # --- the loop -------------------------------------------------------------------------

    def _retract(self) -> Steps:
        ignore_ap = self._scenario.planner.ignore_ap
        reason = "initial"
        context = yield from self._context()
        while True:
            plan = yield from self._plan(context, reason, ignore_ap)
            if plan.no_plan is not None:
                return "no_plan", "; ".join(plan.no_plan.sentences)
            if not plan.actions:
                return "success", "the region of interest is visible"
            if not (yield from self._may_follow(plan, reason)):
                return "failed", "replans"
            planned_with_ignore_ap, ignore_ap = ignore_ap, False
            reason = "exposure"
            for action in plan.actions:
                ended: Ended = yield from self._act(action, plan, context)
                context = ended.context
                self._remember(ended, planned_with_ignore_ap)
                if deviation := reason_to_replan(ended):
                    reason = deviation
                    break

    def _context(self, expected: Sequence[str] = ()) -> Steps:
        self._contexts += 1
        request = ContextRequest(
            trial=self._request.trial,
            request_id=f"c{self._contexts}",
            min_tick=self._last_tick,
            expected=list(expected),
        )
        context: Context = yield Ask(SA_CONTEXT, request, self._timeout_s)
        return context

    def _plan(self, context: Context, reason: str, ignore_ap: bool) -> Steps:
        yield from self._say(phase="planning", action="", goal_id="")
        request = PlanRequest(
            request_id=context.request_id,
            reason=reason,
            ignore_ap=ignore_ap,
            tried=tuple(self._status.tried),
        )
        plan = self._make_plan(context, request)
        yield Say(plan)
        yield from self._say(plans=self._status.plans + 1)
        return plan

    def _may_follow(self, plan: Plan, reason: str) -> Steps:
        """Count a later plan, and what kind of trial it makes this; False if it is one too many."""
        if self._status.plans == 1:
            return True
        # A stop that a person lifted is no failure of the plan.
        replans = self._status.replans + (reason != "hold")
        if replans > self._scenario.planner.max_replans:
            return False
        names = {action.name for action in plan.actions}
        kind = self._status.scenario_kind
        if "release" in names:
            kind = "C"
        elif "move" in names and kind == "A":
            kind = "B"
        yield from self._say(replans=replans, scenario_kind=kind)
        return True

    def _act(self, action: PlannedAction, plan: Plan, before: Context) -> Steps:
        arm, block = action.args[0], action.args[1] if len(action.args) > 1 else ""
        self._goals += 1
        goal_id = f"g{self._goals}"
        yield from self._say(phase="acting", action=action.text, goal_id=goal_id)
        asked = TargetRequest(trial=self._request.trial, action=action.name, arm=arm, block=block)
        target: TargetReply = yield Ask(SA_TARGET, asked, self._timeout_s)
        goal = ExecuteRequest(
            trial=self._request.trial,
            goal_id=goal_id,
            name=action.name,
            arm=arm,
            block=block,
            target_m=target.position_m,
        )
        reply: ExecuteReply = yield Ask(EXECUTE, goal, self._timeout_s)
        if not reply.accepted:
            context = yield from self._context()
            return Ended(action, None, reply.reason, context)
        self._done[self._goals] = history_step(action.text, before, plan)
        result: ActionResult = yield AwaitResult(goal_id)
        self._last_tick = result.tick
        yield from self._say(actions=[*self._status.actions, action.text])
        if result.outcome == "aborted":
            # Its last tick may never be judged; nothing is asked about it.
            raise ActionAborted(result.reason)
        context = yield from self._context(action.expected)
        return Ended(action, result, "", context)

    def _remember(self, ended: Ended, ignored_ap: bool) -> None:
        action, result = ended.action, ended.result
        tried = newly_tried(action, result, ended.context.fluents, self._held)
        fresh = [block for block in tried if block not in self._status.tried]
        self._status = msgspec.structs.replace(self._status, tried=[*self._status.tried, *fresh])
        if result is not None and result.outcome == "succeeded":
            if action.name == "grasp":
                self._held = Held(block=action.args[1], ignored_ap=ignored_ap)
            elif action.name == "release":
                self._held = None

    def _say(self, **changes: Any) -> Steps:
        self._status = msgspec.structs.replace(self._status, tick=self._last_tick, **changes)
        stamped: TaskStatus = yield Say(self._status)
        return stamped.seq
