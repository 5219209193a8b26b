"""An executive that was killed at any moment goes on from what it had said."""

from typing import Any

import msgspec
import pytest

from fras_common.errors import FrasError
from fras_common.messages import (
    ActionResult,
    Context,
    Plan,
    PlannedAction,
    TaskRequest,
    TaskStatus,
)
from fras_common.scenario import PlannerSection, Scenario
from fras_common.topics import EXECUTE, RESUME, SA_CONTEXT
from fras_planner.effects import Ask, AwaitResult
from fras_planner.executive import Executive
from fras_planner.memory import PlanRequest, Resumption
from support.world import BLOCK, EXPOSED, World, action, after, held, pulling


class Remembering(World):
    """A world that keeps on while executives come and go, and plans what is left to be done."""

    def __init__(self, **fields: Any) -> None:
        super().__init__([], **fields)
        self.contexts: dict[str, Context] = {}
        self.results: dict[str, ActionResult] = {}
        self.taken: dict[str, str] = {}
        self.succeeded: list[str] = []
        self.restart_at = ""

    def make_plan(self, context: Context, request: PlanRequest) -> Plan:
        left = [one for one in pulling() if one.text not in self.succeeded]
        self.plans = [left if "visible_roi" not in context.fluents else []]
        return super().make_plan(context, request)

    def perform(self, effect: Any) -> Any:
        if isinstance(effect, AwaitResult) and effect.goal_id not in self.results:
            self.last = self.taken[effect.goal_id]
            result = super().perform(effect)
            if isinstance(result, ActionResult):
                self.results[effect.goal_id] = result
                self.succeeded += [self.last] if result.outcome == "succeeded" else []
            return result
        if isinstance(effect, AwaitResult):
            return self.results[effect.goal_id]
        return super().perform(effect)

    def answer(self, ask: Ask) -> Any:
        if ask.query is RESUME:
            self.restart_at = ""
            return None
        reply = super().answer(ask)
        if ask.query is SA_CONTEXT:
            self.contexts[reply.request_id] = reply
        if ask.query is EXECUTE and reply.accepted:
            assert ask.request.goal_id not in self.taken
            self.taken[ask.request.goal_id] = self.last
        return reply

    def run_until(self, effects: int) -> bool:
        """Kill the executive before it hears what came of an effect; False if it has ended."""
        steps = self.new_executive().run()
        outcome: Any = None
        for _ in range(effects + 1):
            try:
                effect = (
                    steps.throw(outcome) if isinstance(outcome, FrasError) else steps.send(outcome)
                )
            except StopIteration:
                return False
            outcome = self.perform(effect)
        return True

    def resumption(self) -> Resumption:
        statuses = [one for one in self.said if isinstance(one, TaskStatus)]
        plans = [one for one in self.said if isinstance(one, Plan)]
        status = statuses[-1]
        return Resumption(
            status,
            status.phase == "acting" and status.goal_id in self.taken,
            self.contexts,
            {one.request_id: one for one in plans},
            TaskRequest(command="start", trial="t", scenario=self.scenario),
        )

    def resume(self) -> TaskStatus:
        return self.run(self.new_executive(self.resumption()))


WHOLE = [one.text for one in pulling()]


def effects_of_a_trial() -> int:
    count = 0
    while Remembering(fluents=EXPOSED).run_until(count):
        count += 1
    return count


@pytest.mark.parametrize("effects", range(effects_of_a_trial()))
def test_wherever_it_was_killed_the_trial_comes_to_its_end(effects: int) -> None:
    undisturbed = Remembering(fluents=EXPOSED)
    undisturbed.run()
    world = Remembering(fluents=EXPOSED)
    assert world.run_until(effects)
    last = world.resumption().status
    if last.phase == "idle":
        return
    end = world.resume()
    assert (end.phase, end.outcome, end.reason) == (
        "idle",
        "success",
        "the region of interest is visible",
    )
    assert (end.actions, end.replans, end.tried) == (WHOLE, 0, [])
    assert end.scenario_kind == "A"
    # Each action was done once, and everything that was done is verified.
    assert sorted(world.taken.values()) == sorted(WHOLE)
    done = {one.goal: one.action for one in end.done}
    assert list(done.values()) == WHOLE
    if last.phase != "ended":
        assert list(world.verified.values()) == list(undisturbed.verified.values())
        assert end.violations == ["3 steps"]
    reasons = [one.reason for one in world.requests]
    assert reasons[0] == "initial"
    # A plan that was said, and not yet counted, is made again as the first one.
    assert set(reasons[1:]) <= {"restart", "exposure", *(["initial"] * (last.plans == 0))}


def test_the_first_plan_alone_ignores_attachments_also_after_a_restart() -> None:
    world = Remembering(fluents=EXPOSED, planner=PlannerSection(ignore_ap=True))
    effects = 0
    while not world.taken:
        world = Remembering(fluents=EXPOSED, planner=PlannerSection(ignore_ap=True))
        world.run_until(effects)
        effects += 1
    world.resume()
    assert [one.ignore_ap for one in world.requests] == [True, False, False]


def test_what_the_action_under_way_ruled_out_is_ruled_out() -> None:
    """A grasp that failed while nobody listened: its block is tried, whoever hears of it."""
    grasp = f"grasp(psm1,{BLOCK})"
    world = Remembering(fluents=held, ends={grasp: ("failed", "nothing_in_reach")})
    world.run_until(0)
    status = world.resumption().status
    world.taken["g2"] = grasp
    acting = msgspec.structs.replace(
        status, phase="acting", action=grasp, goal_id="g2", goals=2, contexts=2, plans=1, plan="c1"
    )
    world.ends = {grasp: ("failed", "nothing_in_reach")}
    resumed = Resumption(acting, started=True, request=TaskRequest(command="start", trial="t"))
    steps = world.new_executive(resumed).run()
    outcome: Any = None
    while not world.requests:
        outcome = world.perform(steps.send(outcome))
    assert (world.requests[0].tried, world.requests[0].reason) == ((BLOCK,), "nothing_in_reach")


def test_what_is_held_is_remembered() -> None:
    effects = 0
    world = Remembering(fluents=EXPOSED)
    while f"pull(psm1,{BLOCK})" not in world.taken.values():
        world = Remembering(fluents=EXPOSED)
        world.run_until(effects)
        effects += 1
    assert world.resumption().status.held == BLOCK


def test_a_trial_whose_beginning_is_forgotten_is_ended() -> None:
    world = Remembering(fluents=EXPOSED)
    world.run_until(6)
    status = world.resumption().status
    request = TaskRequest(command="start", trial="t")
    executive = Executive(
        request, Scenario(), world.make_plan, world.verify, {}, Resumption(status)
    )
    end = world.run(executive)
    assert (end.phase, end.outcome, end.reason) == ("idle", "aborted", "hold:planner")
    assert world.asked[-2:] == ["motion/cancel", "recorder/close"]


def test_actions_that_are_not_remembered_are_said_to_be_unverified() -> None:
    effects = 0
    world = Remembering(fluents=EXPOSED)
    while len(world.taken) < 3:
        world = Remembering(fluents=EXPOSED)
        world.run_until(effects)
        effects += 1
    world.contexts.pop("c1")
    assert world.resume().violations[-1] == "1 actions are not remembered and can't be verified"


# --- motion started again ------------------------------------------------------------------


class Restarting(Remembering):
    """Motion starts again in the middle of an action, or before a goal."""

    def perform(self, effect: Any) -> Any:
        if isinstance(effect, AwaitResult) and self.taken[effect.goal_id] == self.restart_at:
            self.last = self.taken[effect.goal_id]
            self.ends = {self.last: ("interrupted", "restart")}
            result = super().perform(effect)
            self.ends, self.last = {}, self.succeeded[-1] if self.succeeded else ""
            return result
        return super().perform(effect)


@pytest.mark.parametrize("text", WHOLE)
def test_an_action_that_a_restart_of_motion_ended_is_planned_anew(text: str) -> None:
    world = Restarting(fluents=EXPOSED, planner=PlannerSection(max_replans=0))
    world.restart_at = text
    end = world.run()
    assert (end.outcome, end.replans, end.tried) == ("success", 0, [])
    assert world.asked.count("motion/resume") == 1
    assert [one.reason for one in world.requests][:2] == ["initial", "restart"]
    assert list(world.taken.values()).count(text) == 2


def test_a_goal_refused_because_of_a_restart_is_planned_anew() -> None:
    world = Remembering(
        fluents=EXPOSED,
        refuse={f"grasp(psm1,{BLOCK})": "restart"},
        planner=PlannerSection(max_replans=0),
    )
    end = world.run()
    assert (end.outcome, end.replans, end.tried) == ("success", 0, [])
    assert world.asked.count("motion/resume") == 1
    assert world.requests[1].reason == "restart"


def test_a_motion_that_lost_the_trial_ends_it() -> None:
    world = Remembering(fluents=EXPOSED, refuse={f"grasp(psm1,{BLOCK})": "another_trial"})
    end = world.run()
    assert (end.outcome, end.reason) == ("aborted", "hold:motion")


def test_an_unlisted_action_is_read_from_its_text() -> None:
    world = Remembering(fluents=after(release=[]))
    world.taken["g1"] = "release(psm1)"
    world.run_until(0)
    status = msgspec.structs.replace(
        world.resumption().status, phase="acting", action="release(psm1)", goal_id="g1", goals=1
    )
    resumed = Resumption(status, started=True, request=TaskRequest(command="start", trial="t"))
    steps = world.new_executive(resumed).run()
    outcome: Any = None
    while not world.requests:
        outcome = world.perform(steps.send(outcome))
    assert world.expected == [[]]
    assert isinstance(action(1, "release(psm1)"), PlannedAction)
