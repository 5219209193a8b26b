"""The key that signs: made once whoever comes first, its owner's alone, refused by name."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    NoEncryption,
    PrivateFormat,
)

from fras_log import BadKey
from fras_log.keys import default_key_path, load_or_make, read_public, trusted_keys

PROCESSES, ROUNDS = 4, 25
# Imports first; then all wait for a line, so that they start at once.
RACER = """
import sys
from pathlib import Path
from fras_log.keys import load_or_make
print("ready", flush=True)
for line in sys.stdin:
    print(load_or_make(Path(line.strip())).public.fingerprint, flush=True)
"""


def pem(key: Ed25519PrivateKey, password: bytes = b"") -> bytes:
    locked = BestAvailableEncryption(password) if password else NoEncryption()
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, locked)


def test_processes_that_start_at_once_have_one_key(tmp_path: Path):
    racers = [
        subprocess.Popen(
            [sys.executable, "-c", RACER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for _ in range(PROCESSES)
    ]
    pipes = [(one.stdin, one.stdout) for one in racers]
    for _, said in pipes:
        assert said is not None
        assert said.readline() == "ready\n"
    for number in range(ROUNDS):
        path = tmp_path / str(number) / "log.key"
        for told, _ in pipes:
            assert told is not None
            told.write(f"{path}\n")
            told.flush()
        names = {said.readline().strip() for _, said in pipes if said is not None}
        assert names == {load_or_make(path).public.fingerprint}
        assert {read_public(path.with_suffix(".pub")).fingerprint} == names
        assert sorted(one.name for one in path.parent.iterdir()) == ["log.key", "log.pub"]
        assert path.stat().st_mode & 0o777 == 0o600
    for one in racers:
        one.communicate(timeout=10)
        assert one.returncode == 0


def test_a_key_is_its_owners_alone_whatever_the_umask(tmp_path: Path):
    before = os.umask(0)
    try:
        load_or_make(tmp_path / "deep" / "log.key")
    finally:
        os.umask(before)
    assert (tmp_path / "deep" / "log.key").stat().st_mode & 0o777 == 0o600
    assert (tmp_path / "deep").stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"", "no key to sign logs with"),
        (b"garbage", "no key to sign logs with"),
        (b"-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n", "no key to sign"),
        (pem(Ed25519PrivateKey.generate())[:60], "no key to sign logs with"),
        (pem(Ed25519PrivateKey.generate(), b"secret"), "no key to sign logs with"),
        (
            generate_private_key(SECP256R1()).private_bytes(
                Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()
            ),
            "is no Ed25519 key",
        ),
    ],
    ids=["empty", "garbage", "no content", "cut", "locked", "another kind"],
)
def test_a_damaged_key_is_named(tmp_path: Path, content: bytes, text: str):
    path = tmp_path / "log.key"
    path.write_bytes(content)
    path.chmod(0o600)
    with pytest.raises(BadKey, match=text) as caught:
        load_or_make(path)
    assert caught.value.values == {"path": path}
    assert path.read_bytes() == content
    with pytest.raises(BadKey):
        read_public(path)


def test_a_key_that_others_may_read_is_refused(tmp_path: Path):
    path = tmp_path / "log.key"
    path.write_bytes(pem(Ed25519PrivateKey.generate()))
    path.chmod(0o640)
    with pytest.raises(BadKey, match="chmod 600"):
        load_or_make(path)


def test_a_place_where_no_key_can_be(tmp_path: Path):
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(BadKey, match="File exists"):
        load_or_make(tmp_path / "file" / "log.key")
    tmp_path.chmod(0o700)
    with pytest.raises(BadKey, match="Is a directory"):
        load_or_make(tmp_path)


def test_a_public_half_that_was_lost_is_written_again(tmp_path: Path):
    """As after a process that was killed between the two."""
    path = tmp_path / "log.key"
    made = load_or_make(path).public
    path.with_suffix(".pub").unlink()
    assert load_or_make(path).public == made == read_public(path.with_suffix(".pub"))


def test_what_a_killed_process_left_is_in_nobodys_way(tmp_path: Path):
    """In a container the same process numbers come again and again."""
    (tmp_path / f"log.{os.getpid()}").write_bytes(b"half a k")
    assert load_or_make(tmp_path / "log.key").public == load_or_make(tmp_path / "log.key").public


def test_a_user_without_a_home(monkeypatch: pytest.MonkeyPatch):
    def nowhere() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_DATA_HOME")
    monkeypatch.setattr(Path, "home", nowhere)
    with pytest.raises(BadKey, match="XDG_DATA_HOME"):
        default_key_path()


def test_this_machines_key_is_trusted_unless_others_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "mine"))
    assert trusted_keys([]) == []
    mine = load_or_make(default_key_path()).public
    other = load_or_make(tmp_path / "other.key").public
    assert trusted_keys([]) == [mine]
    assert trusted_keys([tmp_path / "other.pub"]) == [other]


@pytest.mark.parametrize("damaged", [False, True])
def test_the_module_prints_the_fingerprint(tmp_path: Path, damaged: bool):
    key = tmp_path / "fras" / "log.key"
    if damaged:
        key.parent.mkdir()
        key.touch(0o600)
    result = subprocess.run(
        [sys.executable, "-m", "fras_log.keys"],
        env=os.environ | {"XDG_DATA_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == int(damaged)
    if damaged:
        assert result.stderr.startswith(f"fras_log.keys: {key}: no key to sign logs with")
        assert "Traceback" not in result.stderr
    else:
        assert load_or_make(key).public.fingerprint in result.stdout
