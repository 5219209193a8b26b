"""`fras log verify`, `recover` and `show` as they are typed, on logs whole and damaged."""

import io
import json
import random
import re
from pathlib import Path
from typing import Any

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from rich.console import Console
from tests.cli.report import conftest as made
from typer.testing import CliRunner

from fras_cli.app import app
from fras_cli.progress import read_progress
from fras_log import LogFile, Signer
from fras_log.keys import default_key_path, load_or_make
from support.log_command import fras_log


@pytest.fixture(scope="module")
def signer(tmp_path_factory: pytest.TempPathFactory) -> Signer:
    """A machine's key; its public half is beside it."""
    return load_or_make(tmp_path_factory.mktemp("key") / "log.key")


def write(path: Path, signer: Signer | None, **opening: str) -> LogFile:
    """A whole trial, in pieces of a hundred messages."""
    metadata = {
        "trial": made.TRIAL,
        "fras_version": "0.1.0",
        "python_version": "3.11.7",
        "host": "theatre-1",
        "scenario": made.to_toml(made.scenario()),
    }
    file = LogFile(path, metadata | opening, {"scenario.toml": b""}, made.START_NS, signer)
    log = made.LogWriter(file)
    made.write_trial(log)
    log.raw("someone/else", b"\xc1 no message")
    file.close({"reason": "closed"})
    return file


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("log") / "audit.mcap"
    write(path, load_or_make(default_key_path()))
    return path.read_bytes()


@pytest.fixture
def path(tmp_path: Path, whole: bytes) -> Path:
    path = tmp_path / "audit.mcap"
    path.write_bytes(whole)
    return path


def fras(*arguments: Any) -> tuple[int, str]:
    """Exit status and all that is said, as one line."""
    status, said = fras_log(*arguments)
    return status, " ".join(said.split())


def test_what_this_machine_signed_is_authentic(path: Path):
    _, said = fras("verify", path)
    own = load_or_make(default_key_path()).public.fingerprint
    assert f"The log is authentic: intact, and signed with key {own}." in said


def test_what_another_machine_signed_takes_its_key(tmp_path: Path, signer: Signer):
    path = tmp_path / "audit.mcap"
    write(path, signer)
    name = signer.public.fingerprint
    _, said = fras("verify", path)
    assert f"It is signed with key {name}, which is not among those trusted here" in said
    key = tmp_path / "other.pub"
    other = load_or_make(tmp_path / "other.key").public
    assert key.exists()
    _, said = fras("verify", path, "--key", key)
    assert other.fingerprint not in said
    assert "not among those trusted" in said
    status, said = fras("verify", path, "--key", tmp_path / "none.pub")
    assert status == 1
    assert "no public key" in said


def test_the_other_machines_key_is_trusted_when_given(tmp_path: Path):
    other = load_or_make(tmp_path / "other.key")
    path = tmp_path / "audit.mcap"
    write(path, other)
    _, said = fras("verify", path, "--key", tmp_path / "other.pub")
    assert f"authentic: intact, and signed with key {other.public.fingerprint}" in said


def test_what_nobody_signed_is_intact_only(tmp_path: Path):
    path = tmp_path / "audit.mcap"
    head = write(path, None).head
    _, said = fras("verify", path)
    assert "The log is intact. It is not signed" in said
    assert "authentic" not in said
    assert head in said
    assert "not the one that was noted" not in fras("verify", path, "--head", head.upper())[1]
    status, said = fras("verify", path, "--head", "00" * 32)
    assert status == 1
    assert "not the one that was noted" in said


def test_a_cut_log_is_told_as_one_and_recovered(path: Path, whole: bytes):
    before = whole[: len(whole) * 2 // 3]
    path.write_bytes(before)
    status, said = fras("verify", path)
    assert status == 1
    assert "end: the file ends within a record" in said
    assert "was never closed, or was cut: its chain vouches for the" in said
    assert "NOT what was recorded" not in said
    status, said = fras("recover", path)
    assert status == 0
    assert "messages recovered, up to tick" in said
    assert path.read_bytes() == before
    _, said = fras("verify", path.with_name("audit.recovered.mcap"))
    assert "The log is intact. It is not signed" in said
    status, said = fras("recover", path)
    assert status == 1
    assert "never written over" in said


def test_a_flipped_bit_is_told_with_its_place(path: Path, whole: bytes):
    changed = bytearray(whole)
    changed[len(whole) // 2] ^= 4
    path.write_bytes(changed)
    status, said = fras("verify", path)
    assert status == 1
    assert "structure: " in said
    assert "(offset " in said
    assert "NOT what was recorded" in said
    status, said = fras("recover", path)
    assert status == 0
    assert "was damaged: offset" in said


def test_no_command_crashes_on_any_damage(path: Path, whole: bytes):
    """Whatever it says, it says by name: `fras` asserts that there is no other exception."""
    dice = random.Random(3)
    for number in range(12):
        damaged = bytearray(whole)
        for _ in range(3):
            damaged[dice.randrange(len(damaged))] ^= 1 << dice.randrange(8)
        path.write_bytes(damaged[: dice.randrange(len(damaged))] if number % 2 else damaged)
        assert fras("verify", path)[0] == 1
        fras("recover", path, "--out", path.with_name(f"{number}.mcap"))
        fras("show", path, "sa/verdict", "--from", 3, "--to", 4)
        fras("info", path)


def test_a_log_of_a_newer_version_is_told_as_one(tmp_path: Path):
    path = tmp_path / "audit.mcap"
    write(path, None, fras_version="99.0", scenario="[magnets]\nfield_t = 3.0\n")
    status, said = fras("verify", path)
    assert status == 1
    assert "version: FRAS 99.0 wrote this log, newer than this one" in said
    assert "What could be checked is as it was recorded" in said
    assert "What was done can't be verified" in said


@pytest.mark.parametrize("command", [["verify"], ["recover"], ["show", "sa/verdict"]])
def test_what_is_no_log_is_told_by_name(tmp_path: Path, command: list[str]):
    path = tmp_path / "audit.mcap"
    path.write_bytes(b"")
    for given, text in ((path, "is empty"), (tmp_path / "none", "No such file")):
        status, said = fras(command[0], given, *command[1:])
        assert status == 1
        assert text in said


def test_show_tells_messages_of_ticks(path: Path):
    status, said = fras("show", path, "sa/verdict", "--from", "46", "--to", "47")
    assert status == 0
    assert said.count("max_force_n: ") == 2
    assert "max_force_n: 0.51" in said


def test_show_gives_one_object_a_line(path: Path):
    result = CliRunner().invoke(app, ["log", "show", str(path), "sa/verdict", "--json"])
    told = [json.loads(line) for line in result.stdout.splitlines()]
    assert [one["tick"] for one in told] == list(range(made.LAST_TICK + 1))


def test_damage_is_told_beside_the_json(path: Path, whole: bytes):
    path.write_bytes(whole[: len(whole) // 2])
    result = CliRunner().invoke(app, ["log", "show", str(path), "robot/state", "--json"])
    assert all(json.loads(line)["arms"] for line in result.stdout.splitlines())
    assert "damaged at offset" in result.stderr


def test_show_tells_what_is_no_message_as_its_bytes(path: Path):
    assert "12 bytes c1206e6f206d657373616765" in fras("show", path, "someone/else")[1]
    status, said = fras("show", path, "sa/verdikt")
    assert status == 1
    assert "holds no message of 'sa/verdikt'; its keys:" in said
    assert "sa/verdict" in said


@pytest.mark.parametrize(("last_s", "shown"), [(1.9, False), (2.5, True)])
def test_progress_is_shown_to_those_who_wait(last_s: float, shown: bool):
    clock = iter([0.0, 1.0, last_s])
    console = Console(record=True, force_terminal=True, width=80, file=io.StringIO())
    with read_progress(console, "verifying", lambda: next(clock)) as tell:
        for position in (100, 200):
            tell(position * 1_000_000, 500_000_000)
    assert ("verifying" in console.export_text()) == shown


def test_a_key_of_another_kind_is_told(tmp_path: Path, path: Path):
    key = tmp_path / "some.pub"
    key.write_bytes(Ed25519PrivateKey.generate().private_bytes_raw())
    status, said = fras("verify", path, "--key", key)
    assert status == 1
    assert f"{key}: no public key" in said


def test_ticks_that_a_key_does_not_have_are_told(path: Path) -> None:
    status, said = fras("show", path, "sa/verdict", "--from", "9000")
    assert status == 1
    assert re.search(r"no message of 'sa/verdict' in these ticks; it has \d+ to \d+$", said)


@pytest.mark.parametrize("head", ["9f2c", "9f2c...", "zz" * 32])
def test_a_head_that_is_not_whole_is_not_held_against_the_log(path: Path, head: str) -> None:
    status, said = fras("verify", path, "--head", head)
    assert status == 2
    assert "a head is 64 hexadecimal digits" in said
    assert "NOT what was recorded" not in said
