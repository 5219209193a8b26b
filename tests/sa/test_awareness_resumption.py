"""Situation awareness that was killed comes back with what it remembered, to the last bit."""

from collections.abc import Iterator
from typing import Any

import msgspec
import pytest

from fras_common.bus import MemoryFabric
from fras_common.messages import (
    ActionState,
    ContextRequest,
    ResetRequest,
    RobotState,
    TargetRequest,
    TissueState,
    Verdict,
)
from fras_common.scenario import Scenario, SceneSection
from fras_common.topics import (
    ROBOT_STATE,
    SA_CONTEXT,
    SA_RESET,
    SA_TARGET,
    TISSUE_MODEL,
    TISSUE_STATE,
    VERDICT,
)
from fras_sa.errors import LostMoment
from fras_sa.service import AwarenessService
from fras_sa.trial import WatchedTrial
from support.remembering import Remembering
from support.robots import robot
from support.shells import ShellBench
from support.tissues import MODEL, tissue

SCENARIO = Scenario(scene=SceneSection(roi_m=(0.05, 0.06, 0.0)))
# A pull that crosses the limit and is interrupted, an invalid tick, a move that crosses the hard
# limit, and a release.
FORCES = [0.0, 0.1, 0.2, 0.3, 0.45, 0.56, 0.58, 0.4, 0.3, 0.6, 1.1, 0.9, 0.8, 0.3, 0.2, 0.1]
ACTIONS = [
    None,
    *[("pull", "lift")] * 5,
    ("pull", "retreat"),
    *[("pull", "interrupted")] * 2,
    *[("move", "carry")] * 2,
    *[("move", "retreat"), ("move", "interrupted")],
    *[("release", "open"), ("release", "settle"), ("release", "done")],
]


def robot_at(tick: int) -> RobotState:
    action = ACTIONS[tick]
    if action is None:
        return robot(tick, jaw_deg=-20.0)
    name, phase = action
    state = ActionState(goal_id="g1", name=name, arm="psm1", block="b(1,1)", phase=phase)
    return robot(tick, jaw_deg=-20.0, action=state)


def tissue_at(tick: int) -> TissueState:
    return tissue(tick, force_n=FORCES[tick], converged=tick != 8)


ROBOTS = [robot_at(tick) for tick in range(len(FORCES))]
TISSUES = [tissue_at(tick) for tick in range(len(FORCES))]


def watched() -> WatchedTrial:
    trial = WatchedTrial(SCENARIO)
    trial.see_model(MODEL)
    return trial


def judge_all(trial: WatchedTrial, first: int) -> list[Verdict]:
    said: list[Verdict] = []
    for state in (*TISSUES[first:], *ROBOTS[first:]):
        trial.see_state(state)
    while (verdict := trial.judge_next()) is not None:
        said.append(verdict)
    return said


def asking(tick: int) -> ContextRequest:
    return ContextRequest(trial="t", request_id="c1", min_tick=tick, expected=[])


def test_the_series_shows_what_has_to_be_remembered() -> None:
    said = judge_all(watched(), 0)
    assert {verdict.level for verdict in said} == {"ok", "soft", "hard", "invalid"}
    high = [tick for tick, verdict in enumerate(said) if verdict.max_height]
    assert high == [5, 6, 7, 8, 10, 11, 12]


@pytest.mark.parametrize("tick", range(len(FORCES)))
@pytest.mark.parametrize("ahead", [0, 1])
def test_wherever_it_was_killed_the_rest_comes_out_the_same(tick: int, ahead: int) -> None:
    undisturbed = judge_all(watched(), 0)
    end = min(len(FORCES), tick + 1 + ahead)
    trial = watched()
    said = trial.resume(undisturbed[tick], TISSUES[tick:end], ROBOTS[tick:end])
    assert said == undisturbed[tick:end]
    reference = watched()
    reference.resume(None, TISSUES[:end], ROBOTS[:end])
    assert trial.context(asking(end - 1)) == reference.context(asking(end - 1))
    assert judge_all(trial, end) == undisturbed[end:]


def test_before_the_first_verdict_it_begins_at_the_first_tick() -> None:
    undisturbed = judge_all(watched(), 0)
    assert watched().resume(None, TISSUES[:2], ROBOTS[:1]) == undisturbed[:1]


def test_a_tick_that_was_said_again_is_judged_by_what_was_said_first() -> None:
    undisturbed = judge_all(watched(), 0)
    again = msgspec.structs.replace(ROBOTS[9], action=None)
    trial = watched()
    trial.resume(undisturbed[9], TISSUES[9:10], [ROBOTS[9], again])
    assert judge_all(trial, 10) == undisturbed[10:]


@pytest.mark.parametrize("tissues", [TISSUES[6:], []])
def test_without_the_states_of_its_last_verdict_it_does_not_go_on(tissues: Any) -> None:
    undisturbed = judge_all(watched(), 0)
    with pytest.raises(LostMoment, match="tick 5"):
        watched().resume(undisturbed[5], tissues, ROBOTS[5:])


class Theatre:
    """A fabric, what remembers, and situation awareness that comes and goes."""

    def __init__(self) -> None:
        self.fabric = MemoryFabric()
        self.recorder = Remembering(self.fabric)
        self.bench = self.new()
        client = self.bench.client
        self.model = client.publisher(TISSUE_MODEL)
        self.tissue = client.publisher(TISSUE_STATE)
        self.robot = self.bench.peers(ROBOT_STATE)
        self.verdicts: list[Verdict] = self.bench.heard(VERDICT)

    def new(self) -> ShellBench:
        bench = ShellBench("sa", AwarenessService, "sim/test", self.fabric)
        bench.host.announce_alive()
        bench.settle()
        return bench

    def reset(self) -> None:
        self.recorder.say_status("t", "resetting")
        self.bench.answer(SA_RESET, ResetRequest(trial="t", scenario=SCENARIO))

    def tick(self, *ticks: int) -> None:
        for tick in ticks:
            self.tissue.put(TISSUES[tick])
            self.robot.put(ROBOTS[tick])
            self.bench.settle()


@pytest.fixture
def theatre() -> Iterator[Theatre]:
    made = Theatre()
    made.reset()
    made.model.put(msgspec.structs.replace(MODEL, trial="t"))
    made.bench.settle()
    yield made
    made.bench.close()


def test_a_new_process_takes_the_trial_up_and_judges_what_was_missed(theatre: Theatre) -> None:
    undisturbed = judge_all(watched(), 0)
    theatre.tick(*range(5))
    theatre.bench.kill()
    theatre.tissue.put(TISSUES[5])
    theatre.robot.put(ROBOTS[5])
    theatre.bench = theatre.new()
    assert theatre.bench.host.gate.trial == "t"
    assert theatre.bench.host.tick == 5
    (context,) = theatre.bench.ask(SA_CONTEXT, asking(5))
    assert context.tick == 5
    theatre.tick(*range(6, len(FORCES)))
    assert [one.tick for one in theatre.verdicts] == [*range(5), 4, *range(5, len(FORCES))]
    for one in theatre.verdicts:
        assert msgspec.structs.replace(one, stamp_ns=0, seq=0, source="") == undisturbed[one.tick]


def test_a_question_that_comes_before_it_knows_the_trial_waits(theatre: Theatre) -> None:
    theatre.tick(*range(3))
    theatre.bench.kill()
    theatre.recorder.silent = True
    theatre.bench = theatre.new()
    asked = TargetRequest(trial="t", action="reach", arm="psm1", block="b(1,1)")
    contexts = theatre.bench.ask(SA_CONTEXT, asking(2))
    targets = theatre.bench.ask(SA_TARGET, asked)
    assert contexts == targets == []
    theatre.recorder.speak()
    theatre.bench.settle()
    assert [one.tick for one in contexts] == [2]
    assert [one.position_m is not None for one in targets] == [True]


def test_and_is_refused_where_none_is_under_way(theatre: Theatre) -> None:
    theatre.bench.kill()
    theatre.recorder.say_status("t", "idle")
    theatre.recorder.silent = True
    theatre.bench = theatre.new()
    answers = theatre.bench.ask(SA_CONTEXT, asking(0))
    assert answers == []
    theatre.recorder.speak()
    theatre.bench.settle()
    assert [one.remote_kind for one in answers] == ["OtherTrial"]


def test_one_that_lost_its_moment_is_not_in_the_trial(theatre: Theatre) -> None:
    theatre.tick(*range(3))
    theatre.bench.kill()
    theatre.recorder.memory.note(ROBOT_STATE.key, msgspec.msgpack.encode(robot(0, trial="other")))
    theatre.bench = theatre.new()
    assert theatre.bench.host.gate.trial == ""


def test_a_reset_that_is_asked_again_changes_nothing_at_rest(theatre: Theatre) -> None:
    theatre.tick(0)
    theatre.reset()
    theatre.tick(1)
    assert [one.tick for one in theatre.verdicts] == [0, 1]
    theatre.reset()
    assert theatre.bench.host.tick == -1


def test_a_model_that_is_said_again_changes_nothing(theatre: Theatre) -> None:
    theatre.tick(0, 1)
    theatre.model.put(msgspec.structs.replace(MODEL, trial="t"))
    theatre.tick(2)
    assert [one.tick for one in theatre.verdicts] == [0, 1, 2]
