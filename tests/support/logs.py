"""What the system tests read from logs."""

from pathlib import Path
from typing import Any

import msgspec
from mcap.reader import make_reader

from fras_common.codec import decode
from fras_common.messages import Header
from fras_common.topics import topic_of

REPRODUCIBLE = (
    "sim/tissue_model",
    "sim/tissue_state",
    "robot/state",
    "sa/verdict",
    "sa/context",
    "planner/plan",
    "motion/action_result",
)
MAY_DIFFER = {"stamp_ns", "seq", "source", "trial", "wall_s", "ground_s", "solve_s"}


def messages(log: Path, key: str) -> list[Any]:
    """Decode every message of a key, with the stock reader and its checks on."""
    topic = topic_of(key)
    assert topic is not None
    with log.open("rb") as stream:
        found = make_reader(stream, validate_crcs=True).iter_messages(topics=[key])
        return [decode(topic.type, message.data, key) for _, _, message in found]


def comparable(message: Header) -> Any:
    """Everything that two equal trials share."""

    def strip(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: strip(item) for key, item in value.items() if key not in MAY_DIFFER}
        return [strip(item) for item in value] if isinstance(value, list) else value

    return strip(msgspec.to_builtins(message))


def assert_same_trial(one: Path, other: Path) -> None:
    """Both logs tell the same trial, bit for bit, in every key that must be reproducible."""
    for key in REPRODUCIBLE:
        first = [comparable(message) for message in messages(one, key)]
        second = [comparable(message) for message in messages(other, key)]
        assert first, key
        assert first == second, key
