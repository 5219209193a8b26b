"""Files that are no log of ours, or of a version to come: told by name, whatever they are."""

import io
import os
import socket
from pathlib import Path

import msgpack
import pytest
from mcap.writer import Writer

from fras_common.bus import RawSample
from fras_log import (
    ForeignLog,
    LogExists,
    LogFile,
    NoSuchLog,
    NotAnMcap,
    Signer,
    recover_file,
    verify_file,
)
from support.damage import OPENING, Recording, Whole, robot, write_log
from support.forger import metadata, put_together, take_apart
from support.verdicts import verdict

NEWER = "9.0.1"


def pack(value: object) -> bytes:
    packed = msgpack.packb(value)
    assert packed is not None
    return packed


def foreign(profile: str = "ros2", messages: int = 3) -> bytes:
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start(profile=profile)
    channel = writer.register_channel(topic="/tf", message_encoding="cdr", schema_id=0)
    for number in range(messages):
        writer.add_message(channel, log_time=number, data=b"x" * 100, publish_time=number)
    writer.finish()
    return stream.getvalue()


@pytest.mark.parametrize("command", ["verify", "recover"])
@pytest.mark.parametrize(
    ("content", "error", "text"),
    [
        (b"", NotAnMcap, "it is empty"),
        (b"\x89MCAP0\r", NotAnMcap, "magic"),
        (b"trial,tick\n1,2\n", NotAnMcap, "magic"),
        (os.urandom(5000), NotAnMcap, "magic"),
        (foreign(), ForeignLog, "profile is 'ros2'"),
        (foreign(profile=""), ForeignLog, "profile is ''"),
    ],
    ids=["empty", "seven bytes", "text", "noise", "of ROS", "of nobody"],
)
def test_a_file_of_something_else(
    tmp_path: Path, command: str, content: bytes, error: type[Exception], text: str
):
    path, out = tmp_path / "it.mcap", tmp_path / "out.mcap"
    path.write_bytes(content)
    with pytest.raises(error, match=text):
        verify_file(path) if command == "verify" else recover_file(path, out, 1)
    assert not out.exists()


def test_a_large_file_of_someone_else_is_not_read_to_its_end(tmp_path: Path):
    path = tmp_path / "it.mcap"
    path.write_bytes(foreign(messages=50_000))
    told: list[int] = []
    with pytest.raises(ForeignLog):
        verify_file(path, progress=lambda position, _: told.append(position))
    assert told[-1] < path.stat().st_size / 2


def test_a_file_with_our_profile_and_none_of_our_records(tmp_path: Path):
    path = tmp_path / "it.mcap"
    path.write_bytes(foreign(profile="fras"))
    found = verify_file(path)
    assert not found.intact
    assert any("'fras' is missing" in one.text for one in found.findings)
    assert any("no checkpoint vouches for" in one.text for one in found.findings)


def test_our_log_under_another_profile(whole: Whole, tmp_path: Path):
    pieces = take_apart(whole.data)
    pieces[0].content = pieces[0].content.replace(b"fras", b"fros", 1)
    path = tmp_path / "it.mcap"
    path.write_bytes(put_together(pieces))
    (finding,) = verify_file(path).findings
    assert finding.text == "the file's profile is 'fros', not 'fras'"
    assert finding.offset == 8


def test_what_is_no_file(tmp_path: Path):
    with pytest.raises(NoSuchLog, match="regular file"):
        verify_file(tmp_path)
    with pytest.raises(NoSuchLog, match="No such file"):
        verify_file(tmp_path / "none.mcap")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(NoSuchLog, match="regular file"):
        verify_file(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "s"))
        with pytest.raises(NoSuchLog, match="regular file"):
            recover_file(tmp_path / "s", tmp_path / "out.mcap", 1)


def test_a_file_that_may_not_be_read(whole: Whole, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Root may read everything, so the refusal is played."""
    path = tmp_path / "it.mcap"
    path.write_bytes(whole.data)

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(NoSuchLog, match="Permission denied"):
        verify_file(path)


def test_recovery_writes_over_nothing(whole: Whole, tmp_path: Path):
    path, out = tmp_path / "it.mcap", tmp_path / "out.mcap"
    path.write_bytes(whole.data)
    out.write_bytes(b"mine")
    with pytest.raises(LogExists):
        recover_file(path, out, 1)
    with pytest.raises(LogExists):
        recover_file(path, path, 1)
    assert out.read_bytes() == b"mine"
    assert path.read_bytes() == whole.data


def test_recovery_says_what_it_is_of_and_who_did_it(whole: Whole, tmp_path: Path, signer: Signer):
    path, out = tmp_path / "it.mcap", tmp_path / "out.mcap"
    path.write_bytes(whole.data[: whole.chunks[3].end])
    recovery = recover_file(path, out, 1, signer)
    again = verify_file(out, [signer.public])
    assert again.authentic, again.findings
    assert {name: again.opening[name] for name in OPENING} == OPENING
    assert len(recovery.damage) == 1
    # The checkpoint of the last chunk is cut off.
    assert recovery.chained == sum(map(len, whole.per_chunk[:3])) < recovery.messages
    forged = take_apart(out.read_bytes())
    (told,) = [one for one in forged if b"fras.recovered" in one.content[:30]]
    forged[forged.index(told)] = metadata("fras.recovered", {"damage": "none"})
    out.write_bytes(put_together(forged))
    assert "'fras.recovered' is not the one" in verify_file(out).findings[0].text


# --- versions -------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", ["0.0.1", "0.0", "nightly", ""])
def test_an_older_version_or_none(tmp_path: Path, version: str):
    path = tmp_path / "it.mcap"
    write_log(path, None, fras_version=version)
    assert verify_file(path).intact


def newer_log(path: Path, signer: Signer) -> LogFile:
    """With a key, a field and a type of field that this version does not know."""
    file = LogFile(path, OPENING | {"fras_version": NEWER}, {}, 1, signer)
    recording = Recording(file)
    for tick in range(3):
        recording.tick(tick)
    header = {"stamp_ns": 5, "seq": 0, "source": "sim/1", "trial": "t-1", "tick": 2}
    for number in range(30):
        new = pack(header | {"seq": number, "torque_nm": 1.0})
        file.write(RawSample("robot/torque", new, "application/msgpack"), 10 + number)
    changed = pack(header | {"seq": 3, "level": {"now": "a map"}})
    file.write(RawSample("sa/verdict", changed, "application/msgpack"), 50)
    file.close({})
    return file


def test_a_newer_version_is_named_once(tmp_path: Path, signer: Signer):
    path = tmp_path / "it.mcap"
    newer_log(path, signer)
    found = verify_file(path, [signer.public])
    (finding,) = found.findings
    assert finding.kind == "version"
    assert f"FRAS {NEWER} wrote this log, newer than this one" in finding.text
    assert "31 messages can't be understood here, of robot/torque, sa/verdict" in finding.text
    assert finding.offset > 0
    assert not found.intact
    assert found.chained == found.messages == 40
    assert found.signed_by == signer.public.fingerprint


def test_in_a_newer_version_a_change_is_found_all_the_same(tmp_path: Path, signer: Signer):
    path = tmp_path / "it.mcap"
    newer_log(path, signer)
    pieces = take_apart(path.read_bytes())
    chunk = next(one for one in pieces if one.opcode == 6)
    vars(chunk)["inside"][-1].content = vars(chunk)["inside"][-1].content[:-1] + b"x"
    path.write_bytes(put_together(pieces))
    assert {one.kind for one in verify_file(path).findings} == {"version", "chain"}


def test_a_payload_that_does_not_fit_its_key_is_named(tmp_path: Path):
    path = tmp_path / "it.mcap"
    file = LogFile(path, OPENING, {}, 1)
    recording = Recording(file)
    recording.tick(0)
    recording.raw("sa/verdict", b"\xc1")
    recording.tick(1)
    file.close({})
    (finding,) = verify_file(path).findings
    assert (finding.kind, finding.topic) == ("schema", "sa/verdict")


def test_a_gap_is_named_but_not_of_telemetry(tmp_path: Path):
    path = tmp_path / "it.mcap"
    file = LogFile(path, OPENING, {}, 1)
    recording = Recording(file)
    recording.tick(0)
    recording.put("robot/state", robot(1), skip=4)
    file.close({})
    found = verify_file(path)
    gap = next(one for one in found.findings if one.kind == "sequence")
    assert gap.text == "4 messages before this one never arrived"
    assert (gap.topic, gap.sequence, gap.tick) == ("robot/state", 5, 1)


def test_arms_that_moved_without_a_verdict_are_named(tmp_path: Path):
    path = tmp_path / "it.mcap"
    file = LogFile(path, OPENING, {}, 1)
    recording = Recording(file)
    recording.tick(0)
    recording.put("robot/state", robot(1))
    recording.put("robot/state", robot(2))
    file.close({})
    (finding,) = verify_file(path).findings
    assert finding.kind == "interlock"
    assert (finding.topic, finding.tick) == ("robot/state", 2)
    assert "there is none for tick 1" in finding.text


def test_verdicts_on_states_that_never_arrived_are_named(tmp_path: Path):
    path = tmp_path / "it.mcap"
    file = LogFile(path, OPENING, {}, 1)
    recording = Recording(file)
    recording.tick(0)
    # Motion was killed, and with it what the recorder had not written yet: no number tells.
    recording.put("sa/verdict", verdict(1))
    recording.put("sa/verdict", verdict(2))
    file.close({})
    (finding,) = verify_file(path).findings
    assert finding.kind == "interlock"
    assert (finding.topic, finding.tick) == ("sa/verdict", 1)
    assert "2 of ticks 1 to 2" in finding.text


def test_a_key_told_in_two_encodings_keeps_both(tmp_path: Path):
    path = tmp_path / "it.mcap"
    file = LogFile(path, OPENING, {}, 1)
    for number, encoding in enumerate(["text/plain", "application/json", "text/plain"]):
        file.write(RawSample("someone/else", b"{}", encoding), number)
    file.close({})
    whole = Whole(path.read_bytes())
    told = [dict(one.channel[1])["zenoh_encoding"] for one in whole.messages]
    assert told == ["text/plain", "application/json", "text/plain"]
    assert verify_file(path).intact
