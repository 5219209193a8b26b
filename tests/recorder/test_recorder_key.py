"""A recorder process without a key it can sign with refuses to start, by name."""

import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.bus.zenoh_router import route
from fras_common.messages import RecorderStatus
from fras_common.topics import RECORDER_STATUS

WAIT_S = 20.0


@pytest.fixture
def endpoint() -> Iterator[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    end = threading.Event()
    thread = threading.Thread(target=route, args=([endpoint], end.wait))
    thread.start()
    yield endpoint
    end.set()
    thread.join(WAIT_S)


def recorder(endpoint: str, *options: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "fras_recorder", "--connect", endpoint, "--cell", "key", *options],
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"FRAS_PARENT": "stdin"},
    )


@pytest.fixture
def damaged_key(tmp_path: Path) -> Path:
    path = tmp_path / "log.key"
    path.touch(0o600)
    return path


def test_it_refuses_to_start(endpoint: str, damaged_key: Path):
    with recorder(endpoint, "--key", str(damaged_key)) as process:
        _, said = process.communicate(timeout=WAIT_S)
    assert process.returncode == 3
    assert f"fras recorder: {damaged_key}: no key to sign logs with" in said
    assert "Traceback" not in said


def test_without_signing_it_needs_none(endpoint: str, damaged_key: Path):
    started = threading.Event()

    def hear(status: RecorderStatus) -> None:
        if status.state == "idle":
            started.set()

    bus = ZenohBus("key", endpoint, "cli/1", open_timeout_s=WAIT_S)
    try:
        bus.subscribe(RECORDER_STATUS, hear)
        with recorder(endpoint, "--key", str(damaged_key), "--sign", "no") as process:
            assert started.wait(WAIT_S)
            process.terminate()
            process.communicate(timeout=WAIT_S)
            assert process.returncode == 0
    finally:
        bus.close()
