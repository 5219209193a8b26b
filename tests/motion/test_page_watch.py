"""Motion holds while nobody who could stop it looks at the page; a person lifts that hold."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import pytest

from fras_common.bus import MemoryBus, RemoteFault
from fras_common.messages import (
    CancelRequest,
    ExecuteReply,
    HoldRequest,
    LastReply,
    Presence,
    ResetRequest,
    ResumeRequest,
    RobotState,
)
from fras_common.scenario import RunSection, Scenario, resolve
from fras_common.topics import (
    ACTION_RESULT,
    CANCEL,
    EXECUTE,
    HOLD,
    MOTION_RESET,
    PRESENCE,
    RECORDER_LAST,
    RESUME,
    ROBOT_STATE,
    VERDICT,
)
from fras_motion import page_watch
from fras_motion.page_watch import PRESENCE_TIMEOUT_S
from fras_motion.service import MotionService
from support.goals import reach_goal
from support.shells import ShellBench
from support.verdicts import verdict

PAGE = "monitor:page"
NOBODY = {PAGE: "nobody looks at a page"}


class Bench(ShellBench):
    """Motion with a clock in hand, and a client that plays the page."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.now_s = 100.0
        watch = partial(page_watch.PageWatch, clock=lambda: self.now_s)
        patch.setattr("fras_motion.tick_loop.PageWatch", watch)
        super().__init__("motion", MotionService, client="sa/test")
        self.client.serve(RECORDER_LAST, lambda call: call.reply(LastReply(payload=b"")))
        self.client.announce("alive/recorder")
        self.page = MemoryBus(self.fabric, "cell", "monitor/one")
        self.page.announce("alive/monitor")
        self.states: list[RobotState] = self.heard(ROBOT_STATE)
        self.results: list[Any] = self.heard(ACTION_RESULT)
        self._verdicts = self.client.publisher(VERDICT)
        self.settle()

    def begin(self, *, supervised: bool = True) -> None:
        run = RunSection(pace=0, supervised=supervised, require_log=False)
        scenario = resolve(Scenario(run=run))
        self.answer(MOTION_RESET, ResetRequest(trial="t", scenario=scenario))

    def look(self, viewers: int = 1, read_only: int = 0, page: MemoryBus | None = None) -> None:
        presence = Presence(viewers=viewers, read_only=read_only)
        (page or self.page).publisher(PRESENCE).put(presence)
        self.settle()

    def after(self, wait_s: float) -> None:
        self.now_s += wait_s
        self.settle()

    def reach(self) -> ExecuteReply:
        return self.answer(EXECUTE, reach_goal((0.02, 0.03, 0.005)))

    def tick(self) -> None:
        self._verdicts.put(verdict(self.states[-1].tick, "t", "ok"))
        self.settle()

    def tick_until_rest(self, most: int = 100) -> None:
        for _ in range(most):
            before = self.states[-1].tick
            self.tick()
            if self.states[-1].tick == before:
                return
        raise AssertionError("the arms do not come to rest")

    def held(self) -> dict[str, str]:
        self.settle()
        return self.service._holds.current()  # type: ignore[attr-defined]  # noqa: SLF001


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    made = Bench(monkeypatch)
    yield made
    made.close()


def move_well(bench: Bench, ticks: int = 30) -> None:
    """Have an arm in full motion, under somebody's eyes."""
    bench.after(2 * PRESENCE_TIMEOUT_S)
    bench.look()
    bench.begin()
    assert bench.reach().accepted
    for _ in range(ticks):
        bench.tick()
    assert bench.held() == {}
    assert bench.states[-1].tick == ticks


def test_a_lost_page_holds_the_arms_in_mid_motion(bench: Bench) -> None:
    move_well(bench)
    at = bench.states[-1].tick
    bench.look(viewers=0)
    assert bench.held() == NOBODY
    bench.tick_until_rest()
    stopped = bench.states[-1]
    assert stopped.tick - at <= 3  # within two ticks of that which first shows the hold
    assert stopped.holds == NOBODY
    assert bench.host.refusals["supervision"] == 1


def test_a_page_that_dies_holds_them_at_once(bench: Bench) -> None:
    move_well(bench)
    bench.page.close()
    assert bench.held() == {PAGE: "no page is running"}


def test_a_silent_page_is_lost_after_its_time(bench: Bench) -> None:
    move_well(bench)
    bench.after(PRESENCE_TIMEOUT_S - 0.01)
    assert bench.held() == {}
    bench.after(0.02)
    assert bench.held() == NOBODY


def test_a_page_that_goes_on_speaking_is_not_lost(bench: Bench) -> None:
    move_well(bench)
    for _ in range(20):
        bench.after(0.25)
        bench.look()
    assert bench.held() == {}


def test_motion_wants_to_look_again_when_the_page_may_be_lost(bench: Bench) -> None:
    move_well(bench)
    bench.after(0.4)
    wait_s = bench.service.wake()
    assert wait_s is not None
    assert wait_s <= PRESENCE_TIMEOUT_S - 0.4 + 1e-9


def test_who_can_only_look_does_not_supervise(bench: Bench) -> None:
    bench.after(2 * PRESENCE_TIMEOUT_S)
    bench.look(viewers=0, read_only=3)
    bench.begin()
    assert bench.held() == NOBODY


def test_one_of_two_pages_is_enough(bench: Bench) -> None:
    move_well(bench)
    other = MemoryBus(bench.fabric, "cell", "monitor/two")
    other.announce("alive/monitor")
    bench.look(page=other)
    bench.page.close()
    bench.look(viewers=1, page=other)
    assert bench.held() == {}
    other.close()
    assert bench.held() == {PAGE: "no page is running"}


def test_nothing_moves_before_a_page_is_there_and_a_person_has_lifted_the_hold(
    bench: Bench,
) -> None:
    bench.after(2 * PRESENCE_TIMEOUT_S)
    bench.begin()
    assert bench.held() == NOBODY
    bench.reach()
    bench.tick_until_rest()
    assert bench.states[-1].tick == 0
    bench.look()
    assert bench.held() == NOBODY  # a page that is back lifts nothing by itself
    assert bench.answer(RESUME, ResumeRequest(holder=PAGE, by="monitor")).holds == {}
    assert bench.held() == {}


def test_lifted_while_nobody_looks_it_stands_again(bench: Bench) -> None:
    move_well(bench)
    bench.look(viewers=0)
    assert bench.held() == NOBODY
    bench.tick_until_rest()
    tips = [arm.setpoint_joints for arm in bench.states[-1].arms.values()]
    bench.answer(RESUME, ResumeRequest(holder=PAGE, by="cli"))
    assert bench.held() == NOBODY
    bench.tick_until_rest()
    assert [arm.setpoint_joints for arm in bench.states[-1].arms.values()] == tips


@pytest.mark.parametrize("by", ["executive", "supervisor", PAGE, "recorder", "Monitor"])
@pytest.mark.parametrize("holder", [PAGE, "monitor"])
def test_software_lifts_neither_the_pages_hold_nor_a_stop_pressed_there(
    bench: Bench, holder: str, by: str
) -> None:
    move_well(bench)
    bench.answer(HOLD, HoldRequest(holder="monitor", reason="stop pressed"))
    bench.look(viewers=0)
    both = {"monitor": "stop pressed", **NOBODY}
    assert bench.held() == both
    with pytest.raises(RemoteFault, match=r"NotYourHold|UnknownHold"):
        bench.answer(RESUME, ResumeRequest(holder=holder, by=by))
    assert bench.held() == both


@pytest.mark.parametrize("by", ["monitor", "cli"])
def test_a_stop_pressed_at_the_page_is_lifted_there_or_from_the_cli(bench: Bench, by: str) -> None:
    bench.answer(HOLD, HoldRequest(holder="monitor", reason="stop pressed"))
    assert bench.answer(RESUME, ResumeRequest(holder="monitor", by=by)).holds == {}


def test_a_client_that_calls_itself_so_holds_under_another_name(bench: Bench) -> None:
    """Or the watch would take its hold for its own, and hold no more once it is lifted."""
    held = bench.answer(HOLD, HoldRequest(holder=PAGE, reason="mine")).holds
    assert held == {f"client:{PAGE}": "mine"}


def test_a_trial_that_is_not_supervised_goes_on_without_a_page(bench: Bench) -> None:
    bench.page.close()
    bench.after(2 * PRESENCE_TIMEOUT_S)
    bench.begin(supervised=False)
    assert bench.held() == {}


def test_after_the_trial_the_page_may_be_closed(bench: Bench) -> None:
    move_well(bench)
    bench.tick_until_rest()
    bench.ask(CANCEL, CancelRequest(trial="t", reason="over"))
    bench.page.close()
    assert bench.held() == {}


def test_motion_that_has_just_started_gives_the_page_time_to_speak(bench: Bench) -> None:
    """Else each restart of motion would ask for a person, with the page in front of them."""
    bench.begin()
    assert bench.held() == {}
    bench.after(PRESENCE_TIMEOUT_S - 0.01)
    assert bench.held() == {}
    bench.after(0.02)
    assert bench.held() == NOBODY


def test_motion_is_ready_without_a_page() -> None:
    bench = ShellBench("motion", MotionService, client="recorder/test")
    bench.client.serve(RECORDER_LAST, lambda call: call.reply(LastReply(payload=b"")))
    bench.host.announce_alive()
    for service in ("recorder", "sim", "sa"):
        bench.client.announce(f"alive/{service}")
    for _ in range(200):
        bench.host.drain(bench.service.wake() or 0.0)
        if bench.host.state == "ready":
            break
    assert bench.host.state == "ready"
    bench.close()
