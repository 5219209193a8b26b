"""The replay's shell on a bus in memory, its clock in the test's hand."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from fras_common.bus import MemoryBus, MemoryFabric, RawSample, RemoteFault
from fras_common.codec import decode
from fras_common.messages import (
    LastReply,
    Plan,
    ReplayControl,
    ReplayStatus,
    ReplayStatusRequest,
    RpcRecord,
)
from fras_common.service.health import ProcessMeter
from fras_common.topics import PLAN, RECORDER_LAST, REPLAY_CONTROL, REPLAY_STATUS, RPC
from fras_replay import LiveCell, Player, ReplayHost, ReplayService, Selection, Settings
from fras_replay.recording import read_recording
from fras_replay.service import LINGER_NS
from support.recordings import short_trial, write_log

MS = 1_000_000
CELL = "theatre"
WAIT_S = 5.0


class Theatre:
    """A replay that runs when the test says so, and someone who watches and directs it."""

    def __init__(self, path: Path, fabric: MemoryFabric, **how: Any) -> None:
        self.now_ns = 10**9
        self.fabric = fabric
        self.recording = read_recording(path, how.pop("selection", Selection()))
        timeline = self.recording.timeline
        begin, end = how.pop("begin", timeline.begin), how.pop("end", timeline.end)
        stay = how.pop("stay", True)
        player = Player(timeline, begin, end, index=begin.before, at_ns=begin.at_ns, **how)
        self.host = ReplayHost()
        self.bus = MemoryBus(fabric, CELL, "replay/1")
        self.client = MemoryBus(fabric, CELL, "cli/1")
        self.heard: list[RawSample] = []
        self.client.subscribe_raw("**", self.heard.append)
        self.host.attach(self.bus)
        try:
            self.service = ReplayService(
                self.host, self.recording, player, Settings(CELL, "1", stay), self.clock
            )
        except BaseException:
            self.leave()
            raise
        self.host.announce_alive()

    def clock(self) -> int:
        return self.now_ns

    def settle(self) -> float | None:
        """Do what is due now, and answer everybody."""
        wait = self.service.wake()
        while wait == 0.0 or self.host.drain(0.0):
            wait = self.service.wake()
        return wait

    def later(self, ms: int) -> float | None:
        """Let time go by, looking every millisecond."""
        wait = self.settle()
        for _ in range(ms):
            self.now_ns += MS
            wait = self.settle()
        return wait

    def tell(self, command: Any, value: float = 0.0) -> ReplayStatus:
        return self.ask(REPLAY_CONTROL, ReplayControl(command=command, value=value))

    def status(self, marks: bool = False) -> ReplayStatus:
        return self.ask(REPLAY_STATUS, ReplayStatusRequest(marks=marks))

    def ask(self, query: Any, request: Any) -> Any:
        answers: list[Any] = []
        self.client.ask(query, request, answers.append, WAIT_S)
        while self.host.drain(0.0):
            pass
        (answer,) = answers
        if isinstance(answer, Exception):
            raise answer
        return answer

    def played(self) -> list[tuple[str, bytes]]:
        """What was heard of the log since the last call."""
        mine = [(s.key, s.payload) for s in self.heard if "replay" not in s.key]
        self.heard.clear()
        return mine

    def leave(self) -> None:
        self.bus.close()
        self.client.close()
        self.recording.close()


@pytest.fixture
def stage(tmp_path: Path) -> Iterator[Callable[..., Theatre]]:
    """Begin a replay of the short trial."""
    path = write_log(tmp_path / "audit.mcap", short_trial())
    open_ones: list[Theatre] = []

    def begin(fabric: MemoryFabric | None = None, **how: Any) -> Theatre:
        open_ones.append(Theatre(path, fabric or MemoryFabric(), **how))
        return open_ones[-1]

    yield begin
    for one in open_ones:
        one.leave()


def pairs(first: int = 0, stop: int | None = None) -> list[tuple[str, bytes]]:
    return [(one.key, one.payload) for one in short_trial()][first:stop]


def test_all_of_it_goes_out_verbatim_when_it_is_due(stage: Callable[..., Theatre]):
    theatre = stage()
    assert theatre.later(0) == pytest.approx(0.0009, abs=2e-4)
    assert theatre.played() == pairs(0, 1)
    theatre.later(9)
    assert theatre.played() == pairs(1, 2)
    theatre.later(200)
    assert theatre.played() == pairs(2)
    assert theatre.status().phase == "ended"
    assert theatre.service.lateness.percentile_ms(100) == 0.0


def test_twice_as_fast_in_half_the_time(stage: Callable[..., Theatre]):
    theatre = stage(rate=2.0)
    theatre.later(50)
    half = theatre.status()
    assert half.position_s == pytest.approx(0.1)
    assert theatre.played() == [
        (one.key, one.payload) for one in short_trial() if one.at_ns <= 100 * MS
    ]
    assert theatre.tell("rate", 0.5).position_s == pytest.approx(0.1)
    theatre.later(50)
    assert theatre.status().position_s == pytest.approx(0.125)


def test_as_fast_as_possible_needs_no_time(stage: Callable[..., Theatre]):
    theatre = stage(rate=0.0)
    theatre.settle()
    assert theatre.played() == pairs()


def test_questions_are_answered_between_two_bursts(stage: Callable[..., Theatre], monkeypatch: Any):
    monkeypatch.setattr("fras_replay.service.BURST", 4)
    theatre = stage(rate=0.0)
    assert theatre.service.wake() is not None
    status = theatre.tell("pause")
    assert (status.phase, status.messages) == ("paused", 4)
    theatre.settle()
    assert theatre.played() == pairs(0, 4)


def test_pause_and_play(stage: Callable[..., Theatre]):
    theatre = stage(state="paused")
    assert theatre.later(50) is None
    assert theatre.played() == []
    theatre.tell("play")
    theatre.later(30)
    paused = theatre.tell("pause")
    theatre.later(500)
    assert theatre.status() == paused
    assert paused.position_s == pytest.approx(0.03)
    theatre.tell("play")
    theatre.later(200)
    assert theatre.played() == pairs()


def test_a_step_is_everything_up_to_the_next_verdict(stage: Callable[..., Theatre]):
    theatre = stage(state="paused")
    assert theatre.tell("step").tick == 0
    assert theatre.played() == pairs(0, 4)
    assert theatre.tell("step").tick == 1
    assert theatre.played() == pairs(4, 6)
    back = theatre.tell("back")
    assert (back.tick, back.phase) == (0, "paused")
    # The same picture as before: the plan, the state and the verdict of tick 0.
    assert theatre.played() == pairs(1, 4)
    assert theatre.tell("step").tick == 1
    assert theatre.played() == pairs(4, 6)


def test_a_seek_shows_how_things_stood(stage: Callable[..., Theatre]):
    theatre = stage(state="paused")
    assert theatre.tell("seek_tick", 6).tick == 6
    keys = [key for key, _ in theatre.played()]
    assert keys == ["planner/plan", "robot/state", "sa/verdict"]
    theatre.tell("seek_s", 0.139)
    assert [key for key, _ in theatre.played()].count("motion/holds") == 0
    theatre.tell("seek_s", 0.1395)
    assert "motion/holds" in [key for key, _ in theatre.played()]


def test_a_late_viewer_is_told_nothing_of_the_future(stage: Callable[..., Theatre]):
    theatre = stage(rate=0.0)
    theatre.settle()
    for value, reasons in ((5, ["force"]), (2, ["initial"])):
        theatre.tell("seek_tick", value)
        late: list[Plan] = []
        theatre.client.subscribe(PLAN, late.append)
        assert [plan.reason for plan in late] == reasons
    theatre.tell("seek_s", 0.0)
    nobody: list[Plan] = []
    theatre.client.subscribe(PLAN, nobody.append)
    assert nobody == []
    theatre.tell("play")
    theatre.settle()
    assert [plan.reason for plan in nobody] == ["initial", "force"]


def test_marks_are_told_and_jumped_to(stage: Callable[..., Theatre]):
    theatre = stage(state="paused")
    told = theatre.status(marks=True)
    assert [mark.kind for mark in told.marks][:3] == ["plan", "action_start", "crossing"]
    assert theatre.status().marks == []
    assert (told.mark, told.duration_s, told.last_tick) == (-1, pytest.approx(0.198), 9)
    assert theatre.tell("next_mark").mark == 0
    assert theatre.tell("next_mark").mark == 1
    jumped = theatre.tell("seek_mark", 3)
    assert (jumped.mark, jumped.tick) == (3, 4)
    # What the mark tells of is the last that was shown.
    key, payload = theatre.played()[-1]
    assert decode(Plan, payload, key).reason == "force"
    assert theatre.tell("previous_mark").mark == 2
    for number in (6, -1):
        with pytest.raises(RemoteFault, match=r"no mark (-1|6): its marks are 0 to 5") as caught:
            theatre.tell("seek_mark", number)
        assert caught.value.remote_kind == "NoSuchMark"
    assert theatre.status().mark == 2


def test_while_it_plays_the_mark_before_is_not_the_one_just_passed(stage: Callable[..., Theatre]):
    theatre = stage()
    theatre.tell("seek_mark", 3)
    theatre.later(3)
    with pytest.raises(RemoteFault):
        theatre.tell("previous_mark")  # all of it is shorter than a second


def test_a_bad_rate_changes_nothing(stage: Callable[..., Theatre]):
    theatre = stage()
    with pytest.raises(RemoteFault, match=r"0\.1 to 100") as caught:
        theatre.tell("rate", 1000.0)
    assert caught.value.remote_kind == "BadRate"
    assert theatre.status().rate == 1.0


def test_a_loop_shows_the_start_again(stage: Callable[..., Theatre]):
    fabric = MemoryFabric()
    theatre = stage(fabric, loop=True)
    timeline = theatre.recording.timeline
    part = stage(
        MemoryFabric(), loop=True, begin=timeline.before_tick(5), end=timeline.after_tick(6)
    )
    theatre.later(198 + 60)
    assert theatre.played() == [*pairs(), *pairs(0, 8)]
    assert theatre.status().laps == 1
    part.later(28 + 1)
    assert part.status().laps == 1
    once = [("planner/plan", pairs()[12][1]), ("robot/state", pairs()[10][1])]
    once += [("sa/verdict", pairs()[11][1])]
    shown = sorted(once, key=pairs().index)
    assert part.played() == [*shown, *pairs(13, 17), *shown, *pairs(13, 14)]
    assert not part.tell("loop", 0).loop


def test_it_ends_by_itself_once_all_had_time_to_arrive(stage: Callable[..., Theatre]):
    theatre = stage(stay=False)
    theatre.later(198)
    wait = theatre.service.wake()
    assert wait == pytest.approx(LINGER_NS / 1e9)
    theatre.now_ns += LINGER_NS
    theatre.service.wake()
    theatre.host.run(theatre.service.wake)  # returns: it was told to stop
    assert theatre.played() == pairs()


def test_stop_is_answered_and_ends_it(stage: Callable[..., Theatre]):
    theatre = stage(state="paused")
    assert theatre.tell("stop").phase == "paused"
    theatre.host.run(theatre.service.wake)


def test_health_says_that_it_is_a_replay_and_queries_are_mirrored(stage: Callable[..., Theatre]):
    theatre = stage(state="paused", rate=2.0)
    theatre.tell("step")
    theatre.settle()
    health = theatre.host.health(ProcessMeter())
    assert health.state == "replay: paused 0.02 s of 0.20 s, tick 0 of 9, rate 2"
    assert (health.tick, health.trial) == (0, "t-1")
    assert health.facts["replay_of"].endswith("audit.mcap")
    assert health.published >= 4
    mirrors = [s for s in theatre.heard if s.key.startswith("rpc/replay/")]
    assert [decode(RpcRecord, s.payload, s.key).key for s in mirrors] == ["replay/control"]
    assert RPC.of(service="replay", name="control").key == mirrors[0].key


@pytest.mark.parametrize("token", ["alive/motion", "ready/sim", "alive/arms", "alive/replay"])
def test_a_live_cell_is_refused_and_hears_nothing(stage: Callable[..., Theatre], token: str):
    fabric = MemoryFabric()
    other = MemoryBus(fabric, CELL, f"{token.partition('/')[2]}/7f")
    other.announce(token)
    heard: list[RawSample] = []
    seen: list[tuple[str, bool]] = []
    other.subscribe_raw("**", heard.append)
    other.watch_tokens(lambda *change: seen.append(change))
    with pytest.raises(LiveCell, match=f"{token.partition('/')[2]}/7f") as caught:
        stage(fabric)
    assert caught.value.values["services"] == [f"{token.partition('/')[2]}/7f"]
    assert heard == []
    assert seen == [(f"{token}/7f", True)]


@pytest.mark.parametrize("token", ["alive/recorder", "ready/monitor"])
def test_who_only_listens_may_be_there(stage: Callable[..., Theatre], token: str):
    fabric = MemoryFabric()
    MemoryBus(fabric, CELL, f"{token.partition('/')[2]}/7f").announce(token)
    MemoryBus(fabric, "elsewhere", "motion/7f").announce("alive/motion")
    theatre = stage(fabric, rate=0.0)
    theatre.settle()
    assert theatre.played() == pairs()


def test_a_replay_that_comes_later_ends_none_that_runs(stage: Callable[..., Theatre]):
    theatre = stage(rate=0.0)
    MemoryBus(theatre.fabric, CELL, "replay/7f").announce("alive/replay")
    theatre.settle()
    assert theatre.service.intruder is None
    assert theatre.played() == pairs()


def recorder_in(fabric: MemoryFabric) -> list[Any]:
    """A recorder that is asked and does not answer yet."""
    asked: list[Any] = []
    recorder = MemoryBus(fabric, CELL, "recorder/7f")
    recorder.serve(RECORDER_LAST, asked.append)
    recorder.announce("alive/recorder")
    return asked


def test_a_fast_one_waits_for_the_recorder_and_still_answers(
    stage: Callable[..., Theatre], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("fras_replay.service.BURST", 4)
    monkeypatch.setattr("fras_replay.flow.WINDOW", 8)
    fabric = MemoryFabric()
    asked = recorder_in(fabric)
    theatre = stage(fabric, rate=0.0)
    while theatre.host.drain(0.0):
        pass
    for number in range(1, 4):
        assert theatre.settle() is None
        assert len(asked) == number
        assert theatre.status().messages == min(8 * number, len(short_trial()))
        asked[-1].reply(LastReply(payload=b""))
    theatre.settle()
    assert theatre.played() == pairs()


def test_at_its_own_rate_nobody_is_asked(
    stage: Callable[..., Theatre], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("fras_replay.flow.WINDOW", 8)
    monkeypatch.setattr("fras_replay.flow.QUICK_NS", 50 * MS)
    fabric = MemoryFabric()
    asked = recorder_in(fabric)
    theatre = stage(fabric)
    theatre.later(198)
    assert asked == []
    assert theatre.played() == pairs()


def test_before_it_leaves_it_waits_for_the_recorder(stage: Callable[..., Theatre]):
    fabric = MemoryFabric()
    asked = recorder_in(fabric)
    theatre = stage(fabric, rate=0.0, stay=False)
    while theatre.host.drain(0.0):
        pass
    assert theatre.settle() is None
    theatre.now_ns += 2 * LINGER_NS
    assert theatre.service.wake() is None
    asked[0].fail(LiveCell("any", ["other"]))
    theatre.host.run(theatre.service.wake)  # returns: an error is an answer, too


def test_a_service_that_comes_ends_it_before_the_next_message(stage: Callable[..., Theatre]):
    theatre = stage()
    theatre.later(20)
    theatre.played()
    MemoryBus(theatre.fabric, CELL, "motion/7f").announce("alive/motion")
    theatre.now_ns += 10**9
    theatre.host.run(theatre.service.wake)
    assert isinstance(theatre.service.intruder, LiveCell)
    assert "motion/7f" in str(theatre.service.intruder)
    assert len(theatre.played()) <= 64


def test_a_part_begins_with_how_things_stood(tmp_path: Path):
    path = write_log(tmp_path / "audit.mcap", short_trial())
    selection = Selection(exclude=["log/**"], remap=[("sa/verdict", "twin/verdict")])
    timeline = read_recording(path, selection).timeline
    theatre = Theatre(
        path,
        MemoryFabric(),
        rate=0.0,
        begin=timeline.before_tick(8),
        end=timeline.after_tick(8),
        selection=selection,
    )
    theatre.settle()
    assert [key for key, _ in theatre.played()] == [
        "planner/plan", "motion/holds", "robot/state", "twin/verdict", "robot/state",
        "twin/verdict",
    ]  # fmt: skip
    theatre.leave()
