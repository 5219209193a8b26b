"""`fras log info` and `fras log extract` as they are typed: all that a log says of itself."""

import json
from dataclasses import dataclass
from pathlib import Path

import msgspec
import pytest
from mcap.records import Metadata
from tests.cli.report import conftest as made
from typer.testing import CliRunner

from fras_cli.app import app
from fras_cli.log_info import LogInfo, read_info
from fras_cli.report import read_trial, summarise
from fras_common.digests import own_table_digest
from fras_common.messages import LogRecord
from fras_common.topics import topic_of
from fras_log import LogFile, Signer
from fras_log.attachments import read_attachments
from fras_log.keys import load_or_make
from support.forger import metadata, put_together, read, take_apart
from support.log_command import fras_log

FILES = {
    "scenario.toml": b"seed = 7\n",
    "asp/goal.lp": b"% goal\n",
    "asp/preferences/lex.lp": b"% lex\n",
}
OPENING = {
    "trial": made.TRIAL,
    "fras_version": "0.1.0",
    "python_version": "3.11.7",
    "build": "Python 3.11.7; fras 0.1.0; some processor",
    "host": "theatre-1",
    "asp_digest": "ab" * 32,
    "topics_digest": own_table_digest(),
}


def write(path: Path, signer: Signer | None = None, **opening: str) -> str:
    """A whole trial with two gaps of two publishers; returns its head."""
    said = OPENING | {"scenario": made.to_toml(made.scenario())} | opening
    file = LogFile(path, said, FILES, made.START_NS, signer)
    log = made.LogWriter(file)
    made.write_trial(log)
    warning = LogRecord(level="warning", event="late", fields={})
    log.put("log/sa", warning)
    log.put("log/sa", warning, skip=3)
    log.put("log/motion", warning)
    log.put("log/motion", warning, skip=2)
    log.raw("someone/else", b"\xc1 no message")
    file.close({"reason": "closed"})
    return file.head


@dataclass(frozen=True)
class Whole:
    """A log, signed; it is only read."""

    path: Path
    head: str
    signer: Signer


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    folder = tmp_path_factory.mktemp("whole")
    signer = load_or_make(folder / "log.key")
    path = folder / "run" / "audit.mcap"
    return Whole(path, write(path, signer), signer)


@pytest.fixture(scope="module")
def told(whole: Whole) -> LogInfo:
    return info(whole.path)


def forged_signature(log: bytes) -> bytes:
    """The log with a signature in its closing record."""
    pieces = take_apart(log)
    closing = read(pieces[-1])
    assert isinstance(closing, Metadata)
    signed = metadata(closing.name, {**closing.metadata, "signature": "00" * 64})
    return put_together([*pieces[:-1], signed])


def info(path: Path) -> LogInfo:
    """What `--json` prints, as the type that describes it."""
    status, said = fras_log("info", path, "--json")
    assert status == 0
    return msgspec.json.decode(said, type=LogInfo, strict=True)


def test_json_tells_all_that_the_log_says_of_itself(whole: Whole, told: LogInfo) -> None:
    path = whole.path
    assert told == read_info(path)
    assert (told.log, told.size_bytes) == (str(path), path.stat().st_size)
    assert (told.trial, told.host) == (made.TRIAL, "theatre-1")
    assert told.versions == {"fras": "0.1.0", "python": "3.11.7"}
    assert told.build == OPENING["build"]
    assert (told.asp_digest, told.topics_digest) == ("ab" * 32, own_table_digest())
    assert told.own_topics is True
    assert (told.head, told.signed_by) == (whole.head, whole.signer.public.fingerprint)
    assert told.attachments == {name: len(data) for name, data in FILES.items()}
    assert (told.complete, told.damage) == (True, "")


def test_it_tells_what_the_trial_came_to(whole: Whole, told: LogInfo) -> None:
    summary = summarise(read_trial(whole.path))
    assert (told.outcome, told.reason) == (summary.outcome, summary.reason) != ("aborted", "")
    assert (told.messages, told.lost) == (summary.messages, summary.lost)
    assert (told.ticks, told.sim_s, told.wall_s) == (made.LAST_TICK, summary.sim_s, summary.wall_s)
    assert told.sim_s == pytest.approx(0.1 * made.LAST_TICK)


def test_keys_are_counted(told: LogInfo) -> None:
    assert sum(one.messages for one in told.keys) == told.messages
    keys = {one.key: one for one in told.keys}
    assert list(keys) == sorted(keys)
    verdicts = keys["sa/verdict"]
    topic = topic_of("sa/verdict")
    assert topic is not None
    assert (verdicts.messages, verdicts.type) == (made.LAST_TICK + 1, topic.type.__name__)
    other = keys["someone/else"]
    assert (other.type, other.messages, other.bytes, other.rate_hz) == (None, 1, 12, None)


def test_gaps_are_told_by_publisher(told: LogInfo) -> None:
    gaps = {(one.key, one.publisher): one.missing for one in told.gaps}
    assert gaps == {("log/motion", "log/1"): 2, ("log/sa", "log/1"): 3}
    assert sum(gaps.values()) == told.lost


def test_duration_and_rate_are_those_of_the_messages(tmp_path: Path) -> None:
    path = tmp_path / "audit.mcap"
    file = LogFile(path, OPENING | {"scenario": made.to_toml(made.scenario())}, {}, 0)
    log = made.LogWriter(file)
    log.put("log/sa", LogRecord(level="warning", event="late", fields={}))
    log.now_ns += 2_500_000_000
    log.put("log/sa", LogRecord(level="warning", event="late", fields={}))
    file.close({})
    told = info(path)
    assert told.duration_s == pytest.approx(2.5)
    assert [one.rate_hz for one in told.keys] == [pytest.approx(0.4)]
    assert told.attachments == {}


def test_people_are_told_the_same(whole: Whole, told: LogInfo) -> None:
    path = whole.path
    status, said = fras_log("info", path)
    words = " ".join(said.split())
    assert status == 0
    for text in (
        "3 messages of log/sa from log/1 are missing.",
        "host theatre-1",
        "versions fras 0.1.0, python 3.11.7",
        f"size {path.stat().st_size} bytes",
        f"rules {'ab' * 32}",
        f"topics {own_table_digest()}, as here",
        "attached scenario.toml, asp/goal.lp, asp/preferences/lex.lp",
        f"head {whole.head}",
        f"signed with key {whole.signer.public.fingerprint}, not verified",
        "file complete",
    ):
        assert text in words
    assert told.reason in words


def test_what_the_log_does_not_say_is_not_made_up(tmp_path: Path) -> None:
    path = tmp_path / "audit.mcap"
    file = made.open_log(path)
    made.write_trial(file)
    file.file.flush()
    file.file.abandon()
    told = info(path)
    assert (told.head, told.signed_by, told.asp_digest, told.build) == ("", "", "", "")
    assert told.own_topics is None
    assert not told.complete
    assert told.damage
    words = " ".join(fras_log("info", path)[1].split())
    for text in ("cut off", "head not said", "signed no", "rules not said", "topics not said"):
        assert text in words


def test_a_table_of_another_version_is_told(tmp_path: Path) -> None:
    path = tmp_path / "audit.mcap"
    write(path, topics_digest="cd" * 32, host="[red]theatre[/]")
    assert info(path).own_topics is False
    said = fras_log("info", path)[1]
    assert f"{'cd' * 32}, another than here" in said
    assert "[red]theatre[/]" in said, "what a log says is no markup"


@pytest.mark.parametrize("key", ["no key", "", "[bold]"])
def test_a_key_that_is_none_is_no_signer(tmp_path: Path, key: str) -> None:
    path = tmp_path / "audit.mcap"
    said = OPENING | {"scenario": made.to_toml(made.scenario()), "public_key": key}
    file = LogFile(path, said, {}, 0)
    made.LogWriter(file).put("log/sa", LogRecord(level="warning", event="late", fields={}))
    # A forger's closing record; the recorder's own writer leaves the signature empty.
    file.close({})
    path.write_bytes(forged_signature(path.read_bytes()))
    assert info(path).signed_by == ""


def test_attachments_are_listed(whole: Whole) -> None:
    status, said = fras_log("extract", whole.path)
    assert status == 0
    for name, data in FILES.items():
        (line,) = [line for line in said.splitlines() if name in line]
        assert str(len(data)) in line
    assert [one.name for one in whole.path.parent.iterdir()] == ["audit.mcap"]


def test_attachments_are_written_out_once(whole: Whole, tmp_path: Path) -> None:
    path, out = whole.path, tmp_path / "out"
    status, said = fras_log("extract", path, "--out", out)
    assert status == 0
    assert {name: (out / name).read_bytes() for name in FILES} == FILES
    assert all(str(out / name) in said for name in FILES)
    (out / "asp" / "goal.lp").write_bytes(b"mine")
    status, said = fras_log("extract", path, "--out", out)
    assert status == 2
    assert "exists and is not written over" in said
    assert (out / "asp" / "goal.lp").read_bytes() == b"mine"


def test_a_log_without_attachments_is_told(tmp_path: Path) -> None:
    path = tmp_path / "audit.mcap"
    LogFile(path, OPENING, {}, 0).close({})
    status, said = fras_log("extract", path)
    assert status == 1
    assert "attaches no files" in said


def test_a_recovered_log_attaches_the_same(whole: Whole, tmp_path: Path) -> None:
    path = tmp_path / "audit.mcap"
    path.write_bytes(whole.path.read_bytes()[:-2000])
    assert fras_log("recover", path)[0] == 0
    recovered = tmp_path / "audit.recovered.mcap"
    assert read_attachments(recovered) == FILES
    assert info(recovered).asp_digest == "ab" * 32


def test_the_json_is_one_object(whole: Whole) -> None:
    result = CliRunner().invoke(app, ["log", "info", str(whole.path), "--json"])
    assert json.loads(result.stdout)["trial"] == made.TRIAL
