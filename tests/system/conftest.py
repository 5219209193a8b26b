"""Real processes over a local router: one shared stack, and the `fras` command itself."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil
import pytest

from fras_cli.app import main
from fras_cli.layout import Layout
from fras_cli.options import build_trial
from fras_cli.report import Summary, read_trial, summarise
from fras_cli.stack import UsedStack, own_stack
from fras_cli.trial import TrialFollower, TrialView
from fras_common.scenario import Scenario

FRAS = [sys.executable, "-m", "fras_cli"]
PATIENCE_S = 60.0


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if "tests/system/" in str(item.path):
            item.add_marker(pytest.mark.system)


def eventually(condition: Callable[[], Any], what: str = "") -> Any:
    """Wait until `condition` gives something true, and return that."""
    deadline_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline_s:
        if found := condition():
            return found
        time.sleep(0.01)  # the interval between two looks, not the wait itself
    raise AssertionError(f"not within {PATIENCE_S} s: {what or condition}")


@pytest.fixture(scope="session")
def wait_until() -> Callable[[Callable[[], Any], str], Any]:
    """Wait until a condition gives something true."""
    return eventually


class Trials:
    """Runs trials through one stack that stays."""

    def __init__(self, stack: UsedStack, folder: Path) -> None:
        self.stack = stack
        self.follower = TrialFollower(stack)
        self._folder = folder
        self._count = 0
        self._kept: dict[Any, tuple[Summary, Path]] = {}

    def start(self, scenario: Scenario, mesh: bytes = b"", into: Path | None = None) -> Path:
        """Begin a trial; returns its folder."""
        self._count += 1
        folder = (into or self._folder) / f"trial-{self._count}"
        self.follower.start(f"trial-{self._count}", scenario, folder, mesh)
        return folder

    def run(
        self,
        name: str,
        look: Callable[[TrialView], None] = lambda view: None,
        pace: float = 0,
        **options: Any,
    ) -> tuple[Summary, Path]:
        """Run a trial to its end; returns its summary and its log."""
        trial = build_trial(name, pace=pace, **options)
        folder = self.start(trial.scenario, trial.mesh)
        assert self.follower.follow(look, stop=lambda: False)
        log = folder / "audit.mcap"
        return summarise(read_trial(log)), log

    def kept(self, name: str, **options: Any) -> tuple[Summary, Path]:
        """Run a trial that nobody disturbs, once for all tests that only read what it left."""
        key = (name, *sorted(options.items()))
        if key not in self._kept:
            self._kept[key] = self.run(name, **options)
        return self._kept[key]


@pytest.fixture(scope="session")
def trials(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Trials]:
    """Run trials through a stack that all tests of a session share."""
    folder = tmp_path_factory.mktemp("stack")
    with own_stack("system-tests", None, folder / "logs") as stack:
        yield Trials(stack, folder)


@pytest.fixture(scope="session")
def quiet(trials: Trials) -> Path:
    """Log of a small trial that nothing happened to; the same on any stack."""
    return trials.kept("a", mesh="11,13,2")[1]


@pytest.fixture(scope="module")
def secure_trials(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Trials]:
    """Run trials through a stack with certificates, made as it starts."""
    folder = tmp_path_factory.mktemp("secure")
    layout = Layout(keys=folder / "keys")
    with own_stack("secure-tests", None, folder / "logs", layout=layout) as stack:
        yield Trials(stack, folder)


class Command:
    """A `fras` command under way, in its own session, with its own runtime folder."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.output = folder / f"{arguments[0]}-output.txt"
        environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), "COLUMNS": "200"}
        with self.output.open("wb") as sink:
            self.process = subprocess.Popen(
                [*FRAS, *arguments],
                cwd=folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=sink,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self.family: list[psutil.Process] = []

    @property
    def text(self) -> str:
        return self.output.read_text()

    def until(self, words: str) -> None:
        """Wait until the command has printed `words`."""

        def said() -> bool:
            if self.process.poll() is not None and words not in self.text:
                raise AssertionError(f"ended before it said {words!r}:\n{self.text}")
            return words in self.text

        eventually(said, words)

    def note_family(self) -> list[psutil.Process]:
        """Remember every process that descends from the command."""
        self.family = psutil.Process(self.process.pid).children(recursive=True)
        return self.family

    def end(self) -> int:
        return self.process.wait(PATIENCE_S)

    def alone(self) -> bool:
        """Whether none of the remembered processes is left."""
        return not [one for one in self.family if one.is_running() and one.status() != "zombie"]


@pytest.fixture
def fras(tmp_path: Path) -> Iterator[Callable[..., Command]]:
    """Start `fras` commands; what a test leaves behind is killed."""
    started: list[Command] = []

    def start(*arguments: str) -> Command:
        started.append(Command(tmp_path, *arguments))
        return started[-1]

    yield start
    for command in started:
        if command.process.poll() is None:
            command.process.kill()
            command.process.wait()


@dataclass(frozen=True)
class Ended:
    """How a command ended, and what it said to the terminal."""

    status: int
    text: str


@pytest.fixture
def fras_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., Ended]:
    """Run a `fras` command in this process, where the promise is not about a process."""
    for name, value in {"XDG_RUNTIME_DIR": str(tmp_path), "COLUMNS": "200"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> Ended:
        monkeypatch.setattr(sys, "argv", ["fras", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        return Ended(int(ended.value.code or 0), said.out + said.err)

    return run


def last_json(text: str) -> dict[str, Any]:
    """Parse the last JSON object that a command printed."""
    return json.loads([line for line in text.splitlines() if line.startswith("{")][-1])
