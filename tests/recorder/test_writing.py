"""The writing thread: its mistakes are the process's."""

import queue
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest

from fras_common.bus import RawSample
from fras_common.codec import encode, read_header
from fras_log import AuditLog, LogHeading, LogReader
from fras_recorder.completeness import Completeness
from fras_recorder.writing import PLACES, Opened, Trial, Writing
from support.verdicts import verdict


def nothing(*_: Any) -> None:
    pass


def written(path: Path) -> list[int]:
    """Numbers of the messages that a log holds."""
    headers = (read_header(one.payload) for one in LogReader(path).messages())
    return [header.seq for header in headers if header is not None]


def test_a_mistake_on_the_writing_thread_is_raised_on_the_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    posted: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
    writing = Writing(posted.put, nothing, nothing, nothing)
    log = AuditLog(tmp_path / "audit.mcap", LogHeading({}), 1)
    writing.open(lambda: Opened(log, Trial("t-1"), Completeness("t-1")), nothing)
    posted.get(timeout=10.0)()

    def mistake(*_: Any) -> None:
        raise ZeroDivisionError("a mistake")

    monkeypatch.setattr(AuditLog, "write", mistake)
    writing.put(RawSample("sa/verdict", b"", ""), 1)
    with pytest.raises(ZeroDivisionError):
        posted.get(timeout=10.0)()
    writing.end()
    log.abandon()


def test_what_comes_while_nothing_is_open_does_not_pile_up(tmp_path: Path):
    writing = Writing(nothing, nothing, nothing, nothing)
    for _ in range(100):
        writing.put(RawSample("sa/verdict", b"", ""), 1)
    assert writing.waiting == 0
    writing.end()


def test_what_is_said_while_a_log_is_taken_up_finds_room(tmp_path: Path):
    posted: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
    facts: list[Any] = []
    writing = Writing(posted.put, nothing, nothing, nothing)
    writing.listen()
    count = 3 * PLACES
    for _ in range(count):
        writing.put(RawSample("some/key", b"", ""), 1)
    log = AuditLog(tmp_path / "audit.mcap", LogHeading({}), 1)
    writing.open(lambda: Opened(log, Trial("t-1"), Completeness("t-1")), nothing)
    writing.put(RawSample("some/key", b"", ""), 1)
    writing.close("closed", facts.append)
    while not facts:
        posted.get(timeout=30.0)()
    assert facts[0].messages == count + 1
    assert writing.take_dropped() == 0
    writing.end()


@pytest.mark.parametrize(("trial", "kept"), [("t-0", [7, 8]), ("", [7, 8]), ("t-1", [7, 5, 8])])
def test_so_is_one_from_a_cache(tmp_path: Path, trial: str, kept: list[int]):
    """What arms say has no trial; of such, 130 from before came into a log of `fras chaos`."""
    posted: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
    facts: list[Any] = []
    writing = Writing(posted.put, nothing, nothing, nothing)
    log = AuditLog(tmp_path / "audit.mcap", LogHeading({}), 1)
    ahead_ns = time.time_ns() + 3_600 * 10**9
    first, old, now = (
        RawSample("sa/verdict", encode(msgspec.structs.replace(one, source="sa/1", seq=seq)), "")
        for one, seq in (
            (msgspec.structs.replace(verdict(2, "t-1"), stamp_ns=2), 7),
            (msgspec.structs.replace(verdict(3, trial), stamp_ns=ahead_ns), 5),
            (msgspec.structs.replace(verdict(4, "t-1"), stamp_ns=ahead_ns + 1), 8),
        )
    )
    log.write(first, 1)
    cached = [first, old, now]
    writing.open(lambda: Opened(log, Trial("t-1", 1), Completeness("t-1"), cached), nothing)
    writing.close("closed", facts.append)
    while not facts:
        posted.get(timeout=30.0)()
    assert written(tmp_path / "audit.mcap") == kept
    writing.end()


@pytest.mark.parametrize(("trial", "kept"), [("t-0", [7]), ("t-1", [7, 5])])
def test_an_early_sample_of_another_trial_is_known_by_its_number(
    tmp_path: Path, trial: str, kept: list[int]
):
    """Whom the recorder hears first is asked for its past; its clock may have been ahead then."""
    posted: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
    facts: list[Any] = []
    writing = Writing(posted.put, nothing, nothing, nothing)
    log = AuditLog(tmp_path / "audit.mcap", LogHeading({}), 1)
    writing.listen()
    ahead_ns = time.time_ns() + 3_600 * 10**9
    old = msgspec.structs.replace(verdict(3, trial), source="sa/1", seq=5, stamp_ns=ahead_ns)
    now = msgspec.structs.replace(verdict(9, "t-1"), source="sa/1", seq=7, stamp_ns=2)
    cached = [RawSample("sa/verdict", encode(now), "")]
    writing.put(RawSample("sa/verdict", encode(old), ""), 1)
    writing.open(lambda: Opened(log, Trial("t-1", 1), Completeness("t-1"), cached), nothing)
    writing.close("closed", facts.append)
    while not facts:
        posted.get(timeout=30.0)()
    assert written(tmp_path / "audit.mcap") == kept
    writing.end()
