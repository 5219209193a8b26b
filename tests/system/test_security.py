"""The rogue-client suite: who has no certificate, or another's, changes nothing.

Attacks run beside a trial, several beside the same one, which ends as if nobody had been there.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import pytest
import zenoh

from fras_audit import audit_log
from fras_cli.trial import TrialView
from fras_common.bus import NoAnswer, RawSample
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.codec import decode, encode
from fras_common.messages import (
    ExecuteRequest,
    FaultRecord,
    Header,
    Health,
    HoldRequest,
    Holds,
    LastRequest,
    LogRecord,
    ResetRequest,
    ResumeRequest,
    RobotState,
    RpcRecord,
    ServoJaw,
    Verdict,
    WhyNotReply,
    WhyNotRequest,
)
from fras_common.scenario import Scenario
from fras_common.topics import (
    ACTION_RESULT,
    CRTK,
    EXECUTE,
    HEALTH,
    HOLD,
    HOLDS,
    MOTION_RESET,
    RECORDER_LAST,
    RESUME,
    ROBOT_STATE,
    RPC,
    SIM_RESET,
    TASK_STATUS,
    TISSUE_STATE,
    VERDICT,
    WHY_NOT,
    Qos,
)
from support.logs import assert_same_trial, comparable, messages
from support.rogues import Rogues
from support.verdicts import verdict

MESH = "11,13,2"
JAW = CRTK[0].jaw_servo_jp
ROGUE = "rogue"
YESTERDAY = "client/yesterday"
ASKED_S = 0.3
LIE = WhyNotReply(question="", trial=ROGUE, request_id="", rules=[], sentences=["So it is."])
Attack = Callable[[TrialView], None]


class Stage:
    """A stack with certificates, its rogues, and how a trial goes without them."""

    def __init__(self, trials: Any, quiet: Path, wait_until: Callable[..., Any]) -> None:
        self._trials, self._quiet, self.until = trials, quiet, wait_until
        self.link = trials.stack.link
        folder = trials.stack.log_dir.parent
        self.rogues = Rogues(self.link.cell, self.link.connect, folder / "keys", folder)
        self._health: dict[str, Health] = {}
        self.link.bus.subscribe(HEALTH, lambda one: self._health.update({one.service: one}))

    def refused(self, service: str, name: str) -> int:
        """How many messages a service has refused by that name."""
        one = self._health.get(service)
        return one.refusals.get(name, 0) if one is not None else 0

    def withstands(self, attack: Attack, pace: float = 0) -> Path:
        """Run a trial, attacked as long as it runs; returns its log."""
        attacks: list[str] = []

        def look(view: TrialView) -> None:
            if view.task is not None and view.task.phase != "idle":
                attack(view)
                attacks.append(view.task.phase)

        summary, log = self._trials.run("a", look, pace, mesh=MESH)
        assert attacks, "the attack met a trial"
        assert (summary.outcome, summary.complete, summary.lost) == ("success", True, 0)
        assert_same_trial(self._quiet, log)
        return log

    def router_log(self) -> str:
        return (self._trials.stack.log_dir / "router.log").read_text()


@pytest.fixture(scope="module")
def stage(secure_trials: Any, quiet: Path, wait_until: Callable[..., Any]) -> Stage:
    return Stage(secure_trials, quiet, wait_until)


def robot(tick: int, trial: str) -> RobotState:
    return RobotState(
        tick=tick, trial=trial, source=f"motion/{ROGUE}", stamp_ns=1, seq=10**6, arms={},
        action=None, holds={}, verdict_tick=tick - 1,
    )  # fmt: skip


def stale(tick: int, trial: str) -> Verdict:
    return verdict(tick, trial, "invalid", reason="stale")


def from_a_rogue(log: Path, key: str) -> list[Any]:
    found: list[Header] = messages(log, key)
    assert found
    return [one for one in found if ROGUE in one.source]


def told_of(log: Path, service: str, source: str) -> list[LogRecord]:
    records: list[LogRecord] = messages(log, f"log/{service}")
    return [one for one in records if source in one.fields.get("problem", "")]


# --- who is not let in, and who is, and reaches for more than is its own ------------------------


@dataclass
class Beside:
    """What came of the attacks beside one trial; the rogue that was let in as sa is still there."""

    rogue: ZenohBus
    logs: list[Path] = field(default_factory=list[Path])
    errors: dict[str, str] = field(default_factory=dict[str, str])
    refused: list[str] = field(default_factory=list[str])
    heard: list[str] = field(default_factory=list[str])


@pytest.fixture(scope="module")
def beside(stage: Stage) -> Iterator[Beside]:
    """Attack a trial from without and from within, until each attack has met one."""
    rogues = stage.rogues
    strangers: dict[str, Callable[[], None]] = {
        "without any": rogues.without_certificate,
        "expired": lambda: rogues.open_with(rogues.expired()),
        "of another authority": lambda: rogues.open_with(rogues.of_another_authority()),
        "the router's": lambda: rogues.open_with(rogues.routers()),
        "plain": lambda: rogues.open_with(None, rogues.plain()),
    }
    asked: list[Any] = [EXECUTE, MOTION_RESET, SIM_RESET]
    with rogues.named("sa") as rogue, rogues.named("cli") as person:
        made = Beside(rogue)
        stage.link.bus.subscribe(ROBOT_STATE, lambda one: made.heard.append(one.source))
        puts = [rogue.publisher_raw(ROBOT_STATE.key, qos) for qos in (Qos.STATE, Qos.TELEMETRY)]
        rogue.serve(WHY_NOT, lambda call: call.reply(LIE))
        rogue.announce("alive/motion")

        def attack(view: TrialView) -> None:
            assert view.task is not None
            trial, tick = view.task.trial, view.robot.tick if view.robot is not None else 0
            for put in puts:
                for ahead in range(3):
                    put.put(encode(robot(tick + ahead, trial)), "application/msgpack")
            rogue.announce("ready/planner")
            # What takes its time, one at a look.
            if strangers:
                name, come_in = strangers.popitem()
                with pytest.raises(zenoh.ZError) as caught:
                    come_in()
                made.errors[name] = str(caught.value)
            elif asked:
                query = asked.pop()
                with pytest.raises(NoAnswer):
                    person.query(query, request_for(query, trial), ASKED_S)
                made.refused.append(query.key)

        while strangers or asked:
            made.logs.append(stage.withstands(attack, pace=1))
        yield made


def request_for(query: Any, trial: str) -> ExecuteRequest | ResetRequest:
    """What somebody asks who is not the planner."""
    if query is not EXECUTE:
        return ResetRequest(trial=ROGUE, scenario=Scenario())
    return ExecuteRequest(
        trial=trial, goal_id=ROGUE, name="release", arm="psm1", block="b(1,1)", target_m=None
    )


def test_who_has_no_certificate_of_this_authority_that_is_valid_is_not_let_in(
    stage: Stage, beside: Beside
) -> None:
    assert set(beside.errors) == {
        "without any", "expired", "of another authority", "the router's", "plain"
    }  # fmt: skip
    # The router's log names each that spoke TLS.
    for why in (
        "peer sent no certificates",
        "certificate expired",
        "BadSignature",
        "key usage",
        "corrupt",
    ):
        assert why in stage.router_log()


def test_another_services_certificate_publishes_nothing_in_its_place(
    stage: Stage, beside: Beside
) -> None:
    for log in beside.logs:
        assert from_a_rogue(log, "robot/state") == []
    assert beside.heard
    assert not [source for source in beside.heard if ROGUE in source]
    # It is connected all the same: what is its own, it may say.
    mine: list[str] = []
    stage.link.bus.subscribe(VERDICT, lambda one: mine.append(one.source))
    beside.rogue.publisher(VERDICT).put(stale(0, "no trial"))
    stage.until(lambda: f"sa/{ROGUE}" in mine, "its own key")


def test_only_the_planner_executes_and_resets(beside: Beside) -> None:
    assert set(beside.refused) == {"motion/execute", "motion/reset", "sim/reset"}
    for log in beside.logs:
        asked = [msgspec.msgpack.decode(one.request) for one in messages(log, "rpc/motion/execute")]
        assert asked
        assert ROGUE not in [one["goal_id"] for one in asked]


def test_nobody_answers_or_shows_itself_in_anothers_place(stage: Stage, beside: Beside) -> None:
    """It answers `why not`, and shows itself as motion and, beside the trial, as planner."""
    assert beside.logs
    request = WhyNotRequest(question="b(1,1)")
    answers = [stage.link.bus.query(WHY_NOT, request, 5.0) for _ in range(10)]
    present = stage.link.bus.tokens(5.0)
    assert ROGUE not in [one.trial for one in answers]
    assert [token for token in present if token.startswith("alive/motion/")]
    assert not [token for token in present if token.endswith(f"/{ROGUE}")]


def test_a_service_lifts_no_hold_and_anybody_may_stop(stage: Stage) -> None:
    with stage.rogues.named("sim") as rogue:
        held = rogue.query(HOLD, HoldRequest(holder="cli", reason="a stop is safe"), 5.0)
        assert "cli" in held.holds
        with pytest.raises(NoAnswer):
            rogue.query(RESUME, ResumeRequest(holder="cli", by="cli"), ASKED_S)
    lifted = stage.link.bus.query(RESUME, ResumeRequest(holder="cli", by="cli"), 5.0)
    assert lifted.holds == {}


# --- who may speak, and says what it must not ---------------------------------------------------


@dataclass
class Lies:
    """A trial that was lied to, and the faults that motion told meanwhile."""

    log: Path
    wrong_before: int
    faults: list[FaultRecord]


@pytest.fixture(scope="module")
def lied_to(stage: Stage) -> Lies:
    """Run a trial beside which one speaks as planner, and another repeats old commands."""
    with stage.rogues.named("client", source="client/honest") as honest:
        caught: list[ServoJaw] = []
        stage.link.bus.subscribe(JAW, caught.append)
        jaw = honest.publisher(JAW)

        def led() -> bool:
            jaw.put(ServoJaw(jaw_rad=0.05))
            return bool(caught)

        stage.until(led, "a command to send again")
    old = caught[0]
    # Of somebody whom motion has never heard, so that its age alone tells.
    long_ago = msgspec.structs.replace(
        old, stamp_ns=old.stamp_ns - 24 * 3600 * 10**9, seq=0, source=YESTERDAY
    )
    before = stage.refused("motion", "wrong_source")
    named = stage.rogues.named
    with named("sa", source=f"planner/{ROGUE}") as liar, named("client") as repeater:
        lies = liar.publisher(VERDICT)
        again = repeater.publisher_raw(JAW.key, Qos.COMMAND)

        def attack(view: TrialView) -> None:
            for one in (old, long_ago):
                again.put(encode(one), "application/msgpack")
            if view.task is not None and view.robot is not None:
                for ahead in range(3):
                    lies.put(stale(view.robot.tick + ahead, view.task.trial))

        log = stage.withstands(attack)
    return Lies(log, before, messages(log, "fault/motion"))


def test_a_message_under_anothers_name_has_no_effect_is_counted_and_told_once(
    stage: Stage, lied_to: Lies
) -> None:
    sources = [one.values["source"] for one in lied_to.faults if one.kind == "WrongSource"]
    assert len(sources) >= 3
    assert set(sources) == {f"planner/{ROGUE}"}
    counted = lied_to.wrong_before + len(sources)
    stage.until(lambda: stage.refused("motion", "wrong_source") >= counted, "counted")
    assert len(told_of(lied_to.log, "motion", ROGUE)) == 1
    assert from_a_rogue(lied_to.log, "sa/verdict") == []


def test_a_command_of_before_has_no_effect_is_counted_and_told_once(
    stage: Stage, lied_to: Lies
) -> None:
    stale = [one for one in lied_to.faults if one.kind == "StaleCommand"]
    assert len(stale) >= 2
    assert {one.values["source"] for one in stale} == {"client/honest", YESTERDAY}
    assert not [one for one in lied_to.faults if one.kind == "CommandRefused"]
    stage.until(lambda: stage.refused("motion", "stale_command") >= len(stale), "counted")
    told = [one.fields["problem"] for one in messages(lied_to.log, "log/motion")]
    assert len([one for one in told if "came before" in one]) == 1
    assert len([one for one in told if "stamped" in one]) == 1


# --- without certificates -----------------------------------------------------------------------


def test_what_was_said_before_and_is_said_again_changes_nothing(trials: Any, quiet: Path) -> None:
    """Whoever reaches a plain router repeats what he hears, of this trial and of another one."""
    bus = trials.stack.link.bus
    heard: dict[str, list[bytes]] = {}
    topics = (ROBOT_STATE, TISSUE_STATE, VERDICT, ACTION_RESULT, HOLDS, TASK_STATUS)
    keys = [topic.key for topic in topics]

    def hear(sample: RawSample) -> None:
        heard.setdefault(sample.key, []).append(sample.payload)

    for key in keys:
        bus.subscribe_raw(key, hear)
    again = {key: bus.publisher_raw(key, Qos.TELEMETRY) for key in keys}
    sent = 0

    def repeat(view: TrialView) -> None:
        nonlocal sent
        for key in keys:
            known = heard.get(key, [])
            for old in (*known[:3], *known[-40:-20:7]):
                again[key].put(old, "application/msgpack")
                sent += 1

    summary, log = trials.run("a", repeat, mesh=MESH)
    assert sent > 50
    assert summary.outcome == "success"

    def moved(log: Path) -> dict[int, Any]:
        return {one.tick: comparable(one) for one in messages(log, "robot/state")}

    assert moved(quiet) == moved(log)


def test_a_goal_of_before_is_refused_by_name_and_moves_nothing(trials: Any, quiet: Path) -> None:
    """Whoever reaches a plain router sends each command that he heard again, all the time."""
    bus = trials.stack.link.bus
    taken: list[ExecuteRequest] = []

    def hear(record: RpcRecord) -> None:
        request = decode(ExecuteRequest, bytes(record.request), EXECUTE.key)
        if request not in taken:
            taken.append(request)

    bus.subscribe(RPC.of(service="motion", name="execute"), hear)
    reasons: list[str] = []
    ticks = [0]

    def repeat(view: TrialView) -> None:
        # More often than the executive asks, less often than motion answers.
        if view.robot is None or abs(view.robot.tick - ticks[-1]) < 10:
            return
        ticks.append(view.robot.tick)
        ours = [one for one in taken if one.trial == view.robot.trial]
        for request in ours[:-1]:
            reasons.append(bus.query(EXECUTE, request, 5.0).reason)
        if ours:
            # The latest is answered as it was, in case the answer was lost; it is not done again.
            bus.query(EXECUTE, ours[-1], 5.0)

    summary, log = trials.run("a", repeat, mesh=MESH)
    assert summary.outcome == "success"
    assert reasons
    # What comes as the trial is over already is of another trial.
    assert set(reasons) - {"another_trial"} == {"goal_used"}
    # Done once each, as in a trial that nobody attacks.
    assert_same_trial(quiet, log)
    assert audit_log(log, ("motion",), lambda *_: None).passed


def test_holds_of_before_are_not_what_a_motion_would_start_with(
    trials: Any, wait_until: Any
) -> None:
    """The recorder tells a motion that starts again who held the arms: what was said last."""
    bus = trials.stack.link.bus
    told: list[RawSample] = []
    bus.subscribe_raw(HOLDS.key, told.append)
    health: list[Health] = []
    bus.subscribe(HEALTH.of(service="recorder"), health.append)

    def last() -> dict[str, str]:
        payload = bus.query(RECORDER_LAST, LastRequest(key=HOLDS.key), 5.0).payload
        return decode(Holds, payload, HOLDS.key).holds

    bus.query(HOLD, HoldRequest(holder="first", reason="to be lifted"), 5.0)
    bus.query(RESUME, ResumeRequest(holder="first", by="first"), 5.0)
    wait_until(lambda: len(told) >= 2, "what motion holds")
    bus.query(HOLD, HoldRequest(holder="surgeon", reason="wait"), 5.0)
    try:
        again = bus.publisher_raw(HOLDS.key, Qos.TELEMETRY)
        before = told[:2]

        def counted() -> bool:
            for old in before:
                again.put(old.payload, "application/msgpack")
            return bool(health) and health[-1].refusals.get("said_before", 0) > 10

        wait_until(counted, "what is said again is counted")
        assert last() == {"surgeon": "wait"}
    finally:
        bus.query(RESUME, ResumeRequest(holder="surgeon", by="surgeon"), 5.0)
