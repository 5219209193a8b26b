"""Which stack a command talks to: one that runs already, or one of its own."""

import time
from collections.abc import Callable, Collection, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from fras_cli import runtime
from fras_cli.absence import Absence
from fras_cli.layout import USUAL, Layout, OtherRules
from fras_cli.link import NAME, Link, identity_for
from fras_cli.own_keys import ready_keys
from fras_common.errors import FrasError
from fras_supervisor import (
    Endpoint,
    Stack,
    Supervision,
    free_port,
)
from fras_supervisor.logs import Echo
from fras_supervisor.service import Tell
from fras_supervisor.supervision import NAME as SUPERVISOR

COMPLETE_TIMEOUT_S = 5.0
PATIENCE_S = 3.0


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
    elsewhere : mapping of str to str
        Processes that other hosts run, and which.
    """

    link: Link
    started_ns: int
    log_dir: Path | None
    own: bool
    watch: Callable[[], str]
    elsewhere: Mapping[str, str] = field(default_factory=dict[str, str])


def _not_told(level: str, text: str) -> None:
    """Leave what the supervisor has to say to its log."""


@contextmanager
def own_stack(
    cell: str,
    connect: str | None,
    log_dir: Path,
    cancelled: Callable[[], bool] = lambda: False,
    echo: Echo | None = None,
    tell: Callable[[str], None] | None = None,
    layout: Layout = USUAL,
    report: Tell = _not_told,
) -> Generator[UsedStack]:
    """Start a stack, keep it, and stop it whatever happens.

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
    report : callable, optional
        Gets what the supervisor has to say, and how grave it is.

    Raises
    ------
    TableError
        The process table is not to be used.
    BadKeys
        The certificates are not.
    """
    endpoint = connect or f"{layout.protocol}/127.0.0.1:{free_port()}"
    table, routers = layout.placed(Endpoint.parse(endpoint).port)
    # Of several hosts one has the people's certificate, and each has its supervisor's.
    name = SUPERVISOR if layout.host else NAME
    if layout.keys is not None:
        shown = [*table.processes, name, SUPERVISOR]
        ready_keys(layout.keys, shown, layout.own_addresses(routers), table.elsewhere, tell)
    started_ns = time.time_ns()
    with Link(cell, endpoint, keys=layout.keys, name=name) as link:
        watched = told_when_slow(link, cancelled, tell, table.elsewhere) if tell else cancelled
        stack = Stack(
            table,
            cell,
            endpoint,
            log_dir,
            link.tokens,
            values={**layout.values, **routers},
            cancelled=watched,
            echo=echo,
        )
        stack.start()
        try:
            identity = identity_for(SUPERVISOR, cell, endpoint, layout.keys)
            # It ends first: nothing is started again once the stop has begun.
            with Supervision(stack, cell, endpoint, report, identity) as kept:
                yield UsedStack(
                    link,
                    started_ns,
                    log_dir,
                    own=True,
                    watch=kept.gone,
                    elsewhere=table.elsewhere,
                )
        finally:
            try:
                link.close()
            finally:
                stack.stop()


def told_when_slow(
    link: Link,
    cancelled: Callable[[], bool],
    tell: Callable[[str], None],
    elsewhere: Collection[str] = (),
) -> Callable[[], bool]:
    """Return `cancelled`, which also tells, once, who of this host is not ready after a while."""
    told_at_s = time.monotonic() + PATIENCE_S
    told = False

    def watched() -> bool:
        nonlocal told
        if not told and link.is_open and time.monotonic() > told_at_s:
            told = True
            tell(
                f"waiting for {', '.join(one for one in link.missing() if one not in elsewhere)} "
                "(the first start of sim compiles its kernels, half a minute)"
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
    report: Tell = _not_told,
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
    report : callable, optional
        Gets what the supervisor of an own stack has to say, and how grave it is.

    Raises
    ------
    OtherRules
        If a stack that has started already is to be another one.
    """
    runtime.record_path(cell)  # a name that can't be one is refused before anything starts
    if connect is not None:
        Endpoint.parse(connect)
    kept = runtime.find(cell) if connect is None and port is None else None
    there = connect or (kept.connect if kept is not None else None)
    # A stack that is there and has certificates is what `--secure` asks for.
    wanted = replace(layout, keys=None) if there and there.startswith("tls/") else layout
    if wanted != USUAL and there is not None:
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
        endpoint = f"{layout.protocol}/127.0.0.1:{port or free_port()}"
        with (
            runtime.noted(cell, endpoint, log_dir, layout.keys),
            own_stack(
                cell, endpoint, log_dir, cancelled, tell=tell, layout=layout, report=report
            ) as used,
        ):
            yield used
