"""A stack: all processes of a table, started in order of need, watched, stopped in reverse."""

import shutil
import sys
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, Self

from fras_supervisor.child import Child, Exit
from fras_supervisor.errors import (
    AlreadyStarted,
    CommandNotFound,
    LogDirUnusable,
    NotReady,
    ServiceDied,
    StartCancelled,
    TableError,
)
from fras_supervisor.guard import OrphanGuard
from fras_supervisor.logs import Echo, RotatingFile
from fras_supervisor.order import ended_before, start_order
from fras_supervisor.ports import Endpoint, accepts, require_free
from fras_supervisor.shutdown import shut_down
from fras_supervisor.table import Table, check_placeholders, expand

POLL_S: Final = 0.01

State = Literal["pending", "starting", "ready", "ended"]


@dataclass(frozen=True)
class Status:
    """Where one process stands.

    Attributes
    ----------
    name : str
        Its name in the table.
    state : {"pending", "starting", "ready", "ended"}
        Not launched yet; launched; ready; dead.
    pid : int or None
        Process id, if it was launched.
    ready_after_s : float or None [s]
        From the start of the stack until it was ready.
    log : Path
        Its newest log file.
    log_lost_bytes : int
        Output that could not be written to the log.
    """

    name: str
    state: State
    pid: int | None
    ready_after_s: float | None
    log: Path
    log_lost_bytes: int


class Stack:
    """The processes of one cell; used from one thread.

    Parameters
    ----------
    table : Table
        What to run.
    cell : str
        Value of the placeholder `{cell}`.
    connect : str
        Endpoint of the router, as `tcp/127.0.0.1:7447`; value of `{connect}`, and the port that
        a process with readiness "listening" opens.
    log_dir : Path
        Folder of the logs, made if it is not there; value of `{log_dir}`.
    alive : callable
        Gives the liveliness tokens that are there now, as `{"alive/sim", "ready/sim"}`. Called
        often, and not before a process that shows itself by a token was launched: a process
        that needs the router finds it listening.
    values : mapping of str to str, optional
        More placeholders (name them in `load_table`).
    echo : callable, optional
        Gets each line of output, for example a `Console`.
    cancelled : callable, optional
        Looked at while starting; true ends the start with `StartCancelled`. For signal handlers
        that set a flag: a KeyboardInterrupt also stops everything, but could hit anywhere.

    Raises
    ------
    TableError
        The table asks for what this supervisor can't do.
    BadEndpoint
        `connect` is not an endpoint.
    CommandNotFound
        A program is not on this machine.
    """

    def __init__(
        self,
        table: Table,
        cell: str,
        connect: str,
        log_dir: Path,
        alive: Callable[[], Collection[str]],
        *,
        values: Mapping[str, str] | None = None,
        echo: Echo | None = None,
        cancelled: Callable[[], bool] = lambda: False,
    ) -> None:
        _check_supported(table)
        self.table = table
        self.log_dir = log_dir
        self._endpoint = Endpoint.parse(connect)
        self._alive = alive
        self._echo = echo
        self._cancelled = cancelled
        self._processes = table.processes
        self._order = start_order(self._processes)
        shared = {
            **(values or {}),
            "python": sys.executable,
            "cell": cell,
            "connect": connect,
            "log_dir": str(log_dir),
        }
        for process in self._processes.values():
            check_placeholders(table.source, process, {*shared, "name"})
        self._commands = {
            name: expand(process, {**shared, "name": name})
            for name, process in self._processes.items()
        }
        for name, command in self._commands.items():
            if shutil.which(command[0]) is None:
                raise CommandNotFound(name, command[0])
        self._guard: OrphanGuard | None = None
        self._started_at: float | None = None
        self._children: dict[str, Child] = {}
        self._ready_after_s: dict[str, float] = {}

    def start(self) -> None:
        """Launch every process as soon as all that it needs is ready; return when all are.

        On any error everything that was launched is stopped before it is raised.

        Raises
        ------
        PortTaken
            Somebody listens on the router's port; nothing was started.
        LogDirUnusable
            Logs can't be written; nothing was started.
        ServiceDied
            A process ended.
        NotReady
            A process was not ready within its `ready_timeout_s`.
        StartCancelled
            `cancelled` said so.
        AlreadyStarted
            This stack was started before.
        """
        if self._started_at is not None:
            raise AlreadyStarted
        if any(process.readiness == "listening" for process in self._processes.values()):
            require_free(self._endpoint)
        try:
            self.log_dir.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LogDirUnusable(self.log_dir, str(error)) from error
        self._started_at = time.monotonic()
        try:
            self._guard = OrphanGuard(max(one.stop_timeout_s for one in self._processes.values()))
            while True:
                self._launch_what_can(self._started_at)
                waiting = self._waiting()
                if not waiting:
                    return
                if self._cancelled():
                    raise StartCancelled(waiting)
                time.sleep(POLL_S)
        except BaseException:
            self.stop()
            raise

    def watch(self, timeout_s: float = 0.0) -> tuple[Exit, ...]:
        """Give the processes that have ended; wait up to `timeout_s` for a first one."""
        deadline = time.monotonic() + timeout_s
        while True:
            ended = tuple(
                one for child in self._children.values() if (one := child.poll()) is not None
            )
            if ended or time.monotonic() >= deadline:
                return ended
            time.sleep(POLL_S)

    def stop(self) -> dict[str, Exit]:
        """Stop all that lives: SIGINT, wait, SIGTERM, wait, SIGKILL, dependents first.

        Returns
        -------
        dict of name to Exit
            How each process that had been launched ended, in that order. A second call gives
            the same again.

        Raises
        ------
        Unstoppable
            A process outlived SIGKILL.
        """
        exits = shut_down(self._children, ended_before(self._processes), POLL_S)
        if self._guard is not None:
            self._guard.dismiss()
            self._guard = None
        return exits

    def status(self) -> tuple[Status, ...]:
        """Say where each process stands, in the table's order."""
        return tuple(self._status(name) for name in self._processes)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _launch_what_can(self, started_at: float) -> None:
        """Find out who is ready now, and launch those that waited for nothing else."""
        self._mark_ready(started_at)
        for name in self._order:
            needs = self._processes[name].needs
            if name not in self._children and all(one in self._ready_after_s for one in needs):
                self._launch(name)

    def _launch(self, name: str) -> None:
        log = RotatingFile(self.log_dir / f"{name}.log")
        command = self._commands[name]
        stamp = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        log.write(f"[supervisor] {stamp} {' '.join(command)}\n".encode())
        child = Child(self._processes[name], command, log, self._echo)
        self._children[name] = child
        if self._guard is not None:
            self._guard.watch(child.pid)

    def _mark_ready(self, started_at: float) -> None:
        starting = [name for name in self._children if name not in self._ready_after_s]
        conditions = {name: self._processes[name].readiness for name in starting}
        tokens = self._alive() if {"token", "alive"} & set(conditions.values()) else ()
        for name in starting:
            if conditions[name] == "listening":
                ready = accepts(self._endpoint)
            else:
                ready = f"{'ready' if conditions[name] == 'token' else 'alive'}/{name}" in tokens
            if ready:
                self._ready_after_s[name] = time.monotonic() - started_at

    def _waiting(self) -> tuple[str, ...]:
        """Names not ready yet; raises if one of all has died or is overdue."""
        for name, child in self._children.items():
            if (ended := child.poll()) is not None:
                raise ServiceDied(name, ended.returncode, ended.last_lines)
        waiting = tuple(name for name in self._order if name not in self._ready_after_s)
        for name in waiting:
            if (child := self._children.get(name)) is not None:
                waited_s = time.monotonic() - child.launched_at
                if waited_s >= child.process.ready_timeout_s:
                    raise NotReady(name, waited_s, child.pump.last_lines(), waiting)
        return waiting

    def _status(self, name: str) -> Status:
        child = self._children.get(name)
        state: State = "pending"
        if child is not None:
            state = "ready" if name in self._ready_after_s else "starting"
            state = "ended" if child.poll() is not None else state
        return Status(
            name=name,
            state=state,
            pid=None if child is None else child.pid,
            ready_after_s=self._ready_after_s.get(name),
            log=self.log_dir / f"{name}.log",
            log_lost_bytes=0 if child is None else child.pump.file.lost_bytes,
        )


def _check_supported(table: Table) -> None:
    """Refuse what a table may say but this supervisor does not do, rather than ignore it."""
    for name, process in table.processes.items():
        if process.restart != "never":
            key = f"process.{name}.restart"
            raise TableError(table.source, key, process.restart, "never (no restarts yet)")
        if process.host != "localhost":
            key = f"process.{name}.host"
            raise TableError(table.source, key, process.host, "localhost (no other hosts yet)")
