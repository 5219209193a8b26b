"""The simulator in the part of the patient: its own keys, the same tissue, taken up if killed."""

from typing import Any

import msgspec
import pytest

from fras_common.bus import MemoryFabric
from fras_common.messages import FaultRecord, ResetReply, ResetRequest, TissueState
from fras_common.scenario import Disc, Scenario, SceneSection, TissueSection
from fras_common.topics import FAULT, PATIENT, ROBOT_STATE, TWIN, TissueTopics
from fras_sim.service import SimService, patient_service
from support.remembering import Remembering
from support.robots import robot
from support.shells import ShellBench

SCENE = SceneSection(roi_m=(0.05, 0.06, 0.0), discs=(Disc(center_m=(0.02, 0.09), radius_m=0.02),))
REQUEST = ResetRequest(
    trial="t", scenario=Scenario(tissue=TissueSection(node_counts=(6, 7, 2)), scene=SCENE)
)
PARTS: dict[str, tuple[Any, TissueTopics]] = {
    "sim": (SimService, TWIN),
    "patient": (patient_service, PATIENT),
}


def pulled(tick: int) -> Any:
    return robot(tick, (0.1, 0.12, 0.005 + 0.001 * max(0, tick - 2)), -20.0 if tick > 1 else 60.0)


def content(state: TissueState) -> TissueState:
    solver = msgspec.structs.replace(state.solver, wall_s=0.0)
    return msgspec.structs.replace(state, solver=solver, stamp_ns=0, seq=0, source="")


def states_of(part: str, killed_at: int = -1) -> list[TissueState]:
    """What a simulator says of fifteen ticks, killed and started again behind one of them."""
    build, topics = PARTS[part]
    fabric = MemoryFabric()
    recorder = Remembering(fabric)
    bench = ShellBench(part, build, "motion/test", fabric)
    bench.settle()
    said: list[TissueState] = bench.heard(topics.state)
    arms = bench.client.publisher(ROBOT_STATE)
    recorder.say_status("t", "resetting")
    assert isinstance(bench.answer(topics.reset, REQUEST), ResetReply)
    for tick in range(15):
        arms.put(pulled(tick))
        bench.settle()
        if tick == killed_at:
            bench.kill()
            bench = ShellBench(part, build, "motion/other", fabric, instance="second")
            bench.host.announce_alive()
            bench.settle()
            assert bench.host.gate.trial == "t"
    bench.close()
    return said


def test_it_speaks_on_its_own_keys_and_computes_the_same() -> None:
    model, patient = states_of("sim"), states_of("patient")
    assert {one.source.partition("/")[0] for one in patient} == {"patient"}
    assert [content(one) for one in patient] == [content(one) for one in model]
    assert patient[-1].max_force_n > 0.0


@pytest.mark.parametrize("tick", [3, 12])
def test_killed_it_is_taken_up_as_sim_is(tick: int) -> None:
    reference, said = states_of("patient"), states_of("patient", killed_at=tick)
    assert [one.tick for one in said] == [*range(tick + 1), *range(tick, 15)]
    assert {one.source for one in said} == {"patient/test", "patient/second"}
    assert all(content(one) == content(reference[one.tick]) for one in said)


def test_a_trial_without_a_patient_is_nobodys_fault() -> None:
    bench = ShellBench("patient", patient_service, "motion/test")
    faults: list[FaultRecord] = bench.heard(FAULT.of(service="patient"))
    said: list[TissueState] = bench.heard(PATIENT.state)
    arms = bench.client.publisher(ROBOT_STATE)
    for tick in range(100):
        arms.put(pulled(tick))
    bench.settle()
    assert (said, faults) == ([], [])
    assert bench.host.gate.dropped == 36
    bench.close()
