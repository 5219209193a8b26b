"""A secure stack as it is used, and a certificate that is used by somebody else."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fras_common.bus import NoAnswer
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.identity import Identity, identity_in
from fras_common.messages import HoldRequest
from fras_common.topics import HOLD, VERDICT
from fras_supervisor import free_port
from support.verdicts import verdict

MESH = "11,13,2"
ASKED_S, ANSWERED_S = 0.5, 10.0


class Thief:
    """Has copied a service's files, and has a session that was open before.

    Parameters
    ----------
    port : int
    identity : Identity
        The copy.
    name : str
        Whose it is.
    """

    def __init__(self, port: int, identity: Identity, name: str) -> None:
        self._source, self._place = f"{name}/thief", f"tls/127.0.0.1:{port}"
        self._identity = identity
        self._session = self._open()

    def may(self, session: ZenohBus) -> set[str]:
        """Speak and ask; tells whether anybody answered."""
        able: set[str] = set()
        try:
            session.query(HOLD, HoldRequest(holder="thief", reason="a stop"), ASKED_S)
            able.add("ask")
        except NoAnswer:
            pass
        session.publisher(VERDICT).put(verdict(0, "no trial", "ok"))
        return able

    def both(self) -> list[set[str]]:
        """Look through the session of before and through one that is opened now."""
        late = self._open()
        try:
            return [self.may(session) for session in (self._session, late)]
        finally:
            late.close()

    def close(self) -> None:
        self._session.close()

    def _open(self) -> ZenohBus:
        return ZenohBus("local", self._place, self._source, identity=self._identity)


@pytest.fixture
def stack(fras: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Path, int]]:
    """A secure stack that stays, and has made its keys; these and its port."""
    keys, port = tmp_path / "keys", free_port()
    with monkeypatch.context() as elsewhere:
        elsewhere.setenv("FRAS_KEYS", str(keys))
        up = fras("up", "--secure", "--port", str(port))
        up.until("ready after")
    assert f"made keys in {keys}" in up.text
    assert "tls/127.0.0.1:" in up.text
    yield keys, port
    up.note_family()
    assert fras("down").end() == 0, up.text
    assert up.end() == 0, up.text
    assert up.alone()


def test_every_command_finds_the_keys_and_a_revoked_one_has_no_effect(
    stack: tuple[Path, int], fras: Any, tmp_path: Path, wait_until: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Out of the box to the day on which a key was stolen; the stack goes on."""
    keys, port = stack
    copies = tmp_path / "stolen"
    copies.mkdir()
    for path in keys.glob("*"):
        if path.is_file():
            (copies / path.name).write_bytes(path.read_bytes())
            (copies / path.name).chmod(0o600)
    thief = Thief(port, identity_in(copies, "sa"), "sa")
    heard: list[str] = []
    ear = ZenohBus("local", f"tls/127.0.0.1:{port}", "cli/ear", identity=identity_in(keys, "cli"))
    try:
        ear.subscribe(VERDICT, lambda one: heard.append(one.source))
        assert thief.both() == [{"ask"}, {"ask"}]
        wait_until(lambda: "sa/thief" in heard, "before, it is what it says")
        # Another terminal knows nothing of where the keys are.
        (keys / "cli.key").chmod(0o644)
        refused = fras("status")
        assert refused.end() == 2
        assert "others may use this key: `chmod 600" in refused.text
        (keys / "cli.key").chmod(0o600)
        assert fras("resume", "--holder", "thief").end() == 0
        # In mid-trial, which waits for who has stopped it; our own certificate is revoked, too.
        trial = fras("run", "a", "--secure", "--pace", "0.5", "--mesh", MESH)
        trial.until("lifting")
        # Not by a command, which takes as long to start as a lift on a machine that is busy.
        ear.query(HOLD, HoldRequest(holder="cli", reason="a key was stolen"), ANSWERED_S)
        monkeypatch.setenv("FRAS_KEYS", str(keys))
        revoked = fras("keys", "revoke", "sa", "cli")
        monkeypatch.delenv("FRAS_KEYS")
        assert revoked.end() == 0, revoked.text
        assert "the old ones may do nothing" in revoked.text
        deaf = ZenohBus(
            "local", f"tls/127.0.0.1:{port}", "sa/deaf", identity=identity_in(copies, "sa")
        )
        overheard: list[str] = []
        deaf.subscribe_raw("**", lambda one: overheard.append(one.key))
        heard.clear()
        assert thief.both() == [set(), set()]
        # The trial goes on with the certificates of now, and the thief hears none of it.
        resumed = fras("resume")
        assert resumed.end() == 0, resumed.text
        wait_until(lambda: len(heard) > 10, "verdicts of the true one")
        assert trial.end() == 0, trial.text
        deaf.close()
        assert overheard == []
        assert "sa/thief" not in heard
    finally:
        ear.close()
        thief.close()
