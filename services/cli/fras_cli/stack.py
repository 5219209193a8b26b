"""Which stack a command talks to: one that runs already, or one of its own."""

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fras_cli import runtime
from fras_cli.link import Link
from fras_common.errors import FrasError
from fras_supervisor import Endpoint, Exit, Stack, Table, find_table, free_port, load_table
from fras_supervisor.logs import Echo

COMPLETE_TIMEOUT_S = 5.0
ABSENCE_S = 3.0
PATIENCE_S = 3.0


class OtherRules(FrasError):
    """Rules or processes were asked for of a stack that has its own. Attributes: ``cell``."""


@dataclass(frozen=True)
class Layout:
    """What an own stack consists of.

    Attributes
    ----------
    compose : str
        Process table: `compose/<name>.toml`, or a file.
    asp_dir : Path or None
        Rules for the planner other than those that came with FRAS.
    """

    compose: str = "local"
    asp_dir: Path | None = None

    def table(self) -> Table:
        """Read the process table.

        Raises
        ------
        TableError
        """
        path = Path(self.compose)
        table = load_table(path if path.suffix == ".toml" else find_table(self.compose))
        if self.asp_dir is not None:
            table = table.with_arguments("planner", "--asp-dir", str(self.asp_dir.resolve()))
        return table

    def in_words(self) -> str:
        """Options that ask for it; empty for the usual one."""
        asked = [] if self.compose == "local" else [f"--compose {self.compose}"]
        return " ".join([*asked, *([f"--asp-dir {self.asp_dir}"] if self.asp_dir else [])])


USUAL = Layout()


class StackIncomplete(FrasError):
    """A stack is there, but some of its services are not ready."""


@dataclass(frozen=True)
class UsedStack:
    """A stack that is ready.

    Attributes
    ----------
    link : Link
    started_ns : int
        When its start began, or 0 if it ran before.
    log_dir : Path or None
        Where its services log, if that is on this machine.
    own : bool
        Whether this command started it.
    watch : callable
        What of the stack has gone, in words; empty while all is there.
    """

    link: Link
    started_ns: int
    log_dir: Path | None
    own: bool
    watch: Callable[[], str]


def in_words(ended: tuple[Exit, ...]) -> str:
    """Tell which processes have ended, and with what last words."""
    return "; ".join(
        f"{one.name} ended with status {one.returncode}"
        + (f": {one.last_lines[-1]}" if one.last_lines else "")
        for one in ended
    )


class Absence:
    """Watches a stack that others keep: a service that stays away has gone.

    Parameters
    ----------
    link : Link
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._since_s: float | None = None

    def look(self) -> str:
        """Name the services that have been away for too long; empty while all are there."""
        missing = self._link.missing()
        if not missing:
            self._since_s = None
            return ""
        now_s = time.monotonic()
        self._since_s = self._since_s or now_s
        gone = now_s - self._since_s >= ABSENCE_S
        return f"{', '.join(missing)} of cell {self._link.cell} have gone" if gone else ""


@contextmanager
def own_stack(
    cell: str,
    connect: str | None,
    log_dir: Path,
    cancelled: Callable[[], bool] = lambda: False,
    echo: Echo | None = None,
    tell: Callable[[str], None] | None = None,
    layout: Layout = USUAL,
) -> Generator[UsedStack]:
    """Start a stack, and stop it whatever happens.

    Parameters
    ----------
    cell : str
    connect : str or None
        Endpoint of its router; a free port on the loopback if None.
    log_dir : Path
    cancelled : callable
        True ends the start.
    echo : callable, optional
        Gets each line that a service logs.
    tell : callable, optional
        Gets who is waited for, in words, when the start takes long.
    layout : Layout
        What it consists of.

    Raises
    ------
    TableError
        The process table is not to be used.
    """
    table = layout.table()
    started_ns = time.time_ns()
    endpoint = connect or f"tcp/127.0.0.1:{free_port()}"
    with Link(cell, endpoint) as link:
        watched = told_when_slow(link, cancelled, tell) if tell else cancelled
        stack = Stack(table, cell, endpoint, log_dir, link.tokens, cancelled=watched, echo=echo)
        stack.start()
        try:
            yield UsedStack(
                link, started_ns, log_dir, own=True, watch=lambda: in_words(stack.watch())
            )
        finally:
            try:
                link.close()
            finally:
                stack.stop()


def told_when_slow(
    link: Link, cancelled: Callable[[], bool], tell: Callable[[str], None]
) -> Callable[[], bool]:
    """Return `cancelled`, which also tells, once, who is not ready after a while."""
    told_at_s = time.monotonic() + PATIENCE_S
    told = False

    def watched() -> bool:
        nonlocal told
        if not told and link.is_open and time.monotonic() > told_at_s:
            told = True
            tell(
                f"waiting for {', '.join(link.missing())} (the first start of sim compiles its "
                "kernels, half a minute)"
            )
        return cancelled()

    return watched


@contextmanager
def running_stack(cell: str, connect: str, log_dir: Path | None) -> Generator[UsedStack]:
    """Use a stack that runs already.

    Raises
    ------
    StackIncomplete
        If some of its services are not ready soon.
    """
    with Link(cell, connect) as link:
        if not link.wait_complete(COMPLETE_TIMEOUT_S):
            raise StackIncomplete(
                f"cell {cell!r} at {connect}: not ready: {', '.join(link.missing())}",
                missing=link.missing(),
            )
        yield UsedStack(link, 0, log_dir, own=False, watch=Absence(link).look)


@contextmanager
def use_stack(
    cell: str,
    connect: str | None,
    port: int | None,
    log_dir: Path,
    cancelled: Callable[[], bool],
    tell: Callable[[str], None],
    layout: Layout = USUAL,
) -> Generator[UsedStack]:
    """Use the stack at `connect`, else the one that `fras up` keeps in `cell`, else an own one.

    Parameters
    ----------
    cell : str
    connect : str or None
        Endpoint of a router whose stack must be used.
    port : int or None
        Port for the router of an own stack; a stack of `fras up` is then not looked for.
    log_dir : Path
        Where an own stack logs.
    cancelled : callable
        True ends the start of an own stack.
    tell : callable
        Gets which of them it is, in words.
    layout : Layout
        What an own stack consists of.

    Raises
    ------
    OtherRules
        If a stack that has started already is to be another one.
    """
    runtime.record_path(cell)  # a name that can't be one is refused before anything starts
    if connect is not None:
        Endpoint.parse(connect)
    kept = runtime.find(cell) if connect is None and port is None else None
    if layout != USUAL and (connect is not None or kept is not None):
        raise OtherRules(
            f"the stack of cell {cell} runs already: leave out {layout.in_words()}, or start it "
            f"with `fras up {layout.in_words()}`",
            cell=cell,
        )
    if connect is not None:
        tell(f"using the stack of cell {cell} at {connect}")
        with running_stack(cell, connect, None) as used:
            yield used
    elif kept is not None:
        tell(f"using the stack that is up in cell {cell}, {kept.connect}")
        with running_stack(cell, kept.connect, Path(kept.log_dir)) as used:
            yield used
    else:
        tell("starting the services")
        endpoint = f"tcp/127.0.0.1:{port or free_port()}"
        with (
            runtime.noted(cell, endpoint, log_dir),
            own_stack(cell, endpoint, log_dir, cancelled, tell=tell, layout=layout) as used,
        ):
            yield used
