"""The stack of `compose/two-hosts.toml` on two hosts of one machine, as its users start it."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final, Protocol, Self

START_S: Final = 60.0
TRIAL_S: Final = 120.0
LOOK_S: Final = 0.02
READY: Final = "the services of all hosts are ready"
HOSTS: Final = ("A", "B")


class Network(Protocol):
    """What lies between the hosts."""

    def command(self, host: str, *words: str) -> list[str]:
        """Make a command that runs on a host."""
        ...

    def options(self, host: str) -> list[str]:
        """Tell `fras up` on a host where it and the other are."""
        ...


class Program:
    """A `fras` command under way on a host, and what it has printed."""

    def __init__(
        self,
        network: Network,
        host: str,
        folder: Path,
        arguments: Sequence[str],
        environment: Mapping[str, str],
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._output = folder / f"{arguments[0]}-{time.monotonic_ns()}.txt"
        with self._output.open("wb") as sink:
            self.process = subprocess.Popen(
                network.command(host, sys.executable, "-m", "fras_cli", *arguments),
                cwd=folder,
                # Each host has a folder of its own for what runs on it.
                env={
                    **os.environ,
                    **environment,
                    "XDG_RUNTIME_DIR": str(folder),
                    "COLUMNS": "200",
                },
                stdin=subprocess.DEVNULL,
                stdout=sink,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def text(self) -> str:
        """What it has printed."""
        return self._output.read_text()

    def until(self, words: str, times: int = 1, timeout_s: float = START_S) -> None:
        """Wait until it has printed `words` so many times."""
        deadline_s = time.monotonic() + timeout_s
        while self.text.count(words) < times:
            if self.process.poll() is not None or time.monotonic() > deadline_s:
                raise AssertionError(f"it did not say {words!r}:\n{self.text}")
            time.sleep(LOOK_S)

    def end(self) -> int:
        """Wait for its end; gives its exit status."""
        return self.process.wait(TRIAL_S)

    def kill(self) -> None:
        """End it if it still runs."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()


class TwoHosts:
    """`fras up` on both hosts within a `with` block, and commands to them.

    Parameters
    ----------
    network : Network
    folder : Path
        Each host gets one below it.
    secure : bool
        With certificates, as a user gets them from one host to the other.
    """

    def __init__(self, network: Network, folder: Path, *, secure: bool = False) -> None:
        self._network = network
        self._folder = folder
        self._secure = secure
        self._left = ExitStack()
        self.up: dict[str, Program] = {}

    def start(self, host: str, *arguments: str) -> Program:
        """Begin a command on a host."""
        environment = {"FRAS_KEYS": str(self.keys(host))}
        program = Program(self._network, host, self._folder / host, arguments, environment)
        self._left.callback(program.kill)
        return program

    def bring_up(self, host: str) -> Program:
        """Start a host's part, and wait until it is ready."""
        options = [*self._network.options(host), *(["--secure"] if self._secure else [])]
        if self._secure and host != HOSTS[0]:
            self.hand_on_keys(host)
        self.up[host] = self.start(host, "up", "--compose", "two-hosts", "--host", host, *options)
        self.up[host].until(f"host {host}: ready after")
        return self.up[host]

    def run(self, scenario: str, out: str, *options: str) -> dict[str, Any]:
        """Run a trial from host A; gives its summary."""
        program = self.start("A", "run", scenario, "--json", "--out", out, *options)
        program.end()
        return summary_of(program)

    def keys(self, host: str) -> Path:
        """Folder of a host's certificates."""
        return self._folder / host / "keys"

    def hand_on_keys(self, host: str) -> None:
        """Give a host what it needs, from the one that makes certificates."""
        shutil.rmtree(self.keys(host), ignore_errors=True)
        exported = self.start(HOSTS[0], "keys", "export", host, "--out", str(self.keys(host)))
        if exported.end() != 0:
            raise AssertionError(exported.text)

    def log(self, out: str) -> Path:
        """Path of a trial's log."""
        return self._folder / "A" / out / "audit.mcap"

    def __enter__(self) -> Self:
        try:
            for host in HOSTS:
                self.bring_up(host)
            for host in HOSTS:
                self.up[host].until(READY)
        except BaseException:
            self._left.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        # Who computes goes first: the recorder, on A, hears its last words.
        for host in reversed(HOSTS):
            self.up[host].process.terminate()
            self.up[host].end()
        self._left.close()


def summary_of(program: Program) -> dict[str, Any]:
    """Parse the summary that `fras run --json` has printed."""
    lines = [line for line in program.text.splitlines() if line.startswith("{")]
    if not lines:
        raise AssertionError(f"no summary:\n{program.text}")
    return json.loads(lines[-1])
