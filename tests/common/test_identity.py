"""The files that say who a process is."""

from pathlib import Path

import pytest

from fras_common.identity import BadIdentity, default_keys_dir, identity_in, require_tls


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("ca.pem", "sim.pem", "sim.key"):
        (tmp_path / name).write_text("PEM")
        (tmp_path / name).chmod(0o600)
    return tmp_path


def test_a_process_needs_three_files(folder: Path):
    identity = identity_in(folder, "sim")
    assert [identity.authority.name, identity.certificate.name, identity.key.name] == [
        "ca.pem",
        "sim.pem",
        "sim.key",
    ]


@pytest.mark.parametrize("missing", ["ca.pem", "sim.pem", "sim.key"])
def test_a_file_that_is_missing_is_named_with_what_makes_it(folder: Path, missing: str):
    (folder / missing).unlink()
    with pytest.raises(BadIdentity, match=rf"{missing}: No such file.*fras keys init"):
        identity_in(folder, "sim")


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620])
def test_a_key_that_others_may_use_is_refused(folder: Path, mode: int):
    (folder / "sim.key").chmod(mode)
    with pytest.raises(BadIdentity, match="others may use this key: `chmod 600"):
        identity_in(folder, "sim")


def test_certificates_are_never_left_unused_and_never_missing(folder: Path):
    identity = identity_in(folder, "sim")
    require_tls("tls/127.0.0.1:7447", identity)
    require_tls("tcp/127.0.0.1:7447", None)
    with pytest.raises(BadIdentity, match="tls/HOST:PORT"):
        require_tls("tcp/127.0.0.1:7447", identity)
    with pytest.raises(BadIdentity, match="--tls DIR"):
        require_tls("tls/127.0.0.1:7447", None)


def test_where_keys_are(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_DATA_HOME", raising=False)
    monkeypatch.delenv("FRAS_KEYS", raising=False)
    assert default_keys_dir() == tmp_path / ".local/share/fras/keys"
    monkeypatch.setenv("XDG_DATA_HOME", "/data")
    assert default_keys_dir() == Path("/data/fras/keys")
    monkeypatch.setenv("FRAS_KEYS", "/keys")
    assert default_keys_dir() == Path("/keys")
