"""Situation awareness's shell on an in-memory bus: joins by tick, answers when it can."""

from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import pytest

from fras_common.bus import RemoteFault
from fras_common.errors import FrasError
from fras_common.messages import (
    ContextRequest,
    FaultRecord,
    ResetRequest,
    TargetRequest,
    Verdict,
)
from fras_common.scenario import Scenario, SceneSection
from fras_common.topics import (
    FAULT,
    ROBOT_STATE,
    SA_CONTEXT,
    SA_RESET,
    SA_TARGET,
    TISSUE_MODEL,
    TISSUE_STATE,
    VERDICT,
)
from fras_sa.join import TickJoin
from fras_sa.service import AwarenessService
from support.robots import robot
from support.shells import ShellBench
from support.tissues import MODEL, tissue


class Bench(ShellBench):
    """Situation awareness, and a client that plays sim and motion."""

    def __init__(self) -> None:
        self.now_s = 0.0
        super().__init__(
            "sa", lambda host: AwarenessService(host, lambda: self.now_s), client="sim/test"
        )
        self.verdicts: list[Verdict] = self.heard(VERDICT)
        self.model = self.peers(TISSUE_MODEL)
        self.tissue = self.peers(TISSUE_STATE)
        self.robot = self.peers(ROBOT_STATE)

    def reset(self, trial: str = "t") -> None:
        scene = SceneSection(roi_m=(0.05, 0.06, 0.0))
        self.ask(SA_RESET, ResetRequest(trial=trial, scenario=Scenario(scene=scene)))
        self.model.put(msgspec.structs.replace(MODEL, trial=trial))
        self.settle()

    def tick(self, number: int, **options: Any) -> None:
        self.tissue.put(tissue(number, **options))
        self.robot.put(robot(number))
        self.settle()


def asking(min_tick: int, *expected: str, **options: Any) -> ContextRequest:
    fields: dict[str, Any] = {"trial": "t", "request_id": "c1", **options}
    return ContextRequest(min_tick=min_tick, expected=list(expected), **fields)


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def test_join_waits_for_both_and_keeps_the_order() -> None:
    join = TickJoin()
    join.add(tissue(1))
    join.add(robot(1))
    assert join.take() is None
    join.add(robot(0))
    assert join.take() is None
    join.add(tissue(0))
    taken = [join.take(), join.take()]
    assert [moment.tissue.tick for moment in taken if moment] == [0, 1]
    join.add(tissue(0))
    join.add(robot(0))
    assert join.take() is None


def test_join_hands_out_what_was_said_first() -> None:
    join = TickJoin()
    join.add(robot(0, jaw_deg=60.0))
    join.add(robot(0, jaw_deg=10.0))
    join.add(tissue(0, force_n=0.1))
    join.add(tissue(0, force_n=0.2))
    moment = join.take()
    assert moment is not None
    assert (moment.robot, moment.tissue) == (robot(0, jaw_deg=60.0), tissue(0, force_n=0.1))


def test_join_tells_whose_state_is_missing() -> None:
    join = TickJoin()
    assert (join.missing, join.is_empty) == ("", True)
    join.add(robot(0))
    assert (join.missing, join.is_empty) == ("sim", False)
    join.add(tissue(0))
    assert join.missing == ""
    assert join.take() is not None
    assert (join.missing, join.is_empty) == ("", True)
    join.add(tissue(1))
    assert join.missing == "motion"
    gap = TickJoin()
    gap.add(robot(1))
    gap.add(tissue(1))
    assert gap.missing == "motion"
    gap.add(robot(0))
    assert gap.missing == "sim"


@pytest.mark.parametrize("first", ["tissue", "robot"])
def test_one_verdict_a_tick_whatever_comes_first(bench: Bench, first: str) -> None:
    bench.reset()
    if first == "tissue":
        bench.tissue.put(tissue(0))
        bench.settle()
        assert bench.verdicts == []
        bench.robot.put(robot(0))
    else:
        bench.robot.put(robot(0))
        bench.settle()
        assert bench.verdicts == []
        bench.tissue.put(tissue(0))
    bench.settle()
    assert [(verdict.tick, verdict.level) for verdict in bench.verdicts] == [(0, "ok")]
    assert bench.verdicts[0].grasped == {"psm1": 2}


def test_states_that_overtake_reset_and_model_are_judged_after_them(bench: Bench) -> None:
    bench.tick(0)
    assert bench.verdicts == []
    bench.reset()
    assert [verdict.tick for verdict in bench.verdicts] == [0]


def test_levels_reach_the_wire(bench: Bench) -> None:
    bench.reset()
    bench.tick(0)
    bench.tick(1, force_n=1.5)
    bench.tick(2, converged=False)
    assert [(v.level, v.ok) for v in bench.verdicts] == [
        ("ok", True),
        ("hard", False),
        ("invalid", False),
    ]
    assert bench.verdicts[1].hard_limit_n == 1.0


def test_context_is_answered_when_its_tick_is_there(bench: Bench) -> None:
    bench.reset()
    bench.tick(0)
    waiting = bench.ask(SA_CONTEXT, asking(1))
    assert waiting == []
    bench.tick(1)
    (context,) = waiting
    assert (context.tick, context.request_id) == (1, "c1")
    assert "above_roi(b(4,4))" in context.fluents
    assert len(context.names) == 49
    assert {"visible_roi", "force"} <= context.evidence.keys()


def test_context_of_a_trial_that_ended_is_a_typed_fault(bench: Bench) -> None:
    bench.reset()
    waiting = bench.ask(SA_CONTEXT, asking(9))
    bench.reset("t2")
    assert isinstance(waiting[0], RemoteFault)
    assert waiting[0].remote_kind == "NothingKnown"


def test_targets(bench: Bench) -> None:
    early = bench.ask(
        SA_TARGET, TargetRequest(trial="t", action="reach", arm="psm1", block="b(4,4)")
    )
    # A new process does not know yet which trial is under way.
    assert early == []
    bench.reset()
    assert isinstance(early[0], FrasError)
    bench.tick(0)
    (reach,) = bench.ask(
        SA_TARGET, TargetRequest(trial="t", action="reach", arm="psm1", block="b(4,4)")
    )
    assert reach.position_m == pytest.approx((0.05, 0.06, 0.005), abs=1e-6)
    (move,) = bench.ask(
        SA_TARGET, TargetRequest(trial="t", action="move", arm="psm1", block="b(4,4)")
    )
    assert move.position_m == pytest.approx((0.05, 0.06, 0.06), abs=1e-6)
    (pull,) = bench.ask(
        SA_TARGET, TargetRequest(trial="t", action="pull", arm="psm1", block="b(4,4)")
    )
    assert pull.position_m is None
    (unknown,) = bench.ask(
        SA_TARGET, TargetRequest(trial="t", action="reach", arm="psm1", block="b(9,9)")
    )
    assert unknown.remote_kind == "UnknownName"


def test_scene_that_cannot_be_watched_is_answered_not_waited_for(bench: Bench) -> None:
    far = SceneSection(roi_m=(0.05, 0.06, 0.0))
    bench.ask(SA_RESET, ResetRequest(trial="t", scenario=Scenario(scene=far)))
    waiting = bench.ask(SA_CONTEXT, asking(0))
    bench.model.put(msgspec.structs.replace(MODEL, roi_m=(0.9, 0.9, 0.9), trial="t"))
    bench.settle()
    later = bench.ask(SA_CONTEXT, asking(0, request_id="c2"))
    assert [answers[0].remote_kind for answers in (waiting, later)] == ["NoTissueNearRoi"] * 2
    assert bench.host.counts["refused"] == 1


def test_question_about_another_trial_is_refused(bench: Bench) -> None:
    bench.reset()
    bench.tick(0)
    (context,) = bench.ask(SA_CONTEXT, asking(0, trial="old"))
    asked = TargetRequest(trial="old", action="reach", arm="psm1", block="b(4,4)")
    (target,) = bench.ask(SA_TARGET, asked)
    assert context.remote_kind == target.remote_kind == "OtherTrial"


def test_robot_state_that_comes_again_is_answered_again_and_changes_nothing(bench: Bench) -> None:
    bench.reset()
    bench.tick(0)
    bench.tick(1, force_n=0.2)
    bench.robot.put(msgspec.structs.replace(robot(1), holds={"person": "look"}))
    bench.tissue.put(tissue(1, force_n=0.9))
    bench.robot.put(robot(0))
    bench.settle()
    first, again = bench.verdicts[1:]
    assert msgspec.structs.replace(again, seq=first.seq, stamp_ns=first.stamp_ns) == first
    assert again.seq == first.seq + 1
    bench.tick(2, force_n=0.3)
    assert [verdict.tick for verdict in bench.verdicts] == [0, 1, 1, 2]
    assert bench.verdicts[-1].force_rate_n_s == pytest.approx(0.5 * (0.1 / 0.02 + 5.0))


def states_over(bench: Bench, seconds: float) -> list[str]:
    """State of the service now and that much later."""
    found = [bench.host.state]
    bench.now_s += seconds
    bench.settle()
    return [*found, bench.host.state]


@pytest.mark.parametrize("missing", ["sim", "motion"])
def test_health_says_whose_state_the_verdict_waits_for(bench: Bench, missing: str) -> None:
    bench.reset()
    bench.tick(0)
    assert "waiting" not in bench.host.state
    if missing == "sim":
        bench.robot.put(robot(1))
    else:
        bench.tissue.put(tissue(1))
    bench.settle()
    early, late = states_over(bench, 0.6)
    assert ("waiting" in early, late) == (False, f"waiting: {missing}")
    assert [verdict.tick for verdict in bench.verdicts] == [0]
    bench.tick(1)
    assert "waiting" not in bench.host.state
    assert "waiting" not in states_over(bench, 60.0)[1]


def test_health_says_that_the_model_is_missing(bench: Bench) -> None:
    scene = SceneSection(roi_m=(0.05, 0.06, 0.0))
    bench.ask(SA_RESET, ResetRequest(trial="t", scenario=Scenario(scene=scene)))
    assert "waiting" not in states_over(bench, 60.0)[1]
    bench.tick(0)
    assert states_over(bench, 0.6)[1] == "waiting: sim"
    bench.model.put(msgspec.structs.replace(MODEL, trial="t"))
    bench.settle()
    assert "waiting" not in bench.host.state
    assert [verdict.tick for verdict in bench.verdicts] == [0]


def test_question_about_a_tick_to_come_waits_for_motion(bench: Bench) -> None:
    bench.reset()
    bench.tick(0)
    bench.ask(SA_CONTEXT, asking(1))
    assert states_over(bench, 0.6)[1] == "waiting: motion"


def test_moments_of_waiting_one_after_the_other_are_not_added_up(bench: Bench) -> None:
    bench.reset()
    for tick in range(4):
        bench.robot.put(robot(tick))
        bench.settle()
        bench.now_s += 0.3
        bench.settle()
        assert "waiting" not in bench.host.state
        bench.tissue.put(tissue(tick))
        bench.settle()


def test_context_says_what_became_of_the_expectations(bench: Bench) -> None:
    bench.reset()
    bench.tick(0)
    (context,) = bench.ask(SA_CONTEXT, asking(0, "at(psm1,b(4,4))", "-closed_gripper(psm2)"))
    there, opened = context.monitored
    assert (there.atom, there.holds) == ("at(psm1,b(4,4))", False)
    assert there.evidence["distance_m"] == pytest.approx(np.hypot(0.03, 0.055), abs=1e-6)
    assert (opened.atom, opened.holds) == ("-closed_gripper(psm2)", True)
    assert opened.evidence == pytest.approx({"jaw_rad": np.radians(60), "closed_jaw_rad": 0.349066})
    (unknown,) = bench.ask(SA_CONTEXT, asking(0, "at(psm1,b(9,9))"))
    assert unknown.remote_kind == "UnknownAtom"
    assert "'at(psm1,b(9,9))'" in str(unknown)


def test_state_that_nobody_can_have_come_to_is_refused_and_not_kept(bench: Bench) -> None:
    faults: list[FaultRecord] = bench.heard(FAULT.of(service="sa"))
    bench.reset()
    bench.tick(0)
    for tick in (1_001, 10**15):
        bench.robot.put(robot(tick))
    bench.robot.put(robot(1_000))
    bench.settle()
    assert [(fault.kind, fault.tick) for fault in faults] == [
        ("TooFarAhead", 1_001),
        ("TooFarAhead", 10**15),
    ]
    bench.tick(1)
    assert bench.verdicts[-1].tick == 1


def test_questions_about_ticks_that_never_come_do_not_pile_up(bench: Bench) -> None:
    bench.reset()
    bench.tick(0)
    answers = [bench.ask(SA_CONTEXT, asking(10**15)) for _ in range(120)]
    refused = [one[0] for one in answers if one]
    assert len(refused) == 20
    assert all("TooManyQuestions" in str(one) for one in refused)
    assert bench.answer(SA_CONTEXT, asking(0)).tick == 0
