"""Requests that fit their type and ask for too much: refused by name by whoever serves them."""

from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import msgspec
import pytest

from fras_common.bus import MemoryBus, MemoryFabric, RemoteFault
from fras_common.codec import MalformedMessage, decode, encode
from fras_common.messages import ResetRequest, TaskRequest
from fras_common.scenario import Scenario, resolve
from fras_common.service import ServiceHost
from fras_common.topics import MOTION_RESET, SA_RESET, SIM_RESET, TASK
from fras_motion.service import MotionService
from fras_planner.service import PlannerService
from fras_sa.service import AwarenessService
from fras_sim.service import SimService

RESOLVED = resolve(Scenario())
SHELLS: dict[str, Any] = {
    "sim": SimService,
    "sa": AwarenessService,
    "motion": MotionService,
    "planner": PlannerService,
}


def scenario(section: str, **fields: Any) -> Scenario:
    changed = msgspec.structs.replace(getattr(RESOLVED, section), **fields)
    return msgspec.structs.replace(RESOLVED, **{section: changed})


@contextmanager
def asked(name: str, query: Any, request: Any) -> Generator[list[Any]]:
    fabric = MemoryFabric()
    host, client = ServiceHost(name), MemoryBus(fabric, "cell", "rogue/1")
    host.attach(MemoryBus(fabric, "cell", f"{name}/1", on_malformed=host.count_malformed))
    service = SHELLS[name](host)
    answers: list[Any] = []
    client.ask(query, request, answers.append, 30.0)
    while host.drain(0.0):
        pass
    yield answers
    service.close()
    host.bus.close()
    client.close()


@pytest.mark.parametrize("query", [SIM_RESET, SA_RESET, MOTION_RESET], ids=lambda one: one.key)
@pytest.mark.parametrize(
    "asked_for",
    [
        scenario("tissue", node_counts=(200, 200, 200)),
        scenario("tissue", size_m=(1.0, 1.0, 1.0)),
        scenario("motion", free_speed_m_s=0.5),
        scenario("awareness", hard_limit_n=1e-9),
    ],
    ids=["nodes", "size", "speed", "limit"],
)
def test_a_scenario_that_no_file_may_hold_begins_no_trial(query: Any, asked_for: Scenario) -> None:
    request = ResetRequest(trial="t", scenario=asked_for)
    with asked(query.server, query, request) as (answer,):
        assert isinstance(answer, RemoteFault)
        assert answer.remote_kind == "ScenarioError"


def test_the_planner_refuses_it_before_anything_begins() -> None:
    request = TaskRequest(
        command="start", trial="t", scenario=scenario("tissue", node_counts=(200, 200, 200))
    )
    with asked("planner", TASK, request) as (answer,):
        assert isinstance(answer, RemoteFault)
        assert answer.remote_kind == "ScenarioError"


@pytest.mark.parametrize("trial", ["x" * 201, "a\nb", "a\0", "\x1b[2J", "\x7f"], ids=repr)
@pytest.mark.parametrize("kind", [TaskRequest, ResetRequest])
def test_a_trial_has_a_name_that_can_be_shown(kind: type[Any], trial: str) -> None:
    fields: dict[str, Any] = {"command": "start"} if kind is TaskRequest else {}
    request = kind(trial=trial, scenario=RESOLVED, **fields)
    with pytest.raises(MalformedMessage):
        decode(kind, encode(request), "planner/task")


def test_lists_of_a_scenario_have_an_end() -> None:
    scene, box = RESOLVED.scene, {"lower_m": [0.0] * 3, "upper_m": [0.1] * 3}
    assert scene is not None
    many = {"roi_m": scene.roi_m, "discs": [{"center_m": [0.0, 0.0], "radius_m": 0.01}] * 1001}
    for changed in (
        {"scene": many},
        {"motion": {"forbidden_boxes": [box] * 101}},
        {"name": "x" * 201},
        {"tissue": {"mesh_file": "x" * 1001}},
    ):
        request = {"trial": "t", "scenario": changed}
        with pytest.raises(MalformedMessage):
            decode(ResetRequest, encode(request), "sim/reset")
