"""A patient besides its model: where the tissue is comes from the one, its force from the other."""

from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import pytest

from fras_common.bus import MemoryFabric
from fras_common.messages import (
    Array,
    ContextRequest,
    ResetRequest,
    TargetRequest,
    TissueState,
    Verdict,
)
from fras_common.scenario import PatientSection, Scenario, SceneSection
from fras_common.topics import (
    PATIENT,
    ROBOT_STATE,
    SA_CONTEXT,
    SA_RESET,
    SA_TARGET,
    TISSUE_MODEL,
    TISSUE_STATE,
    VERDICT,
)
from fras_sa.awareness import TissueView, TwoTicks, believed_where_seen
from fras_sa.errors import LostMoment
from fras_sa.join import TickJoin
from fras_sa.service import AwarenessService
from fras_sa.trial import WatchedTrial
from support.remembering import Remembering
from support.robots import robot
from support.shells import ShellBench
from support.tissues import CORNERS, MODEL, tissue

SCENARIO = Scenario(scene=SceneSection(roi_m=(0.05, 0.06, 0.0)))
TWINNED = msgspec.structs.replace(SCENARIO, patient=PatientSection(young_modulus_factor=1.3))
LIFTED = CORNERS + np.array([0.0, 0.0, 0.03])


def seen(tick: int, force_n: float = 0.0, **options: Any) -> TissueState:
    """The patient: lifted clear of the region of interest, with a grasp of one node."""
    state = tissue(tick, force_n, **options)
    return msgspec.structs.replace(
        state, nodes_m=Array.of(LIFTED, "<f4"), grasped={"psm1": [1]}, max_node_speed_m_s=0.25
    )


class Bench(ShellBench):
    """Situation awareness, and a client that plays everybody else."""

    def __init__(self, fabric: MemoryFabric | None = None, instance: str = "test") -> None:
        self.now_s = 0.0
        self._publishers: dict[str, Any] = {}
        super().__init__(
            "sa",
            lambda host: AwarenessService(host, lambda: self.now_s),
            client=f"cli/{instance}",
            fabric=fabric,
            instance=instance,
        )
        self.host.announce_alive()
        self.verdicts: list[Verdict] = self.heard(VERDICT)
        self.settle()

    def reset(self, scenario: Scenario = TWINNED) -> None:
        self.ask(SA_RESET, ResetRequest(trial="t", scenario=scenario))
        self.peers(TISSUE_MODEL).put(msgspec.structs.replace(MODEL, trial="t"))
        self.settle()

    def put(self, *said: tuple[Any, Any]) -> None:
        for topic, message in said:
            if topic.key not in self._publishers:
                self._publishers[topic.key] = self.peers(topic)
            self._publishers[topic.key].put(message)
        self.settle()

    def tick(self, tick: int, force_n: float = 0.1, patient_n: float = 0.0) -> None:
        self.put(
            (ROBOT_STATE, robot(tick)),
            (TISSUE_STATE, tissue(tick, force_n)),
            (PATIENT.state, seen(tick, patient_n)),
        )


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def view(tick: int, nodes_m: Any, force_n: float, **options: Any) -> TissueView:
    fields: dict[str, Any] = {"converged": True, "tool_force_n": {}, **options}
    return TissueView(tick=tick, nodes_m=nodes_m, max_force_n=force_n, **fields)


def test_positions_and_speed_are_the_patients_and_forces_the_models() -> None:
    believed = view(3, CORNERS, 0.4, tool_force_n={"psm1": np.ones(3)}, max_node_speed_m_s=1.0)
    patient = view(3, LIFTED, 0.9, max_node_speed_m_s=0.25)
    both = believed_where_seen(believed, patient)
    assert both.nodes_m is LIFTED
    assert (both.tick, both.max_force_n, both.max_node_speed_m_s) == (3, 0.4, 0.25)
    assert both.tool_force_n is believed.tool_force_n
    for bad in (view(3, CORNERS, 0.4, converged=False), view(3, LIFTED, 0.4, converged=False)):
        assert not believed_where_seen(bad, patient).converged
        assert not believed_where_seen(believed, bad).converged


def test_a_force_of_one_tick_is_not_put_to_positions_of_another() -> None:
    with pytest.raises(TwoTicks, match=r"tick 3.*tick 4"):
        believed_where_seen(view(3, CORNERS, 0.4), view(4, LIFTED, 0.4))


def test_a_tick_is_whole_with_the_patients_state_and_no_earlier() -> None:
    join = TickJoin(has_patient=True)
    join.add(robot(0))
    assert join.missing == "sim"
    join.add(tissue(0))
    assert (join.missing, join.take()) == ("patient", None)
    join.add_seen(seen(0))
    assert join.missing == ""
    moment = join.take()
    assert moment is not None
    assert moment.seen == seen(0)
    assert moment.tissue == tissue(0)
    assert join.is_empty


def test_without_a_patient_its_states_are_not_waited_for_nor_kept() -> None:
    join = TickJoin()
    join.add_seen(seen(0))
    assert join.is_empty
    join.add(robot(0))
    join.add(tissue(0))
    moment = join.take()
    assert moment is not None
    assert moment.seen is moment.tissue


def test_verdict_context_and_target_see_the_patient_and_believe_the_model(bench: Bench) -> None:
    bench.reset()
    bench.tick(0, force_n=0.1, patient_n=5.0)
    (verdict,) = bench.verdicts
    assert (verdict.max_force_n, verdict.level) == (0.1, "ok")
    assert (verdict.visibility, verdict.visible) == (1.0, True)
    assert (verdict.grasped, verdict.max_node_speed_m_s) == ({"psm1": 1}, 0.25)
    asked = ContextRequest(
        trial="t", request_id="c1", min_tick=0, expected=["visible_roi", "at(psm1,b(4,4))"]
    )
    (context,) = bench.ask(SA_CONTEXT, asked)
    assert context.evidence["force"]["force_n"] == 0.1
    visible, at = context.monitored
    assert visible.holds
    assert at.evidence["distance_m"] == pytest.approx(np.hypot(0.03, 0.025), abs=1e-6)
    (target,) = bench.ask(
        SA_TARGET, TargetRequest(trial="t", action="reach", arm="psm1", block="b(4,4)")
    )
    assert target.position_m == pytest.approx((0.05, 0.06, 0.035), abs=1e-6)


def test_a_patient_whose_solver_failed_makes_the_tick_invalid(bench: Bench) -> None:
    bench.reset()
    bench.put(
        (ROBOT_STATE, robot(0)),
        (TISSUE_STATE, tissue(0)),
        (PATIENT.state, seen(0, converged=False)),
    )
    assert [(one.level, one.reason) for one in bench.verdicts] == [("invalid", "solver")]


def test_the_patient_is_waited_for_and_said_by_name(bench: Bench) -> None:
    bench.reset()
    bench.tick(0)
    bench.put((ROBOT_STATE, robot(1)), (TISSUE_STATE, tissue(1)))
    bench.now_s += 0.6
    bench.settle()
    assert bench.host.state == "waiting: patient"
    assert len(bench.verdicts) == 1
    bench.put((PATIENT.state, seen(1)))
    assert "waiting" not in bench.host.state
    assert [one.tick for one in bench.verdicts] == [0, 1]


def test_a_trial_without_a_patient_does_not_hear_one(bench: Bench) -> None:
    bench.reset(SCENARIO)
    bench.tick(0)
    (verdict,) = bench.verdicts
    assert (verdict.visibility, verdict.grasped) == (0.0, {"psm1": 2})


def test_killed_it_goes_on_with_both() -> None:
    fabric = MemoryFabric()
    recorder = Remembering(fabric)
    first = Bench(fabric)
    recorder.say_status("t", "resetting")
    first.reset()
    for tick in range(3):
        first.tick(tick, force_n=0.1 * tick)
    first.kill()
    second = Bench(fabric, "second")
    assert second.host.gate.trial == "t"
    second.put((ROBOT_STATE, robot(3)), (TISSUE_STATE, tissue(3, 0.3)), (PATIENT.state, seen(3)))
    told = second.verdicts[-1]
    assert (told.tick, told.max_force_n, told.visibility) == (3, 0.3, 1.0)
    assert told.force_rate_n_s > 0.0
    second.close()
    recorder.close()


def test_without_the_patients_state_of_its_last_verdict_it_does_not_go_on() -> None:
    watched = WatchedTrial(TWINNED)
    watched.see_model(MODEL)
    for state in (robot(0), tissue(0)):
        watched.see_state(state)
    watched.see_patient(seen(0))
    verdict = watched.judge_next()
    assert verdict is not None
    again = WatchedTrial(TWINNED)
    again.see_model(MODEL)
    with pytest.raises(LostMoment):
        again.resume(verdict, [tissue(0)], [robot(0)])
    assert again.resume(verdict, [tissue(0)], [robot(0)], [seen(0)]) == [verdict]
