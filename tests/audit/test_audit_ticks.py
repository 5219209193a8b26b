"""At which tick a question was answered that does not say so; and what was held then."""

import msgspec
import pytest

from fras_audit.holds import audit_holds
from fras_audit.recorded import Recorded
from fras_audit.ticks import ticks_while
from fras_common.codec import encode
from fras_common.messages import (
    Header,
    Holds,
    RobotState,
    RpcRecord,
    TargetReply,
    TargetRequest,
)
from fras_common.messages.service import NIL
from fras_common.scenario import Scenario
from fras_common.topics import HOLDS, ROBOT_STATE, SA_TARGET
from fras_log import RawMessage

MS = 1_000_000


def mirror(at_ms: float, took_ms: float) -> RpcRecord:
    return RpcRecord(
        key="sa/target",
        request=NIL,
        reply=NIL,
        fault=None,
        duration_s=took_ms / 1e3,
        stamp_ns=int(at_ms * MS),
    )


@pytest.mark.parametrize(
    ("at_ms", "took_ms", "ticks"),
    [(25, 1, [1]), (31, 2, [1, 2]), (99, 1, [3]), (55, 50, [0, 1, 2, 3]), (5, 1, [0])],
)
def test_ticks_at_which_a_question_may_have_been_answered(
    at_ms: float, took_ms: float, ticks: list[int]
) -> None:
    said = [Header(tick=tick, stamp_ns=(10 + 10 * tick) * MS) for tick in range(4)]
    assert list(ticks_while(mirror(at_ms, took_ms), said)) == ticks


def test_without_a_tick_there_is_none() -> None:
    assert list(ticks_while(mirror(25, 1), [])) == []


def raw(key: str, payload: bytes) -> RawMessage:
    return RawMessage(key, payload, 0)


def shown(tick: int, at_ms: int, **holds: str) -> RawMessage:
    state = RobotState(
        tick=tick,
        stamp_ns=at_ms * MS,
        seq=tick,
        trial="t",
        arms={},
        action=None,
        holds=holds,
        verdict_tick=tick - 1,
    )
    return raw(ROBOT_STATE.key, encode(state))


def told(at_ms: int, **holds: str) -> RawMessage:
    return raw(HOLDS.key, encode(Holds(stamp_ns=at_ms * MS, seq=at_ms, holds=holds)))


def differing(*messages: RawMessage) -> list[str]:
    recorded = Recorded("log", "t", {}, Scenario())
    for message in messages:
        recorded.take(message)
    assert recorded.malformed == 0
    tally = audit_holds(recorded)
    assert tally.compared == len(recorded.of(ROBOT_STATE)) > 0
    return [tally.first.where] if tally.first is not None else []


def test_a_hold_is_shown_from_the_next_state_on() -> None:
    held = {"cli": "stop"}
    assert (
        differing(shown(0, 10), told(15, **held), shown(1, 20, **held), told(30), shown(1, 31))
        == []
    )
    # One told while a state was on its way stands in the next one.
    assert differing(shown(0, 10), told(19, **held), shown(1, 20), shown(2, 30, **held)) == []


def test_a_hold_of_before_the_log_goes_on() -> None:
    assert (
        differing(shown(0, 10, page="stop"), shown(1, 20, page="stop"), told(25), shown(1, 26))
        == []
    )
    assert differing(shown(0, 10, page="stop"), shown(1, 20)) == ["tick 1"]


def test_a_hold_ignored_or_invented_is_told() -> None:
    assert differing(shown(0, 10), told(15, cli="stop"), shown(1, 20), shown(2, 30)) == ["tick 2"]
    assert differing(shown(0, 10), shown(1, 20, cli="stop")) == ["tick 1"]
    assert differing(shown(0, 10), told(15, cli="stop"), shown(1, 20, cli="why")) == ["tick 1"]


def test_motions_own_hold_is_not_looked_for() -> None:
    assert differing(shown(0, 10), shown(1, 20, cancel="the trial has ended")) == []


def test_a_mirror_that_does_not_fit_its_key_is_not_understood() -> None:
    request = TargetRequest(trial="t", action="reach", arm="psm1", block="b(1,1)")
    mirror = RpcRecord(
        trial="t",
        key="sa/target",
        request=msgspec.Raw(encode(request)),
        reply=msgspec.Raw(encode(TargetReply(position_m=None))),
        fault=None,
        duration_s=0.0,
    )
    recorded = Recorded("log", "t", {}, Scenario())
    for key in ("rpc/motion/execute", "rpc/sa/context"):
        recorded.take(raw(key, encode(mirror)))
    recorded.take(raw("rpc/sa/target", encode(msgspec.structs.replace(mirror, reply=NIL))))
    assert recorded.malformed == 3
    recorded.take(raw("rpc/sa/target", encode(mirror)))
    assert (recorded.malformed, len(recorded.mirrors(SA_TARGET))) == (3, 1)
