"""The executive: context -> plan -> action -> result, until the trial has a named end.

A coroutine that yields effects and knows no bus and no clock. What a plan may contain and when
the goal is reached is knowledge and stands in `asp/`; here stands only the order of the loop and
the bookkeeping of section "Pull, move, re-plan": which blocks have been tried.
"""

from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Any

import msgspec

from fras_common.bus import NoAnswer
from fras_common.errors import FrasError
from fras_common.executed import history_step
from fras_common.messages import (
    ActionResult,
    CloseRequest,
    Context,
    ContextRequest,
    DoneAction,
    ExecuteReply,
    ExecuteRequest,
    OpenRequest,
    Plan,
    PlanDecision,
    PlannedAction,
    ResetReply,
    TargetReply,
    TargetRequest,
    TaskRequest,
    TaskStatus,
)
from fras_common.scenario import Scenario
from fras_common.topics import EXECUTE, RECORDER_OPEN, SA_CONTEXT, SA_TARGET
from fras_planner.approval import Proposal, rejected, rejection
from fras_planner.beginning import compare, log_request, reset_all
from fras_planner.effects import Accept, Ask, AwaitDecision, AwaitResult, Effect, Say
from fras_planner.endings import (
    RESTART,
    ActionAborted,
    Ended,
    PeerLost,
    is_failure,
    kind_with,
    reason_to_replan,
)
from fras_planner.memory import PlanRequest, Resumption, first_status, planned
from fras_planner.requests import close_log, leave_motion, lift_restart
from fras_planner.tried import Held, newly_tried

MakePlan = Callable[[Context, "PlanRequest"], Plan]
# Says which safety specifications a history breaks: for each step what held, and what was done.
Verify = Callable[[dict[int, list[str]]], list[str]]
Steps = Generator[Effect, Any, Any]


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
    rules : mapping of str to str
        The rule files that both go by, for the log.
    resumed : Resumption, optional
        What one of before has left of this trial; without it the trial begins.

    Attributes
    ----------
    proposal : Proposal or None
        The plan that waits for a person's decision, while `AwaitDecision` does.
    """

    def __init__(
        self,
        request: TaskRequest,
        scenario: Scenario,
        make_plan: MakePlan,
        verify: Verify,
        rules: Mapping[str, str],
        resumed: Resumption | None = None,
    ) -> None:
        self._request = request
        self._scenario = scenario
        self._make_plan = make_plan
        self._verify = verify
        self._rules = rules
        self._resumed = resumed
        self._timeout_s = scenario.run.peer_timeout_s
        self._status = resumed.status if resumed is not None else first_status(request.trial)
        status = self._status
        self._done = {one.goal: one for one in status.done}
        self._history: dict[int, list[str]] = {}
        self._held = Held(status.held, status.held_ignored_ap) if status.held else None
        self._goals = status.goals
        self._contexts = status.contexts
        self._followed = status.plan
        self._last_tick = max(0, status.tick)
        self._log_open = self._moved = resumed is not None
        self._ending = status.phase == "ended"
        self._lost = ""
        self.proposal: Proposal | None = None

    @property
    def status(self) -> TaskStatus:
        """The executive's memory as last published."""
        return self._status

    @property
    def ending(self) -> bool:
        """Whether the trial is over and only has to be put in order; it can't be aborted twice."""
        return self._ending

    @property
    def log_request(self) -> OpenRequest:
        """What opens the log; asked again of a recorder that took the place of another."""
        return log_request(self._request, self._scenario, self._rules)

    @property
    def log_open(self) -> bool:
        """Whether a recorder has opened the log."""
        return self._log_open

    def run(self) -> Steps:
        """Begin or go on, loop, end, and close the log; whatever happens, the end is said."""
        seq = yield from self._say()
        failures: list[FrasError] = []
        if not self._ending:
            outcome, reason = yield from self._until_named()
            self._ending = True
            yield from self._leave_motion(failures)
            seq = yield from self._say(
                phase="ended",
                action="",
                goal_id="",
                outcome=outcome,
                reason=reason,
                violations=self._verified(),
            )
        yield from self._close_log(seq, failures)
        yield from self._say(phase="idle")
        if failures:
            raise failures[0]

    def _until_named(self) -> Steps:
        """Do everything until the trial has an outcome and a reason."""
        try:
            yield from self._begin()
            return (yield from self._retract())
        except PeerLost as error:
            self._lost = error.service
        except NoAnswer as error:
            self._lost = error.key.partition("/")[0]
        except FrasError as error:
            return "aborted", str(error)
        return "aborted", f"hold:{self._lost}"

    def _verified(self) -> list[str]:
        """Say what was broken, as far as can be told after a restart."""
        if self._resumed is not None:
            self._history = {**self._resumed.history(self._done.values()), **self._history}
        unknown = len(self._done) - len(self._history)
        told = [f"{unknown} actions are not remembered and can't be verified"] if unknown else []
        return [*self._verify(dict(sorted(self._history.items()))), *told]

    def _leave_motion(self, failures: list[FrasError]) -> Steps:
        if not self._moved:
            return
        # One that is gone for good was waited for already.
        is_patient = self._lost != "motion"
        trial = self._request.trial
        try:
            tick = yield from leave_motion(trial, self._timeout_s, is_patient=is_patient)
            self._last_tick = max(self._last_tick, tick)
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
            yield from close_log(closing, self.log_request)
        except FrasError as error:
            failures.append(error)

    # --- beginning ------------------------------------------------------------------------

    def _begin(self) -> Steps:
        resumed = self._resumed
        request, scenario = self._request, self._scenario
        if resumed is None:
            reply: ResetReply = yield Ask(RECORDER_OPEN, self.log_request, self._timeout_s)
            self._log_open = True
            compare(request, scenario, reply, "recorder")
        elif resumed.request is None:
            raise PeerLost("how the trial began is not remembered", service="planner")
        if resumed is None or resumed.status.phase == "resetting":
            yield Accept()
            self._moved = True
            yield from reset_all(request, scenario)

    # --- the loop -------------------------------------------------------------------------

    def _retract(self) -> Steps:
        ignore_ap = self._scenario.planner.ignore_ap and not self._status.plans
        reason = RESTART if self._status.plans else "initial"
        waits: Proposal | None = None
        if self._resumed is not None and self._resumed.started:
            ended: Ended = yield from self._end_of_goal(self._resumed)
            context = ended.context
            reason = reason_to_replan(ended) or reason
        elif self._resumed is not None and self._resumed.proposal is not None:
            waits = self._resumed.proposal
            context = waits.context
        else:
            context = yield from self._context()
        while True:
            if waits is None:
                plan = yield from self._plan(context, reason, ignore_ap)
                if plan.no_plan is not None:
                    return "no_plan", "; ".join(plan.no_plan.sentences)
                if not plan.actions:
                    return "success", "the region of interest is visible"
                if not (yield from self._may_follow(plan, reason)):
                    return "failed", "replans"
            else:
                plan, waits = waits.plan, None
            ignore_ap = False
            if self._scenario.planner.confirm:
                decided: PlanDecision = yield from self._decision(plan, context)
                if not decided.approved:
                    context, reason = (yield from self._context()), rejection(decided)
                    continue
            reason = "exposure"
            for action in plan.actions:
                ended = yield from self._act(action, plan, context)
                context = ended.context
                self._remember(ended, plan.ignore_ap)
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
            rejected=rejected(self._status),
        )
        plan = self._make_plan(context, request)
        yield Say(plan)
        self._followed = plan.request_id
        yield from self._say(plans=self._status.plans + 1)
        return plan

    def _may_follow(self, plan: Plan, reason: str) -> Steps:
        """Count a later plan, and what kind of trial it makes this; False if it is one too many."""
        if self._status.plans == 1:
            return True
        replans = self._status.replans + is_failure(reason)
        if replans > self._scenario.planner.max_replans:
            return False
        kind = self._status.scenario_kind
        if not self._scenario.planner.confirm:
            kind = kind_with(kind, plan)
        yield from self._say(replans=replans, scenario_kind=kind)
        return True

    def _decision(self, plan: Plan, context: Context) -> Steps:
        """Wait until a person has approved or rejected a plan; nothing moves meanwhile."""
        yield from self._say(phase="awaiting_approval", action="", goal_id="")
        self.proposal = Proposal(plan, context)
        try:
            decided: PlanDecision = yield AwaitDecision(plan.request_id)
        finally:
            self.proposal = None
        kind = self._status.scenario_kind
        if decided.approved and self._status.plans > 1:
            kind = kind_with(kind, plan)
        decisions = [*self._status.decisions, decided]
        yield from self._say(phase="planning", decisions=decisions, scenario_kind=kind)
        return decided

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
        if reply.reason == "another_trial":
            raise PeerLost("motion serves the trial no more", service="motion")
        if not reply.accepted:
            if reply.reason == RESTART:
                yield from lift_restart(self._timeout_s)
            context = yield from self._context()
            return Ended(action, None, reply.reason, context)
        self._note_done(action.text, before.request_id)
        self._history[self._goals] = history_step(action.text, before, plan)
        result: ActionResult = yield AwaitResult(goal_id)
        yield from self._say_done(action.text, result)
        return (yield from self._after(action, result))

    def _end_of_goal(self, resumed: Resumption) -> Steps:
        """Await the end of the action that an executive of before has begun."""
        status = resumed.status
        plan = resumed.plans.get(status.plan)
        action = planned(plan, status.action)
        is_known = status.goals in self._done
        if not is_known:
            self._note_done(action.text, f"c{status.contexts}")
        result: ActionResult = yield AwaitResult(status.goal_id)
        if is_known:
            self._last_tick = max(self._last_tick, result.tick)
        else:
            yield from self._say_done(action.text, result)
        ended: Ended = yield from self._after(action, result)
        self._remember(ended, plan is not None and plan.ignore_ap)
        return ended

    def _note_done(self, action: str, context: str) -> None:
        self._done[self._goals] = DoneAction(
            goal=self._goals, action=action, context=context, plan=self._followed
        )

    def _say_done(self, action: str, result: ActionResult) -> Steps:
        self._last_tick = max(self._last_tick, result.tick)
        yield from self._say(actions=[*self._status.actions, action])

    def _after(self, action: PlannedAction, result: ActionResult) -> Steps:
        if result.outcome == "aborted":
            # Its last tick may never be judged; nothing is asked about it.
            raise ActionAborted(result.reason)
        if result.reason == RESTART:
            yield from lift_restart(self._timeout_s)
        context = yield from self._context(action.expected)
        return Ended(action, result, "", context)

    def _remember(self, ended: Ended, ignored_ap: bool) -> None:
        action, result = ended.action, ended.result
        if ended.by_restart:
            return
        tried = newly_tried(action, result, ended.context.fluents, self._held)
        fresh = [block for block in tried if block not in self._status.tried]
        self._status = msgspec.structs.replace(self._status, tried=[*self._status.tried, *fresh])
        if result is not None and result.outcome == "succeeded":
            if action.name == "grasp":
                self._held = Held(block=action.args[1], ignored_ap=ignored_ap)
            elif action.name == "release":
                self._held = None

    def _say(self, **changes: Any) -> Steps:
        held = self._held
        self._status = msgspec.structs.replace(
            self._status,
            tick=self._last_tick,
            goals=self._goals,
            contexts=self._contexts,
            plan=self._followed,
            held=held.block if held is not None else "",
            held_ignored_ap=held is not None and held.ignored_ap,
            done=list(self._done.values()),
            **changes,
        )
        stamped: TaskStatus = yield Say(self._status)
        return stamped.seq
