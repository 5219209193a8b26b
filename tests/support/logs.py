"""What the system tests read from logs."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from mcap.reader import make_reader

from fras_common.codec import MalformedMessage, decode
from fras_common.messages import Header
from fras_common.topics import topic_of
from fras_log import LogReader
from fras_log.parts import parts_of

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
    """Decode every message of a key in all files of a log, with the stock reader, its checks on.

    What does not decode is an error, or left out where the test sent it itself.
    """
    topic = topic_of(key)
    assert topic is not None
    found: list[Any] = []
    for payload in _payloads(log, key):
        try:
            found.append(decode(topic.type, payload, key))
        except MalformedMessage:
            assert with_garbage
    return found


def _payloads(log: Path, key: str) -> Iterator[bytes]:
    files = parts_of(log)
    if len(files) > 1:
        # The stock reader wants an index; a recorder that was killed wrote none.
        yield from (one.payload for one in LogReader(log).messages() if one.key == key)
        return
    with log.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        yield from (message.data for _, _, message in reader.iter_messages(topics=[key]))


def comparable(message: Header) -> Any:
    """Everything that two equal trials share."""

    def strip(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: strip(item) for key, item in value.items() if key not in MAY_DIFFER}
        return [strip(item) for item in value] if isinstance(value, list) else value

    return strip(msgspec.to_builtins(message))


def said_once(found: list[Any]) -> list[Any]:
    """Leave out what was said again word for word, as of a tick that was answered late."""
    kept: list[Any] = []
    last_of_tick: dict[int, Any] = {}
    for message in found:
        one = comparable(message)
        if message.tick < 0 or last_of_tick.get(message.tick) != one:
            kept.append(one)
        last_of_tick[message.tick] = one
    return kept


def assert_same_trial(one: Path, other: Path, with_garbage: bool = False) -> None:
    """Both logs tell the same trial, bit for bit, in every key that must be reproducible."""
    reader = LogReader(other)
    next(reader.messages())
    trial = reader.metadata["trial"]
    for key in REPRODUCIBLE:
        first = said_once(messages(one, key))
        said = messages(other, key, with_garbage)
        if with_garbage:
            said = [message for message in said if message.trial == trial]
        assert first, key
        second = said_once(said)
        if first != second:
            pytest.fail(
                f"{key}: {first_difference(first, second)}; held: {held(one)}, {held(other)}"
            )


def first_difference(first: list[Any], second: list[Any]) -> str:
    """Tell where two lists of messages differ, and in which fields."""
    for place, (here, there) in enumerate(zip(first, second, strict=False)):
        fields = {name: (here[name], there[name]) for name in here if here[name] != there[name]}
        if fields:
            return f"message {place}, tick {here['tick']}: {fields}"[:2000]
    return f"{len(first)} messages, and {len(second)}"


def held(log: Path) -> dict[int, dict[str, str]]:
    """Tell the ticks at which something held the arms, and what."""
    return {state.tick: state.holds for state in messages(log, "robot/state") if state.holds}
