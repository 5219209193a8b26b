"""A stack: all processes of a table, started in order of need, kept, stopped in reverse."""

import random
import shutil
import sys
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final, Self

from fras_common.errors import FrasError
from fras_supervisor.child import Child, Exit
from fras_supervisor.errors import (
    AlreadyStarted,
    CommandNotFound,
    LogDirUnusable,
    NotReady,
    OnOtherHost,
    ServiceDied,
    StartCancelled,
    UnknownProcess,
)
from fras_supervisor.extras import require_installed
from fras_supervisor.guard import OrphanGuard
from fras_supervisor.hosts import placeholder, require_here
from fras_supervisor.limits import apply_limits
from fras_supervisor.logs import Echo, RotatingFile
from fras_supervisor.member import Event, Member, State
from fras_supervisor.order import ended_before, start_order
from fras_supervisor.ports import Endpoint, accepts, require_free
from fras_supervisor.shutdown import shut_down
from fras_supervisor.table import Table, check_placeholders, expand

POLL_S: Final = 0.01
GONE: Final = ("ended", "given_up")


@dataclass(frozen=True)
class Status:
    """Where one process stands.

    Attributes
    ----------
    name : str
        Its name in the table.
    state : str
        See `fras_common.messages.ProcessReport`.
    pid : int or None
        Process id of its newest life, if it was launched.
    ready_after_s : float or None [s]
        From the start of the stack until its newest life was ready.
    log : Path
        Its newest log file.
    log_lost_bytes : int
        Output of its newest life that could not be written to the log.
    restarts : int
        How often it was started again.
    last_exit : str
        How it last ended, in words; empty if it never did.
    reason : str
        Why it stands where it stands, if that is no good place.
    starts_in_s, up_s : float [s]
        What is left of its back-off, and since when it lives; 0 else.
    """

    name: str
    state: State
    pid: int | None
    ready_after_s: float | None
    log: Path
    log_lost_bytes: int
    restarts: int
    last_exit: str
    reason: str
    starts_in_s: float
    up_s: float


class Stack:
    """The processes of one cell; used from one thread at a time.

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
    chance : callable, optional
        From 0 to 1, for the back-off.

    Raises
    ------
    TableError
        The table asks for what this supervisor can't do.
    BadEndpoint
        `connect` is not an endpoint.
    CommandNotFound
        A program is not on this machine.
    MissingExtra
        The libraries of a service are not installed.
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
        chance: Callable[[], float] = random.random,
    ) -> None:
        for process in table.processes.values():
            require_here(table.source, process)
        self.table = table
        self.log_dir = log_dir
        self._endpoint = Endpoint.parse(connect)
        self._reached_at = Endpoint.parse((values or {}).get(placeholder(table.here), connect))
        self._alive = alive
        self._echo = echo
        self._cancelled = cancelled
        self._processes = table.processes
        shared = {
            **(values or {}),
            "python": sys.executable,
            "cell": cell,
            "connect": connect,
            "log_dir": str(log_dir),
        }
        for process in self._processes.values():
            check_placeholders(table.source, process, {*shared, "name"})
        commands = {
            name: expand(process, {**shared, "name": name})
            for name, process in self._processes.items()
        }
        for name, command in commands.items():
            if shutil.which(command[0]) is None:
                raise CommandNotFound(name, command[0])
            if command[0] == sys.executable:
                require_installed(name, command)
        self._members = {
            name: Member(
                self._processes[name], partial(self._launched, name, commands[name]), chance
            )
            for name in start_order(self._processes)
        }
        self._guard: OrphanGuard | None = None
        self._started_at: float | None = None
        self._stopping = False

    def start(self) -> None:
        """Launch every process as soon as all that it needs is ready; return when all are.

        Nothing is started again here: who can't start the first time is a mistake to be told. On
        any error everything that was launched is stopped before it is raised.

        Raises
        ------
        AddressNotHere, PortTaken
            Somebody listens on the router's port, or it is of another machine; nothing was started.
        LogDirUnusable
            Logs can't be written; nothing was started.
        ServiceDied
            A process ended.
        NotReady
            A process was not ready within its `ready_timeout_s`.
        LimitRefused
            A limit can't be set.
        StartCancelled
            `cancelled` said so.
        AlreadyStarted
            This stack was started before.
        """
        if self._started_at is not None:
            raise AlreadyStarted
        if any(process.readiness == "listening" for process in self._processes.values()):
            require_free(self._endpoint)
            require_free(self._reached_at)
        try:
            self.log_dir.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LogDirUnusable(self.log_dir, str(error)) from error
        self._started_at = time.monotonic()
        try:
            self._guard = self._new_guard()
            while True:
                self._mark_ready()
                for member in self._due(time.monotonic()):
                    self._launch(member, stale=False)
                waiting = self._waiting()
                if not waiting:
                    return
                if self._cancelled():
                    raise StartCancelled(waiting)
                time.sleep(POLL_S)
        except BaseException:
            self.stop()
            raise

    def turn(self) -> list[Event]:
        """Do what is due: see who has ended, who is ready, and start again who may be.

        To be called often once the stack has started. Returns what there is to tell.
        """
        if self._stopping:
            return []
        now_s = time.monotonic()
        told = [member.kill_if_overdue(now_s) for member in self._members.values()]
        told += [member.reap(now_s) for member in self._members.values()]
        told += self._mark_ready()
        for member in self._members.values():
            member.urge()
        self._keep_guard()
        told += [self._launch_again(member) for member in self._due(now_s)]
        return [event for event in told if event is not None]

    def kill(self, name: str, why: str) -> Event | None:
        """End a process at once, as a failure of its own; nothing if it does not live."""
        return self._member(name).kill(why)

    def restart(self, name: str) -> Event:
        """Order a restart, also of a process that was given up.

        Raises
        ------
        OnOtherHost, UnknownProcess
        """
        return self._member(name).restart(time.monotonic())

    def watch(self, timeout_s: float = 0.0) -> tuple[Exit, ...]:
        """Turn for up to `timeout_s`, until some have gone for good; tell how those ended."""
        deadline = time.monotonic() + timeout_s
        while True:
            self.turn()
            gone = self.gone()
            if gone or time.monotonic() >= deadline:
                return gone
            time.sleep(POLL_S)

    def gone(self) -> tuple[Exit, ...]:
        """Tell how those ended that will not be started again."""
        children = (one.child for one in self._members.values() if one.state in GONE)
        return tuple(one.exit for one in children if one is not None and one.exit is not None)

    def stop(self) -> dict[str, Exit]:
        """Stop all that lives: SIGINT, wait, SIGTERM, wait, SIGKILL, dependents first.

        Nothing is started again from here on, whatever ends meanwhile.

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
        self._stopping = True
        children = {
            name: one.child for name in self._processes if (one := self._members[name]).child
        }
        exits = shut_down(children, ended_before(self._processes), POLL_S)
        for member in self._members.values():
            member.has_stopped()
        if self._guard is not None:
            self._guard.dismiss()
            self._guard = None
        return exits

    def status(self) -> tuple[Status, ...]:
        """Say where each process stands, in the table's order."""
        return tuple(self._status(self._members[name]) for name in self._processes)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _member(self, name: str) -> Member:
        if (host := self.table.elsewhere.get(name)) is not None:
            raise OnOtherHost(name, host)
        if name not in self._members:
            raise UnknownProcess(name, tuple(self._processes))
        return self._members[name]

    def _due(self, now_s: float) -> list[Member]:
        """Those whose time has come, and who need nobody who is not ready."""
        return [
            member
            for member in self._members.values()
            if (member.state == "pending" or (member.state == "waiting" and now_s >= member.due_s))
            and all(self._members[need].state == "ready" for need in member.process.needs)
        ]

    def _launched(self, name: str, command: tuple[str, ...]) -> Child:
        log = RotatingFile(self.log_dir / f"{name}.log")
        stamp = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        log.write(f"[supervisor] {stamp} {' '.join(command)}\n".encode())
        return Child(self._processes[name], command, log, self._echo)

    def _launch(self, member: Member, stale: bool) -> None:
        member.launch(stale)
        if member.child is not None:
            if self._guard is not None:
                self._guard.watch(member.child.pid)
            apply_limits(member.process, member.child.pid)

    def _new_guard(self) -> OrphanGuard:
        return OrphanGuard(max(one.stop_timeout_s for one in self._processes.values()))

    def _keep_guard(self) -> None:
        """Put another guard in the place of one that somebody ended."""
        if self._guard is not None and not self._guard.is_alive:
            self._guard.dismiss()
            self._guard = self._new_guard()
            for member in self._members.values():
                if member.child is not None and member.is_living:
                    self._guard.watch(member.child.pid)

    def _launch_again(self, member: Member) -> Event | None:
        try:
            self._launch(member, stale=self._condition(member, self._tokens([member])))
        except FrasError as error:
            # Its program or its log has gone, and no later try can mend that.
            return member.give_up(str(error))
        return None

    def _tokens(self, members: Collection[Member]) -> Collection[str]:
        told_by_token = any(one.process.readiness in ("token", "alive") for one in members)
        return self._alive() if told_by_token else ()

    def _condition(self, member: Member, tokens: Collection[str]) -> bool:
        if member.process.readiness == "listening":
            return accepts(self._endpoint)
        kind = "ready" if member.process.readiness == "token" else "alive"
        return f"{kind}/{member.name}" in tokens

    def _mark_ready(self) -> list[Event | None]:
        starting = [member for member in self._members.values() if member.state == "starting"]
        tokens = self._tokens(starting)
        started_s = self._started_at or 0.0
        return [
            member.look(self._condition(member, tokens), time.monotonic(), started_s)
            for member in starting
        ]

    def _waiting(self) -> tuple[str, ...]:
        """Names not ready yet; raises if one of all has died or is overdue."""
        for name, member in self._members.items():
            if member.child is not None and (ended := member.child.poll()) is not None:
                raise ServiceDied(name, ended.returncode, ended.last_lines)
        waiting = {name: one for name, one in self._members.items() if one.state != "ready"}
        for name, member in waiting.items():
            if (child := member.child) is not None:
                waited_s = time.monotonic() - child.launched_at
                if waited_s >= child.process.ready_timeout_s:
                    raise NotReady(name, waited_s, child.pump.last_lines(), tuple(waiting))
        return tuple(waiting)

    def _status(self, member: Member) -> Status:
        child = member.child
        return Status(
            name=member.name,
            state=member.state,
            pid=None if child is None else child.pid,
            ready_after_s=member.ready_after_s,
            log=self.log_dir / f"{member.name}.log",
            log_lost_bytes=0 if child is None else child.pump.file.lost_bytes,
            restarts=member.restarts,
            last_exit=member.last_exit,
            reason="" if member.state == "ready" else member.reason,
            starts_in_s=member.waiting_s(time.monotonic()),
            up_s=member.up_s(),
        )
