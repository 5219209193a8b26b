"""`fras up|down|stop|resume|why-not`: a stack that stays, and what one does to it."""

import signal
import sys
import time
from pathlib import Path

import psutil
from rich.console import Console
from rich.markup import escape

from fras_cli import runtime
from fras_cli.far_routers import FarRouters
from fras_cli.layout import USUAL, Layout
from fras_cli.link import Link
from fras_cli.other_hosts import OtherHosts
from fras_cli.plan_words import HOLDER
from fras_cli.run import EXIT_OK, EXIT_STACK, caught_interrupts, supervisor_lines
from fras_cli.stack import own_stack
from fras_common.errors import FrasError
from fras_common.messages import HoldRequest, HoldState, ResumeRequest, WhyNotRequest
from fras_common.topics import HOLD, RESUME, WHY_NOT
from fras_supervisor import Console as Lines

POLL_S = 0.2
DOWN_TIMEOUT_S = 30.0
QUERY_TIMEOUT_S = 5.0
WHAT_NOW = (
    "the rest runs on: `fras restart NAME` starts it again, and `fras resume --holder supervisor` "
    "lets the arms go on"
)


class DownTimeout(FrasError):
    """The stack did not end in time."""


def up(cell: str, port: int, log_dir: Path, console: Console, layout: Layout = USUAL) -> int:
    """Start a stack and keep it until Ctrl-C or `fras down`; 3 if a process had been given up."""
    gone = ""
    here = f"host {layout.host}: " if layout.host else ""
    names = list(layout.placed(port)[0].processes)
    connect = f"{layout.protocol}/127.0.0.1:{port}"
    record = runtime.keep(cell, connect, log_dir, layout.keys)
    try:
        with caught_interrupts() as interrupts, Lines(sys.stdout, names) as echo:
            began_s = time.monotonic()

            def stopping() -> bool:
                return interrupts.count > 0

            started = own_stack(
                cell,
                connect,
                log_dir,
                cancelled=stopping,
                echo=echo,
                tell=console.print,
                layout=layout,
                report=supervisor_lines(console),
            )
            with started as stack:
                console.print(
                    f"{here}ready after {time.monotonic() - began_s:.1f} s: cell {cell}, "
                    f"{connect}, logs in {log_dir}; Ctrl-C or `fras down --cell {cell}` stops it"
                )
                others = OtherHosts(stack.elsewhere)
                routers = FarRouters(layout.far_routers(port))
                while not stopping():
                    missing = stack.link.missing()
                    told = [others.look(missing)]
                    waiting = any(name in stack.elsewhere for name in missing)
                    told += routers.look(waiting=waiting, now_s=time.monotonic())
                    for said in filter(None, told):
                        console.print(escape(said), soft_wrap=True)
                    if (now := stack.watch()) and now != gone:
                        console.print(
                            escape(f"{now}; {WHAT_NOW}"), style="bold red", soft_wrap=True
                        )
                    gone = now
                    time.sleep(POLL_S)
                console.print("stopping", style="dim")
    finally:
        runtime.forget(record)
    return EXIT_STACK if gone else EXIT_OK


def down(cell: str, console: Console) -> int:
    """Stop the stack that `fras up` keeps in `cell`, and wait until it is gone.

    Raises
    ------
    NoStack
        There is none.
    DownTimeout
        It did not end.
    """
    record = runtime.require(cell)
    process = psutil.Process(record.pid)
    process.send_signal(signal.SIGINT)
    deadline_s = time.monotonic() + DOWN_TIMEOUT_S
    # One that has ended but whose parent has not asked for its status yet counts as gone.
    while process.is_running() and process.status() != psutil.STATUS_ZOMBIE:
        if time.monotonic() > deadline_s:
            raise DownTimeout(
                f"the stack of cell {cell!r} (pid {record.pid}) still runs after "
                f"{DOWN_TIMEOUT_S} s: look into {record.log_dir}",
                pid=record.pid,
            )
        time.sleep(POLL_S)
    console.print(f"cell {cell}: stopped")
    return EXIT_OK


def endpoint(cell: str, connect: str | None) -> str:
    """Endpoint given, or that of the stack in `cell`.

    Raises
    ------
    NoStack
        There is none.
    SeveralStacks
        There are several.
    """
    if connect is not None:
        return connect
    return runtime.require_one(cell).connect


def hold(cell: str, connect: str | None, reason: str, console: Console) -> int:
    """Stop the arms of every stack in the cell: at rest within two ticks, until somebody resumes.

    A stack that does not answer is told, and keeps none of the others from being stopped.
    """
    places = [connect] if connect else [one.connect for one in runtime.require_any(cell)]
    failures: list[FrasError] = []
    for place in places:
        try:
            _hold(cell, place, reason, console)
        except FrasError as error:
            failures.append(error)
            console.print(escape(f"{place}: {error}"), style="bold red")
    return EXIT_STACK if failures else EXIT_OK


def _hold(cell: str, place: str, reason: str, console: Console) -> None:
    with Link(cell, place, open_timeout_s=QUERY_TIMEOUT_S) as link:
        began_s = time.monotonic()
        request = HoldRequest(holder=HOLDER, reason=reason)
        state = link.bus.query(HOLD, request, QUERY_TIMEOUT_S)
        took_ms = (time.monotonic() - began_s) * 1e3
    console.print(f"{place}: stop acknowledged at tick {state.tick} after {took_ms:.1f} ms")
    _print_holds(state, console)


def why_not(question: str, cell: str, connect: str | None, console: Console) -> int:
    """Ask the planner why its latest plan is not another one."""
    with Link(cell, endpoint(cell, connect), open_timeout_s=QUERY_TIMEOUT_S) as link:
        request = WhyNotRequest(question=question)
        answer = link.bus.query(WHY_NOT, request, QUERY_TIMEOUT_S)
    console.print(f"Why not {escape(answer.question)} (trial {answer.trial})?", style="bold")
    for sentence in answer.sentences:
        console.print(escape(sentence))
    return EXIT_OK


def resume(cell: str, connect: str | None, holder: str, console: Console) -> int:
    """Lift a hold; the executive then plans anew from where the arms stand."""
    with Link(cell, endpoint(cell, connect), open_timeout_s=QUERY_TIMEOUT_S) as link:
        request = ResumeRequest(holder=holder, by=HOLDER)
        state = link.bus.query(RESUME, request, QUERY_TIMEOUT_S)
    _print_holds(state, console)
    return EXIT_OK


def _print_holds(state: HoldState, console: Console) -> None:
    if not state.holds:
        console.print("no hold is in force")
    for holder, reason in state.holds.items():
        console.print(f"held by {holder}: {reason} (lift it with `fras resume --holder {holder}`)")
