"""The executive's loop, driven with plain values: no bus, no clock, no clingo."""

from typing import Any

import pytest

from fras_common.bus import NoAnswer, RemoteFault
from fras_common.errors import FrasError
from fras_common.messages import (
    Fault,
    Monitored,
    NoPlan,
    PlannedAction,
    ResetReply,
)
from fras_common.scenario import PatientSection, PlannerSection, Scenario, patient_scenario
from fras_common.topics import (
    EXECUTE,
    PATIENT,
    RECORDER_OPEN,
    SA_CONTEXT,
    SIM_RESET,
)
from fras_planner.effects import Ask
from fras_planner.endings import PeerLost
from support.world import (
    BLOCK,
    EXPOSED,
    MOVING,
    OTHER,
    RELEASING,
    RULES,
    THIRD,
    World,
    after,
    held,
    hidden_pull,
    pulling,
)


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


def test_a_patient_is_reset_behind_its_model_with_a_scenario_of_its_own() -> None:
    class Noting(World):
        def answer(self, ask: Ask) -> Any:
            if ask.query.key.endswith("/reset"):
                resets[ask.query.server] = ask.request.scenario
            return super().answer(ask)

    resets: dict[str, Scenario] = {}
    patient = PatientSection(young_modulus_factor=1.3, disc_shift_m=0.005)
    world = Noting([pulling(), []], EXPOSED, patient=patient)
    assert world.run().outcome == "success"
    assert list(resets) == ["motion", "sim", "patient", "sa"]
    assert resets["patient"] == patient_scenario(world.scenario)
    assert {resets[one] == world.scenario for one in ("motion", "sim", "sa")} == {True}


def test_the_log_is_opened_with_the_rules_by_value() -> None:
    world = World([[]])
    world.run()
    assert world.opened is not None
    assert world.opened.rules == RULES


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
        (PATIENT.reset, NoAnswer("patient/reset", 1.0), "hold:patient"),
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
    world = World([pulling()], EXPOSED, faults={query.key: error}, patient=PatientSection())
    end = world.run()
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
