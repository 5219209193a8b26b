"""A real trial replayed over a real router: recorded again it is the same; asked, it obeys."""

import contextlib
import os
import pty
import select
import signal
import subprocess
import sys
import uuid
from collections import defaultdict
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest

from fras_cli.options import build_scenario
from fras_cli.replay import router_of
from fras_common.bus import RemoteFault
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.codec import read_header
from fras_common.messages import (
    CloseRequest,
    Health,
    OpenRequest,
    Plan,
    ReplayControl,
    ReplayStatus,
    ReplayStatusRequest,
)
from fras_common.topics import (
    HEALTH,
    PLAN,
    RECORDER_CLOSE,
    RECORDER_OPEN,
    REPLAY_CONTROL,
    REPLAY_STATUS,
)
from fras_log.scan import Recorded, scan
from fras_replay import LiveCell

Fras = Callable[..., Any]
Wait = Callable[[Callable[[], Any], str], Any]
WAIT_S = 30.0
MESH = "11,13,2"
# On this mesh scenario B crosses it, and not its own.
LIMIT_N = 0.2
# What those say of themselves who record and replay.
OWN = {
    "health/replay", "log/replay", "health/recorder", "log/recorder", "recorder/status",
    "recorder/event",
    "rpc/recorder/open", "rpc/recorder/last",
}  # fmt: skip


@pytest.fixture(scope="session")
def recorded_trial(trials: Any) -> Path:
    """Log of a trial that crosses its limit and plans anew."""
    scenario = build_scenario("b", pace=0, mesh=MESH)
    low = msgspec.structs.replace(scenario.awareness, force_limit_n=LIMIT_N)
    folder = trials.start(msgspec.structs.replace(scenario, awareness=low))
    assert trials.follower.follow(lambda view: None, stop=lambda: False)
    return folder / "audit.mcap"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[str, str]]:
    """A cell and a router that the test owns."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    cell = f"replay-{uuid.uuid4().hex[:6]}"
    with router_of(f"{cell}-router", None, lambda: False) as connect:
        yield cell, connect


class Client:
    """Someone in the cell who asks the replay."""

    def __init__(self, cell: str, connect: str) -> None:
        self.bus = ZenohBus(cell, connect, "monitor/test")

    def tell(self, command: Any, value: float = 0.0) -> ReplayStatus:
        return self.bus.query(REPLAY_CONTROL, ReplayControl(command=command, value=value), WAIT_S)

    def status(self, marks: bool = False) -> ReplayStatus:
        return self.bus.query(REPLAY_STATUS, ReplayStatusRequest(marks=marks), WAIT_S)


@pytest.fixture
def client(place: tuple[str, str]) -> Iterator[Client]:
    client = Client(*place)
    yield client
    client.bus.close()


@contextmanager
def recorder(cell: str, connect: str) -> Generator[subprocess.Popen[bytes]]:
    command = [sys.executable, "-m", "fras_recorder", "--cell", cell, "--connect", connect]
    process = subprocess.Popen([*command, "--log-level", "ERROR"])
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 0


def messages_of(log: Path) -> dict[str, list[bytes]]:
    found: defaultdict[str, list[bytes]] = defaultdict(list)
    for event in scan(log):
        if isinstance(event, Recorded):
            found[event.topic].append(event.payload)
    return dict(found)


def sources_of(messages: dict[str, list[bytes]]) -> set[str]:
    headers = [read_header(payload) for payloads in messages.values() for payload in payloads]
    return {header.source for header in headers if header is not None}


def test_a_record_of_a_replay_is_the_record_of_the_trial(
    recorded_trial: Path, fras: Fras, place: tuple[str, str], client: Client, tmp_path: Path,
    wait_until: Wait,
) -> None:  # fmt: skip
    cell, connect = place
    original = messages_of(recorded_trial)
    with recorder(cell, connect):
        wait_until(lambda: any("recorder" in t for t in client.bus.tokens(WAIT_S)), "the recorder")
        opened = OpenRequest(
            trial="trial-again",
            scenario=build_scenario("b", mesh=MESH),
            mesh=b"",
            directory=str(tmp_path),
        )
        client.bus.query(RECORDER_OPEN, opened, WAIT_S)
        command = fras(
            "replay", str(recorded_trial), "--cell", cell, "--connect", connect,
            "--as-fast-as-possible", "--stay",
        )  # fmt: skip
        again = tmp_path / "audit.mcap"
        total = sum(map(len, original.values()))
        wait_until(lambda: sum(map(len, messages_of(again).values())) >= total, "all recorded")
        closed = CloseRequest(trial="trial-again", last_tick=-1, status_seq=-1)
        assert client.bus.query(RECORDER_CLOSE, closed, WAIT_S).lost == 0
        command.process.send_signal(signal.SIGINT)
        assert command.end() == 0
    replayed = messages_of(again)
    known = sources_of(original)
    for key, payloads in list(replayed.items()):
        replayed[key] = [
            payload
            for payload in payloads
            if (header := read_header(payload)) is None or header.source in known
        ]
        if len(replayed[key]) < len(payloads):
            assert key in OWN
    assert {key: len(one) for key, one in replayed.items() if one} == {
        key: len(one) for key, one in original.items()
    }
    assert {key: one for key, one in replayed.items() if one} == original


def test_it_obeys_while_it_runs(
    recorded_trial: Path, fras: Fras, place: tuple[str, str], client: Client, wait_until: Wait
) -> None:
    cell, connect = place
    health: list[Health] = []
    client.bus.subscribe(HEALTH.of(service="replay"), health.append)
    command = fras("replay", str(recorded_trial), "--cell", cell, "--connect", connect, "--paused")
    command.until("replaying")
    wait_until(lambda: any("ready/replay" in t for t in client.bus.tokens(WAIT_S)), "ready")
    told = client.status(marks=True)
    assert (told.phase, told.messages, told.tick) == ("paused", 0, -1)
    kinds = [mark.kind for mark in told.marks]
    assert {"plan", "crossing", "re_plan", "action_start", "action_end", "ended"} <= set(kinds)
    assert client.tell("step").tick == 0
    assert client.tell("step").tick == 1
    assert client.tell("back").tick == 0

    plan = kinds.index("re_plan")
    jumped = client.tell("seek_mark", plan)
    assert jumped.mark == plan
    assert jumped.position_s == told.marks[plan].position_s
    late: list[Plan] = []
    client.bus.subscribe(PLAN, late.append)
    wait_until(lambda: late, "the plan")
    assert late[0].reason == told.marks[plan].text.partition(":")[0] != "initial"

    assert client.tell("rate", 100.0).phase == "paused"
    assert client.tell("seek_tick", 50).tick == 50
    with pytest.raises(RemoteFault, match=r"0\.1 to 100"):
        client.tell("rate", 1e9)
    wait_until(lambda: health, "health")
    assert all(one.state.startswith("replay: ") for one in health)
    client.tell("play")
    assert command.end() == 0
    assert "ended at" in command.text


def test_a_live_cell_and_a_second_replay_are_refused(
    recorded_trial: Path, trials: Any, fras: Fras, place: tuple[str, str], client: Client
) -> None:
    stack = trials.stack.link
    live = fras("replay", str(recorded_trial), "--cell", stack.cell, "--connect", stack.connect)
    assert live.end() == 3
    for service in ("sim", "sa", "motion", "planner"):
        assert f"{service}/" in live.text
    cell, connect = place
    first = fras("replay", str(recorded_trial), "--cell", cell, "--connect", connect, "--paused")
    first.until("replaying")
    assert client.status().phase == "paused"
    second = fras("replay", str(recorded_trial), "--cell", cell, "--connect", connect)
    assert second.end() == 3
    assert "replay/" in second.text
    assert first.process.poll() is None, first.text
    assert client.status().messages == 0
    assert client.tell("stop").phase == "paused"
    assert first.end() == 0


def test_it_ends_when_a_service_comes(
    recorded_trial: Path, fras: Fras, place: tuple[str, str], client: Client
) -> None:
    cell, connect = place
    command = fras("replay", str(recorded_trial), "--cell", cell, "--connect", connect, "--loop")
    command.until("replaying")
    assert client.status().phase == "playing"
    newcomer = ZenohBus(cell, connect, "motion/new")
    try:
        newcomer.announce("alive/motion")
        assert command.end() == 3
        assert "motion/new" in command.text
    finally:
        newcomer.close()


def test_a_log_that_was_cut_is_replayed_as_far_as_it_goes(
    recorded_trial: Path, fras: Fras, tmp_path: Path
) -> None:
    whole = recorded_trial.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    command = fras("replay", "cut.mcap", "--as-fast-as-possible")
    assert command.end() == 0
    assert "cut.mcap is damaged: offset" in command.text
    count = sum(map(len, messages_of(tmp_path / "cut.mcap").values()))
    assert f"{count} of {count} messages" in command.text


def test_killed_it_leaves_no_process(
    recorded_trial: Path, fras: Fras, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    wait_until: Wait,
) -> None:  # fmt: skip
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    command = fras("replay", str(recorded_trial), "--loop")
    command.until("replaying")
    assert any("fras_common.router" in one.cmdline() for one in command.note_family())
    # Beside it, with a router of its own, another one would have the cell to itself.
    with pytest.raises(LiveCell, match=f"process {command.process.pid} "):
        router_of("replay", None, lambda: False).__enter__()
    os.kill(command.process.pid, signal.SIGKILL)
    command.end()
    wait_until(command.alone, "all processes gone")


class Terminal:
    """A `fras` command on a terminal of its own."""

    def __init__(self, *arguments: str) -> None:
        self.pid, self._fd = pty.fork()
        if self.pid == 0:
            os.execv(sys.executable, [sys.executable, "-m", "fras_cli", *arguments])
        self._text = b""

    def until(self, words: str) -> None:
        """Wait until `words` have been shown since the last call."""
        wanted = words.encode()
        while wanted not in self._text:
            readable = select.select([self._fd], [], [], WAIT_S)[0]
            assert readable, f"never showed {words!r}: {self._text[-500:]!r}"
            self._text += os.read(self._fd, 4096)
        self._text = self._text[self._text.index(wanted) + len(wanted) :]

    def press(self, keys: str) -> None:
        os.write(self._fd, keys.encode())

    def end(self) -> int:
        """Wait for its end, reading what it still says."""
        with contextlib.suppress(OSError):  # what Linux gives at the end of a terminal
            while os.read(self._fd, 4096):
                pass
        os.close(self._fd)
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


def test_keys_of_the_terminal(
    recorded_trial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("COLUMNS", "160")
    terminal = Terminal("replay", str(recorded_trial), "--paused", "--cell", "keys")
    terminal.until("space play/pause")
    terminal.until("paused 0.00 s")
    terminal.press("n")
    terminal.until("tick 0 of ")
    terminal.press("\x1b[C")
    terminal.until("tick 1 of ")
    terminal.press("p")
    terminal.until("tick 0 of ")
    terminal.press("]]")
    terminal.until("| action_")
    terminal.press("[")
    terminal.until("| ")
    terminal.press("-")
    terminal.until("rate 0.5")
    terminal.press(" ")
    terminal.until("playing")
    terminal.press("q")
    terminal.until(" messages")
    assert terminal.end() == 0
