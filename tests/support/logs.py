"""What the system tests read from logs."""

from pathlib import Path
from typing import Any

import msgspec
from mcap.reader import make_reader

from fras_common.codec import MalformedMessage, decode
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


def messages(log: Path, key: str, with_garbage: bool = False) -> list[Any]:
    """Decode every message of a key, with the stock reader and its checks on.

    What does not decode is an error, or left out where the test sent it itself.
    """
    topic = topic_of(key)
    assert topic is not None
    found: list[Any] = []
    with log.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        for _, _, message in reader.iter_messages(topics=[key]):
            try:
                found.append(decode(topic.type, message.data, key))
            except MalformedMessage:
                assert with_garbage
    return found


def comparable(message: Header) -> Any:
    """Everything that two equal trials share."""

    def strip(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: strip(item) for key, item in value.items() if key not in MAY_DIFFER}
        return [strip(item) for item in value] if isinstance(value, list) else value

    return strip(msgspec.to_builtins(message))


def assert_same_trial(one: Path, other: Path, with_garbage: bool = False) -> None:
    """Both logs tell the same trial, bit for bit, in every key that must be reproducible."""
    for key in REPRODUCIBLE:
        first = [comparable(message) for message in messages(one, key)]
        second = [comparable(message) for message in messages(other, key, with_garbage)]
        assert first, key
        assert first == second, key
