"""The router as a process: it routes, it stops clean, it names a port that is taken."""

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from fras_common import router
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.messages import RecorderStatus
from fras_common.topics import RECORDER_STATUS


@pytest.fixture
def endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def process(endpoint: str) -> Iterator[subprocess.Popen[str]]:
    started = subprocess.Popen(
        [sys.executable, "-m", "fras_common.router", "--listen", endpoint],
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"FRAS_PARENT": "stdin"},
    )
    with started:
        yield started
        started.kill()


def open_bus(endpoint: str, source: str) -> ZenohBus:
    """The bus itself waits for the router to listen."""
    return ZenohBus("router", endpoint, source, open_timeout_s=20.0)


def test_it_carries_messages_and_stops_clean_on_sigint(
    process: subprocess.Popen[str], endpoint: str
):
    heard, seen = threading.Event(), list[RecorderStatus]()

    def hear(message: RecorderStatus) -> None:
        seen.append(message)
        heard.set()

    here, there = open_bus(endpoint, "recorder/1"), open_bus(endpoint, "cli/1")
    try:
        there.subscribe(RECORDER_STATUS, hear)
        sent = here.publisher(RECORDER_STATUS).put(
            RecorderStatus(state="idle", path="", messages=1, bytes=2, lost=0, reason="")
        )
        assert heard.wait(10.0)
        assert seen == [sent]
    finally:
        here.close()
        there.close()
    process.send_signal(signal.SIGINT)
    assert process.wait(20) == 0
    assert process.stderr is not None
    assert "Traceback" not in process.stderr.read()


def test_it_ends_with_the_one_that_started_it(process: subprocess.Popen[str], endpoint: str):
    open_bus(endpoint, "cli/1").close()
    assert process.stdin is not None
    process.stdin.close()
    process.stdin = None
    assert process.wait(20) == 0


def test_a_taken_port_is_named_and_ends_with_3(endpoint: str):
    host, _, port = endpoint.removeprefix("tcp/").partition(":")
    with socket.socket() as squatter:
        squatter.bind((host, int(port)))
        squatter.listen()
        ended = subprocess.run(
            [sys.executable, "-m", "fras_common.router", "--listen", endpoint],
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
        )
    assert ended.returncode == 3
    assert f"can't listen on {endpoint}" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_an_impossible_endpoint_ends_with_3(capfd: pytest.CaptureFixture[str]):
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        assert router.main(["--listen", "nonsense"]) == 3
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    assert "nonsense" in capfd.readouterr().err
