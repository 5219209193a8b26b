"""A log of several files that somebody added to, or whose manifest he edited."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.data_stream import RecordBuilder
from mcap.records import Metadata

from fras_log import AuditLog, LogFile, LogHeading, Signer, take_up, verify_file
from support.damage import OPENING, START_NS, Recording


@pytest.fixture
def log(tmp_path: Path, signer: Signer) -> Path:
    """A log of two files: the recorder of the first was killed."""
    path = tmp_path / "audit.mcap"
    heading = LogHeading(OPENING, {"scenario.toml": b"seed = 4"}, signer)
    first = AuditLog(path, heading, START_NS)
    recording = Recording(first)
    for tick in range(8):
        recording.tick(tick)
    first.flush(recording.now_ns)
    first.abandon()
    recording.file = second = take_up(path, heading, recording.now_ns)
    for tick in range(8, 12):
        recording.tick(tick)
    second.close("closed", recording.now_ns)
    assert verify_file(path, [signer.public]).authentic
    return path


def findings(path: Path, signer: Signer) -> list[str]:
    return [str(one) for one in verify_file(path, [signer.public]).findings]


def test_nothing_can_be_said_beside_the_messages_of_a_killed_recorder(log: Path, signer: Signer):
    log.with_suffix(".manifest.json").unlink()
    builder = RecordBuilder()
    Metadata(name="note", metadata={"surgeon": "the stop was pressed"}).write(builder)
    with log.open("ab") as file:
        file.write(builder.end())
    assert "no closing record vouches for ['note']" in " ".join(findings(log, signer))


def test_a_log_that_is_finished_has_no_file_behind_it(log: Path, signer: Signer):
    found = verify_file(log)
    told = {
        "part": "3",
        "head_before": found.head,
        "messages_before": str(found.messages),
        "opened_ns": str(START_NS),
    }
    LogFile(log.with_name("audit.3.mcap"), OPENING | told, {}, START_NS).close({"reason": "closed"})
    assert findings(log, signer) == [
        "parts: this file ends the log, and audit.3.mcap is behind it (audit.2.mcap)"
    ]


def edit(**changes: Any) -> Callable[[dict[str, Any]], None]:
    return lambda manifest: manifest["parts"][0].update(changes)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda one: one.update(trial="t-9"), "the manifest tells of trial 't-9'"),
        (edit(reason="size"), "it ended as 'size', it did as 'killed'"),
        (edit(began_ns=5), "it began at 5 ns"),
        (lambda one: one["parts"].reverse(), "in another order"),
        (lambda one: one["parts"].append(one["parts"][1]), "names files twice"),
    ],
    ids=["trial", "reason", "began", "order", "double"],
)
def test_nothing_in_the_manifest_can_be_edited(
    log: Path, signer: Signer, change: Callable[[dict[str, Any]], None], expected: str
):
    path = log.with_suffix(".manifest.json")
    told = json.loads(path.read_text())
    change(told)
    path.write_text(json.dumps(told))
    (finding,) = findings(log, signer)
    assert expected in finding
