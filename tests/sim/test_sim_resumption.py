"""A simulator that was killed comes back at its last tick and goes on to the last bit."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import pytest

from fras_common.bus import MemoryFabric
from fras_common.messages import (
    FaultRecord,
    Header,
    ResetReply,
    ResetRequest,
    RobotState,
    SimCheckpoint,
    TissueModel,
    TissueState,
)
from fras_common.scenario import Disc, Scenario, SceneSection, TissueSection
from fras_common.topics import (
    FAULT,
    ROBOT_STATE,
    SIM_CHECKPOINT,
    SIM_RESET,
    TISSUE_MODEL,
    TISSUE_STATE,
)
from fras_sim.service import SimService
from fras_sim.trial import TissueTrial
from support.remembering import Remembering
from support.robots import robot
from support.shells import ShellBench

SCENE = SceneSection(roi_m=(0.05, 0.06, 0.0), discs=(Disc(center_m=(0.02, 0.09), radius_m=0.02),))
SCENARIO = Scenario(tissue=TissueSection(node_counts=(6, 7, 2)), scene=SCENE)
CORNER = (0.1, 0.12, 0.005)


def pulling(tick: int) -> RobotState:
    """Grasp the tissue's corner, lift it, let go and wait."""
    height_m = CORNER[2] + 0.001 * min(max(0, tick - 2), 18)
    return robot(tick, (*CORNER[:2], height_m), -20.0 if 2 <= tick < 22 else 60.0)


ROBOTS = [pulling(tick) for tick in range(36)]


def new_trial() -> TissueTrial:
    return TissueTrial("t", SCENARIO, b"", time.perf_counter)


class Run:
    """A trial that nothing happened to."""

    def __init__(self) -> None:
        self.states: list[TissueState] = []
        self.checkpoints: list[SimCheckpoint] = []
        trial = new_trial()
        for state in ROBOTS:
            step = trial.follow(state)
            assert step is not None
            assert step.state is not None
            self.states.append(step.state)
            self.checkpoints += [step.checkpoint] if step.checkpoint is not None else []


@pytest.fixture(scope="module")
def undisturbed() -> Run:
    return Run()


def content(state: Any) -> Any:
    """All of a state but who said it when, and how long it took to solve."""
    assert isinstance(state, TissueState)
    solver = msgspec.structs.replace(state.solver, wall_s=0.0)
    return msgspec.structs.replace(state, solver=solver, stamp_ns=0, seq=0, source="")


@pytest.mark.parametrize("answered", [True, False])
@pytest.mark.parametrize("tick", [0, 1, 2, 9, 10, 11, 20, 21, 22, 25, 30])
def test_wherever_it_was_killed_the_rest_comes_out_the_same(
    undisturbed: Run, tick: int, answered: bool
) -> None:
    known = undisturbed.states[: tick + answered]
    since = max(0, tick - 20)
    kept = [one for one in undisturbed.checkpoints if since <= one.tick < tick + answered]
    trial = new_trial()
    steps = trial.resume(kept, known[since:], ROBOTS[since : tick + 1])
    assert [content(step.state) for step in steps] == [content(undisturbed.states[tick])]
    assert trial.tick == tick
    for state in ROBOTS[tick + 1 :]:
        step = trial.follow(state)
        assert step is not None
        assert content(step.state) == content(undisturbed.states[state.tick])
        if step.checkpoint is not None:
            assert step.checkpoint in undisturbed.checkpoints


def test_what_nobody_heard_is_said(undisturbed: Run) -> None:
    trial = new_trial()
    steps = trial.resume(undisturbed.checkpoints[:1], undisturbed.states[10:12], ROBOTS[10:16])
    assert [step.state.tick for step in steps if step.state is not None] == [12, 13, 14, 15]


def test_an_answered_tick_gets_that_answer_again(undisturbed: Run) -> None:
    said = msgspec.structs.replace(undisturbed.states[12], max_force_n=0.125)
    trial = new_trial()
    (step,) = trial.resume(
        undisturbed.checkpoints[:1], [*undisturbed.states[10:12], said], ROBOTS[10:13]
    )
    assert step.state == said


def test_without_a_checkpoint_and_without_all_ticks_nothing_is_guessed(undisturbed: Run) -> None:
    trial = new_trial()
    assert trial.resume([], undisturbed.states[3:6], ROBOTS[3:6]) == []
    assert trial.tick == -1


class Theatre:
    """A fabric, what remembers, and simulators that come and go."""

    def __init__(self) -> None:
        self.fabric = MemoryFabric()
        self.recorder = Remembering(self.fabric)
        self.bench = self.new()
        self.robot = self.bench.client.publisher(ROBOT_STATE)

    def new(self) -> ShellBench:
        bench = ShellBench("sim", SimService, "motion/test", self.fabric)
        bench.host.announce_alive()
        bench.settle()
        return bench

    def restart(self) -> None:
        self.bench.kill()
        self.bench = self.new()

    def put(self, state: RobotState) -> None:
        self.robot.put(state)
        self.bench.settle()

    def heard(self, topic: Any) -> list[Any]:
        return self.bench.heard(topic)


@pytest.fixture
def theatre() -> Iterator[Theatre]:
    made = Theatre()
    yield made
    made.bench.close()


def reset(theatre: Theatre, trial: str = "t") -> None:
    theatre.recorder.say_status(trial, "resetting")
    request = ResetRequest(trial=trial, scenario=SCENARIO)
    assert isinstance(theatre.bench.answer(SIM_RESET, request), ResetReply)


def test_a_new_process_takes_the_trial_up_and_says_nothing_that_was_said(
    theatre: Theatre, undisturbed: Run
) -> None:
    reset(theatre)
    states: list[TissueState] = theatre.heard(TISSUE_STATE)
    checkpoints: list[SimCheckpoint] = theatre.heard(SIM_CHECKPOINT)
    for state in ROBOTS[:14]:
        theatre.put(state)
    models: list[TissueModel] = theatre.heard(TISSUE_MODEL)
    theatre.bench.kill()
    theatre.robot.put(ROBOTS[14])  # said while nobody listened
    theatre.restart()
    assert theatre.bench.host.gate.trial == "t"
    assert theatre.bench.host.tick == 14
    assert len(models) == 2
    theatre.restart()
    for state in ROBOTS[14:]:
        theatre.put(state)
    ticks = [state.tick for state in states]
    # Tick 14 by both restarts and the robot that said it again.
    assert ticks == [*range(15), 14, 14, *range(15, len(ROBOTS))]
    for state in states:
        assert content(state) == content(undisturbed.states[state.tick])
    assert [checkpoint.tick for checkpoint in checkpoints] == [10, 20, 30]
    assert theatre.bench.host.counts["gaps"] == 0


@pytest.mark.parametrize("phase", ["idle", "ended"])
def test_a_trial_that_is_over_is_not_taken_up(theatre: Theatre, phase: Any) -> None:
    reset(theatre)
    theatre.put(ROBOTS[0])
    theatre.recorder.say_status("t", phase)
    theatre.restart()
    assert theatre.bench.host.gate.trial == ""


def test_a_trial_that_it_was_not_in_yet_is_not_taken_up(theatre: Theatre) -> None:
    reset(theatre)
    theatre.put(ROBOTS[0])
    theatre.recorder.say_status("t2", "resetting")
    theatre.restart()
    assert theatre.bench.host.gate.trial == ""
    reset(theatre, "t2")
    assert theatre.bench.host.gate.trial == "t2"


def test_it_is_not_ready_before_it_knows(theatre: Theatre) -> None:
    tokens: list[str] = []
    theatre.bench.client.announce("alive/motion")
    theatre.bench.kill()
    theatre.bench.client.watch_tokens(lambda token, present: tokens.append(token))
    tokens.clear()
    bench = ShellBench("sim", SimService, "motion/test", theatre.fabric)
    bench.host.announce_alive()
    assert "ready/sim/test" not in tokens
    bench.settle()
    assert "ready/sim/test" in tokens
    bench.close()


def test_a_reset_that_is_asked_again_changes_nothing_at_rest(theatre: Theatre) -> None:
    reset(theatre)
    theatre.put(ROBOTS[0])
    reset(theatre)
    theatre.put(ROBOTS[1])
    assert theatre.bench.host.tick == 1
    reset(theatre)
    assert theatre.bench.host.tick == -1


@pytest.mark.parametrize(
    "other",
    [
        lambda: robot(3, (0.1, 0.12, 0.0061), -20.0),
        lambda: robot(3, (0.1, 0.12, 0.006), -19.0),
    ],
)
def test_a_tick_said_again_with_the_arms_elsewhere_is_refused(
    theatre: Theatre, other: Callable[[], Header]
) -> None:
    faults: list[FaultRecord] = theatre.heard(FAULT)
    reset(theatre)
    for state in ROBOTS[:4]:
        theatre.put(state)
    states: list[TissueState] = theatre.heard(TISSUE_STATE)
    theatre.put(other())  # type: ignore[arg-type]
    assert states == []
    assert [fault.kind for fault in faults] == ["ContradictoryTick"]
    theatre.put(ROBOTS[3])
    assert [state.tick for state in states] == [3]
