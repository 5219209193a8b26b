"""Bytes to messages: what is wrong is named by key and path, whatever it is."""

import random
from typing import Any

import msgpack
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fras_common.codec import (
    MAX_MESSAGE_BYTES,
    MalformedMessage,
    content_digest,
    decode,
    encode,
)
from fras_common.messages import (
    ActionState,
    ArmState,
    Context,
    ExecuteRequest,
    LogRecord,
    Pose,
    RobotState,
    RpcRecord,
    TissueModel,
)
from fras_common.scenario import Scenario

LOG = {"level": "warning", "event": "late", "fields": {"by": "2"}}


def packed(plain: Any) -> bytes:
    payload = msgpack.packb(plain)
    assert payload is not None
    return payload


def arm() -> ArmState:
    joints = (0.0, 0.1, 0.12, 0.0, 0.0, 0.0)
    return ArmState(
        joints=joints,
        joint_velocities=joints,
        tip_in_world=Pose(position_m=(0.0, 0.0, 0.1), quaternion_xyzw=(0.0, 0.0, 0.0, 1.0)),
        jaw_rad=0.1,
        setpoint_joints=joints,
        setpoint_jaw_rad=0.1,
        operating_state="ENABLED",
    )


def robot_state() -> RobotState:
    action = ActionState(goal_id="g", name="pull", arm="psm1", block="b(1,1)", phase="lifting")
    return RobotState(
        tick=3, arms={"psm1": arm(), "psm2": arm()}, action=action, holds={}, verdict_tick=2
    )


def test_a_message_comes_back_equal():
    assert decode(RobotState, encode(robot_state()), "robot/state") == robot_state()


def test_plain_msgpack_reads_what_was_sent():
    plain = msgpack.unpackb(encode(robot_state()))
    assert plain["tick"] == 3
    assert plain["arms"]["psm2"]["tip_in_world"]["position_m"] == [0.0, 0.0, 0.1]


def test_what_plain_msgpack_packs_is_a_message():
    assert decode(LogRecord, packed(LOG), "log/sim") == LogRecord(
        level="warning", event="late", fields={"by": "2"}
    )


@pytest.mark.parametrize(
    ("change", "path", "problem"),
    [
        ({"seq": "one"}, "$.seq", "int"),
        ({"tick": 1.5}, "$.tick", "int"),
        ({"fields": {"by": 2}}, "$.fields[...]", "str"),
        ({"level": None}, "$.level", "str"),
        ({"unheard": 1}, "$", "unheard"),
    ],
)
def test_the_field_that_is_wrong_is_named(change: dict[str, Any], path: str, problem: str):
    with pytest.raises(MalformedMessage) as caught:
        decode(LogRecord, packed(LOG | change), "log/sim")
    assert caught.value.values["key"] == "log/sim"
    assert caught.value.values["path"] == path
    assert problem in str(caught.value.values["problem"])
    assert str(caught.value).startswith(f"log/sim: {path}: ")


def test_a_fault_deep_inside_is_named_by_its_path():
    plain = msgpack.unpackb(encode(robot_state()))
    plain["arms"]["psm1"]["joints"] = [0.0] * 5
    with pytest.raises(MalformedMessage) as caught:
        decode(RobotState, packed(plain), "robot/state")
    assert caught.value.values["path"] == "$.arms[...].joints"


def test_a_missing_field_is_named():
    with pytest.raises(MalformedMessage, match="`event`"):
        decode(LogRecord, packed({"level": "warning", "fields": {}}), "log/sim")


def test_a_message_of_another_type_is_refused():
    with pytest.raises(MalformedMessage, match="robot/state"):
        decode(RobotState, packed(LOG), "robot/state")


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\xc0",
        b"\xc1",
        b"\x93\x01\x02\x03",
        b"not msgpack at all",
        b"\x81\xa6source\xa2\xff\xff",
        b"\x81\xa7fluents\xdd\xff\xff\xff\xff",
        b"\x81\xa7fluents\xdd\x0f\xff\xff\xff" + b"\xa1a" * 100,
        b"\x81\xa8evidence\xdf\xff\xff\xff\xff",
        b"\x81\xa6fluent" + b"\x91" * 100_000,
        b"\x81\xa7fluents" + b"\x91" * 100_000,
        b"\xdf\xff\xff\xff\xff",
        b"\xc6\xff\xff\xff\xff",
        b"\x81\xa3seq\xcf\xff\xff\xff\xff\xff\xff\xff\xff",
    ],
    ids=lambda payload: payload[:12].hex() or "nothing",
)
def test_bytes_that_are_no_message_are_malformed_and_nothing_worse(payload: bytes):
    with pytest.raises(MalformedMessage) as caught:
        decode(Context, payload, "sa/context")
    assert caught.value.values["key"] == "sa/context"


def test_raw_fields_are_bounded_in_depth():
    with pytest.raises(MalformedMessage):
        decode(RpcRecord, b"\x81\xa7request" + b"\x91" * 200_000, "rpc/sim/reset")


@given(st.binary(max_size=200))
@settings(max_examples=300, deadline=None)
def test_any_bytes_are_malformed_and_nothing_worse(payload: bytes):
    with pytest.raises(MalformedMessage):
        decode(TissueModel, payload, "sim/tissue_model")


def test_any_damage_to_a_message_is_a_message_or_malformed():
    whole = encode(robot_state())
    dice = random.Random(7)
    malformed = 0
    for _ in range(3000):
        damaged = bytearray(whole)
        for _ in range(dice.randint(1, 4)):
            damaged[dice.randrange(len(damaged))] = dice.randrange(256)
        try:
            decode(RobotState, bytes(damaged[: dice.randint(1, len(damaged))]), "robot/state")
        except MalformedMessage:
            malformed += 1
    assert malformed > 1000


def test_a_payload_beyond_all_bounds_is_not_even_looked_at():
    with pytest.raises(MalformedMessage, match="more than"):
        decode(LogRecord, bytes(MAX_MESSAGE_BYTES + 1), "log/sim")


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_a_command_that_is_not_finite_is_refused(value: float):
    command = {
        "trial": "t", "goal_id": "g", "name": "move", "arm": "psm1", "block": "b(1,1)",
        "target_m": [0.0, 0.0, value],
    }  # fmt: skip
    with pytest.raises(MalformedMessage, match="target_m is not finite"):
        decode(ExecuteRequest, packed(command), "motion/execute")
    with pytest.raises(ValueError, match="not finite"):
        ExecuteRequest(
            trial="t", goal_id="g", name="move", arm="psm1", block="", target_m=(value, 0.0, 0.0)
        )


def test_the_digest_tells_contents_and_borders_apart():
    scenario = Scenario()
    assert content_digest("t", scenario, b"") == content_digest("t", Scenario(), b"")
    digests = {
        content_digest("t", scenario, b""),
        content_digest("t", Scenario(seed=1), b""),
        content_digest("u", scenario, b""),
        content_digest("t", scenario, b"mesh"),
        content_digest("a", "bc"),
        content_digest("ab", "c"),
        content_digest("abc"),
    }
    assert len(digests) == 7
    assert all(len(digest) == 64 for digest in digests)
