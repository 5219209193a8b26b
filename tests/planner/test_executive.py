"""The executive's loop, driven with plain values: no bus, no clock, no clingo."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import msgspec
import pytest

from fras_common.bus import NoAnswer, RemoteFault
from fras_common.codec import content_digest
from fras_common.errors import FrasError
from fras_common.messages import (
    ActionResult,
    CancelReply,
    CloseReply,
    Context,
    ExecuteReply,
    Fault,
    Monitored,
    NoPlan,
    Plan,
    PlannedAction,
    ResetReply,
    TargetReply,
    TaskRequest,
    TaskStatus,
)
from fras_common.scenario import PlannerSection, Scenario, resolve
from fras_common.topics import (
    CANCEL,
    EXECUTE,
    RECORDER_CLOSE,
    RECORDER_OPEN,
    SA_CONTEXT,
    SA_TARGET,
    SIM_RESET,
)
from fras_planner.effects import Accept, Ask, AwaitResult, Say
from fras_planner.executive import Executive, PeerLost, PlanRequest, TaskAborted

BLOCK, OTHER, THIRD = "b(1,1)", "b(2,2)", "b(3,3)"


def action(t: int, text: str, *expected: str) -> PlannedAction:
    name, _, arguments = text.partition("(")
    arm, _, block = arguments.removesuffix(")").partition(",")
    args = [arm, block] if block else [arm]
    return PlannedAction(t=t, text=text, name=name, args=args, expected=list(expected))


def pulling(block: str = BLOCK) -> list[PlannedAction]:
    return [
        action(1, f"reach(psm1,{block})", f"at(psm1,{block})"),
        action(2, f"grasp(psm1,{block})", f"in_hand(psm1,{block})"),
        action(3, f"pull(psm1,{block})"),
    ]


MOVING = [action(1, f"move(psm1,{OTHER})")]
RELEASING = [action(1, "release(psm1)", "-closed_gripper(psm1)"), *pulling(OTHER)]


@dataclass
class World:
    """Answers the executive: what is true after each action, and how each action ends."""

    plans: list[list[PlannedAction] | NoPlan]
    fluents: Callable[[str], list[str]] = lambda text: ["reachable(psm1,b(1,1))"]
    ends: dict[str, tuple[str, str]] = field(default_factory=dict[str, tuple[str, str]])
    refuse: dict[str, str] = field(default_factory=dict[str, str])
    faults: dict[str, FrasError] = field(default_factory=dict[str, FrasError])
    abort_at: str = ""
    planner: PlannerSection = field(default_factory=PlannerSection)
    asked: list[str] = field(default_factory=list[str])
    requests: list[PlanRequest] = field(default_factory=list[PlanRequest])
    said: list[Plan | TaskStatus] = field(default_factory=list[Plan | TaskStatus])
    accepted: bool = False
    verified: dict[int, list[str]] = field(default_factory=dict[int, list[str]])
    expected: list[list[str]] = field(default_factory=list[list[str]])
    evidence: dict[str, float] = field(default_factory=dict[str, float])
    last: str = ""
    tick: int = 0

    @property
    def scenario(self) -> Scenario:
        return resolve(Scenario(planner=self.planner))

    def make_plan(self, context: Context, request: PlanRequest) -> Plan:
        self.requests.append(request)
        content = self.plans.pop(0)
        no_plan = content if isinstance(content, NoPlan) else None
        return Plan(
            request_id=request.request_id,
            reason=request.reason,
            criterion="weighted",
            goal="visible",
            asp_digest="",
            ignore_ap=request.ignore_ap,
            tried=list(request.tried),
            actions=[] if isinstance(content, NoPlan) else content,
            target="",
            arm="",
            history=[],
            cost=[],
            models=1,
            ground_s=0.0,
            solve_s=0.0,
            explanation=[],
            no_plan=no_plan,
        )

    def run(self) -> TaskStatus:
        request = TaskRequest(command="start", trial="t", scenario=self.scenario)
        steps = Executive(request, self.scenario, self.make_plan, self.verify).run()
        outcome: Any = None
        while True:
            try:
                if isinstance(outcome, FrasError):
                    effect = steps.throw(outcome)
                else:
                    effect = steps.send(outcome)
            except StopIteration:
                assert isinstance(self.said[-1], TaskStatus)
                return self.said[-1]
            outcome = self.perform(effect)

    def verify(self, history: dict[int, list[str]]) -> list[str]:
        self.verified = history
        return [f"{len(history)} steps"]

    def perform(self, effect: Any) -> Any:
        if isinstance(effect, Say):
            self.said.append(effect.message)
            return msgspec.structs.replace(effect.message, seq=len(self.said))
        if isinstance(effect, Accept):
            self.accepted = True
            return None
        if isinstance(effect, AwaitResult):
            if self.abort_at and self.last.startswith(self.abort_at):
                self.abort_at = ""
                return TaskAborted("enough")
            outcome, reason = self.ends.get(self.last, ("succeeded", ""))
            self.tick += 10
            return ActionResult(
                tick=self.tick,
                goal_id=effect.goal_id,
                name="",
                arm="",
                block="",
                outcome=outcome,  # type: ignore[arg-type]
                reason=reason,
            )
        assert isinstance(effect, Ask)
        self.asked.append(effect.query.key)
        if effect.query.key in self.faults:
            return self.faults[effect.query.key]
        return self.answer(effect)

    def answer(self, ask: Ask) -> Any:
        request = ask.request
        if ask.query is SA_CONTEXT:
            assert request.min_tick == self.tick
            return Context(
                tick=self.tick,
                trial="t",
                request_id=request.request_id,
                fluents=self.fluents(self.last),
                evidence={},
                names=[],
                blocks_m=[],
                roi_m=(0.0, 0.0, 0.0),
                fixed_points_m=[],
                monitored=self.monitor(request.expected),
            )
        if ask.query is SA_TARGET:
            return TargetReply(position_m=(0.0, 0.0, 0.0))
        if ask.query is EXECUTE:
            self.last = f"{request.name}({request.arm}" + (
                f",{request.block})" if request.block else ")"
            )
            refusal = self.refuse.pop(self.last, "")
            return ExecuteReply(accepted=not refusal, reason=refusal)
        if ask.query is RECORDER_CLOSE:
            assert request.last_tick == self.tick
            return CloseReply(path="", messages=0, lost=0)
        if ask.query is CANCEL:
            return CancelReply(tick=self.tick)
        return ResetReply(digest=content_digest("t", self.scenario, b""))

    def monitor(self, expected: list[str]) -> list[Monitored]:
        """Answer as situation awareness does: one entry for each expectation."""
        self.expected.append(expected)
        fluents = self.fluents(self.last)
        return [
            Monitored(
                atom=atom,
                holds=(atom.removeprefix("-") in fluents) != atom.startswith("-"),
                evidence=self.evidence,
            )
            for atom in expected
        ]


def after(**by_action: list[str]) -> Callable[[str], list[str]]:
    """Fluents after each action, by its name."""
    return lambda text: by_action.get(text.partition("(")[0], [])


def held(text: str) -> list[str]:
    """Where psm1 is and what it holds after an action that went as expected."""
    block = BLOCK if text.startswith("move") else text.partition(",")[2].removesuffix(")")
    return [f"at(psm1,{block})", f"in_hand(psm1,{block})"]


EXPOSED = after(
    reach=[f"at(psm1,{BLOCK})"],
    grasp=[f"in_hand(psm1,{BLOCK})"],
    pull=["visible_roi"],
)


def hidden_pull(*fluents: str) -> Callable[[str], list[str]]:
    """Reach and grasp as expected; the pull exposes nothing, the move does."""
    return lambda text: [*held(text), *fluents, *(["visible_roi"] * text.startswith("move"))]


def test_a_trial_resets_in_order_and_closes_its_log() -> None:
    world = World([pulling(), []], EXPOSED)
    end = world.run()
    assert (end.phase, end.outcome, end.scenario_kind) == ("idle", "success", "A")
    assert end.actions == ["reach(psm1,b(1,1))", "grasp(psm1,b(1,1))", "pull(psm1,b(1,1))"]
    assert (end.plans, end.replans) == (2, 0)
    assert world.accepted
    assert world.asked[:4] == ["recorder/open", "motion/reset", "sim/reset", "sa/reset"]
    assert world.asked[-2:] == ["motion/cancel", "recorder/close"]
    assert [request.reason for request in world.requests] == ["initial", "exposure"]


def test_what_was_done_is_verified_with_what_was_known_before() -> None:
    world = World(
        [pulling(), RELEASING, []],
        lambda text: [f"after({text})", f"at(psm1,{BLOCK})"],
        planner=PlannerSection(ignore_ap=True),
        ends={f"grasp(psm1,{BLOCK})": ("failed", "nothing_in_reach")},
        refuse={f"reach(psm1,{OTHER})": "no way"},
    )
    end = world.run()
    there = f"at(psm1,{BLOCK})"
    assert list(world.verified.values()) == [
        [f"reach(psm1,{BLOCK})", "after()", there, "ignore_ap"],
        [f"grasp(psm1,{BLOCK})", f"after(reach(psm1,{BLOCK}))", there, "ignore_ap"],
        ["release(psm1)", f"after(grasp(psm1,{BLOCK}))", there, f"tried({BLOCK})"],
    ]  # and not what motion refused
    assert end.violations == ["3 steps"]


def test_soft_limit_leads_to_a_move_and_kind_b() -> None:
    world = World(
        [pulling(), MOVING, []],
        hidden_pull("max_height(psm1)"),
        ends={f"pull(psm1,{BLOCK})": ("interrupted", "force_soft")},
    )
    end = world.run()
    assert (end.outcome, end.scenario_kind, end.replans) == ("success", "B", 1)
    assert [request.reason for request in world.requests] == ["initial", "force", "exposure"]
    assert end.tried == []


def test_ignored_attachments_hold_for_the_first_plan_and_the_block_is_then_tried() -> None:
    world = World(
        [pulling(), RELEASING, []],
        hidden_pull("max_height(psm1)"),
        ends={f"pull(psm1,{BLOCK})": ("interrupted", "force_soft")},
        planner=PlannerSection(ignore_ap=True),
    )
    end = world.run()
    assert (end.outcome, end.scenario_kind) == ("success", "C")
    assert [request.ignore_ap for request in world.requests] == [True, False, False]
    assert world.requests[1].tried == (BLOCK,)


def test_hard_limit_rules_out_every_block_that_the_gripper_spans() -> None:
    world = World(
        [pulling(), RELEASING, []],
        hidden_pull(f"in_hand(psm1,{THIRD})", f"in_hand(psm2,{OTHER})"),
        ends={f"pull(psm1,{BLOCK})": ("interrupted", "force_hard")},
    )
    world.run()
    assert world.requests[1].tried == (BLOCK, THIRD)


def test_move_that_does_not_expose_rules_the_held_block_out() -> None:
    world = World(
        [pulling(), MOVING, RELEASING, []],
        held,
        ends={f"pull(psm1,{BLOCK})": ("interrupted", "force_soft")},
    )
    end = world.run()
    assert world.requests[2].tried == (BLOCK,)
    assert end.scenario_kind == "C"


def test_grasp_of_nothing_and_refused_reach_rule_the_block_out() -> None:
    world = World(
        [pulling(), pulling(OTHER), pulling(THIRD), []],
        held,
        ends={f"grasp(psm1,{BLOCK})": ("failed", "nothing_in_reach")},
        refuse={f"reach(psm1,{OTHER})": "unreachable"},
    )
    end = world.run()
    assert end.tried == [BLOCK, OTHER]
    assert [request.reason for request in world.requests] == [
        "initial",
        "nothing_in_reach",
        "refused: unreachable",
        "exposure",
    ]


@pytest.mark.parametrize("name", ["pull", "move"])
def test_a_pull_or_move_that_motion_refuses_rules_the_block_out(name: str) -> None:
    """Planned again, it would be refused again, until there are too many plans."""
    reach, grasp, pull = pulling()
    move = PlannedAction(
        t=3, text=f"move(psm1,{OTHER})", name="move", args=["psm1", OTHER], expected=[]
    )
    world = World(
        [[reach, grasp, pull if name == "pull" else move], []],
        held,
        refuse={pull.text if name == "pull" else move.text: "instrument_distance"},
    )
    end = world.run()
    assert end.tried == [BLOCK]
    assert [request.tried for request in world.requests] == [(), (BLOCK,)]


def test_effect_that_did_not_come_is_a_deviation() -> None:
    world = World([pulling(), []], after(reach=[]))
    world.run()
    assert world.requests[1].reason == (
        "deviation: at(psm1,b(1,1)) expected after reach(psm1,b(1,1))"
    )


def test_effect_that_must_not_hold_is_watched_too() -> None:
    world = World(
        [[RELEASING[0]], []],
        after(release=["closed_gripper(psm1)"]),
        evidence={"jaw_rad": 0.1, "closed_jaw_rad": 0.349},
    )
    world.run()
    assert world.requests[1].reason == (
        "deviation: -closed_gripper(psm1) expected after release(psm1); "
        "jaw 5.7 degrees, needed at least 20.0 degrees"
    )


def test_deviation_tells_the_numbers_behind_it() -> None:
    world = World(
        [pulling(), []],
        after(reach=[f"at(psm1,{BLOCK})"]),
        evidence={
            "distance_m": 0.0072,
            "at_distance_m": 0.005,
            "jaw_rad": -0.3,
            "closed_jaw_rad": 0.349,
        },
    )
    world.run()
    assert world.requests[1].reason == (
        f"deviation: in_hand(psm1,{BLOCK}) expected after grasp(psm1,{BLOCK}); "
        "distance 7.2 mm, needed below 5.0 mm; jaw -17.2 degrees, needed below 20.0 degrees"
    )


def test_situation_awareness_is_asked_what_the_last_action_should_have_brought() -> None:
    world = World(
        [pulling(), pulling(OTHER), []],
        held,
        ends={f"grasp(psm1,{BLOCK})": ("failed", "nothing_in_reach")},
        refuse={f"reach(psm1,{OTHER})": "no way"},
    )
    world.run()
    assert world.expected == [
        [],  # before anything was done
        [f"at(psm1,{BLOCK})"],
        [f"in_hand(psm1,{BLOCK})"],  # also of what failed
        [],  # not of what was refused
    ]


def test_expectation_that_nobody_looked_at_is_a_deviation() -> None:
    class Blind(World):
        def monitor(self, expected: list[str]) -> list[Monitored]:
            return []

    world = Blind([pulling(), []], EXPOSED)
    world.run()
    assert world.requests[1].reason == (
        f"deviation: at(psm1,{BLOCK}) expected after reach(psm1,{BLOCK})"
    )


def test_lifted_stop_is_planned_anew_and_no_failure() -> None:
    world = World(
        [pulling(), pulling(OTHER), []],
        lambda text: [*held(text), "visible_roi"],
        ends={f"reach(psm1,{BLOCK})": ("interrupted", "hold")},
        planner=PlannerSection(max_replans=0),
    )
    end = world.run()
    assert (end.outcome, end.replans) == ("success", 0)
    assert world.requests[1].reason == "hold"


def test_too_many_replans_end_the_trial() -> None:
    world = World(
        [pulling() for _ in range(9)],
        after(reach=[]),
        planner=PlannerSection(max_replans=2),
    )
    end = world.run()
    assert (end.outcome, end.reason, end.replans) == ("failed", "replans", 2)


def test_no_plan_ends_with_its_sentences() -> None:
    world = World([NoPlan(core=["keep_off"], sentences=["Every block is attached."])])
    end = world.run()
    assert (end.outcome, end.reason) == ("no_plan", "Every block is attached.")
    assert end.actions == []


def test_aborted_action_aborts_the_trial_with_its_reason() -> None:
    world = World([pulling()], EXPOSED, ends={f"reach(psm1,{BLOCK})": ("aborted", "hold:solver")})
    end = world.run()
    assert (end.outcome, end.reason) == ("aborted", "hold:solver")


def test_abort_stops_the_arms_and_closes_the_log() -> None:
    world = World([pulling()], EXPOSED, abort_at="pull")
    end = world.run()
    assert (end.outcome, end.reason) == ("aborted", "enough")
    assert world.asked[-2:] == ["motion/cancel", "recorder/close"]


@pytest.mark.parametrize(
    ("query", "error", "reason"),
    [
        (SIM_RESET, NoAnswer("sim/reset", 1.0), "hold:sim"),
        (SA_CONTEXT, NoAnswer("sa/context", 1.0), "hold:sa"),
        (EXECUTE, PeerLost("gone", service="motion"), "hold:motion"),
        (
            SIM_RESET,
            RemoteFault("sim/reset", Fault(kind="BadMesh", text="one node")),
            "sim/reset: BadMesh: one node",
        ),
    ],
)
def test_service_that_fails_is_named(query: Any, error: FrasError, reason: str) -> None:
    end = World([pulling()], EXPOSED, faults={query.key: error}).run()
    assert (end.outcome, end.reason) == ("aborted", reason)


def test_log_that_cannot_be_opened_is_no_trial() -> None:
    fault = RemoteFault("recorder/open", Fault(kind="LogExists", text="there is one"))
    world = World([], faults={RECORDER_OPEN.key: fault})
    end = world.run()
    assert end.outcome == "aborted"
    assert "there is one" in end.reason
    assert not world.accepted
    assert "recorder/close" not in world.asked


def test_service_that_read_another_scenario_is_named() -> None:
    class Confused(World):
        def answer(self, ask: Ask) -> Any:
            if ask.query is SIM_RESET:
                return ResetReply(digest="0" * 64)
            return super().answer(ask)

    end = Confused([pulling()], EXPOSED).run()
    assert end.outcome == "aborted"
    assert end.reason.startswith("sim read another scenario")
