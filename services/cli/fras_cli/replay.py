"""`fras replay`: a log back onto the bus, with a router of its own if none is given."""

import re
import sys
import tempfile
import uuid
from collections.abc import Callable, Generator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import msgspec
from rich.console import Console
from rich.markup import escape

from fras_cli import runtime
from fras_cli.link import identity_for
from fras_cli.replay_keys import HELP, command_of, watched_terminal
from fras_cli.run import EXIT_OK
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.errors import FrasError
from fras_common.messages import ReplayStatus
from fras_common.service import run_shell
from fras_common.service.logs import configure_logging
from fras_common.signals import StopFlag
from fras_replay import (
    UNLIMITED,
    BadPlace,
    LiveCell,
    NothingToReplay,
    Place,
    Player,
    Recording,
    ReplayHost,
    ReplayService,
    Selection,
    Settings,
    Timeline,
    checked_rate,
    in_words,
    parse_remap,
    read_recording,
)
from fras_supervisor import Endpoint, Stack, find_table, free_port, load_table

ROUTER = "router"
OPEN_TIMEOUT_S = 10.0
# Health and keys have threads; the schedule must not wait long for them.
SWITCH_S = 0.0005


@dataclass(frozen=True)
class Wanted:
    """What was asked for on the command line.

    Attributes
    ----------
    cell : str
    connect : str or None
        Endpoint of a router; one of our own by default.
    rate : float
        0: as fast as possible.
    first, last : str or None
        Where to begin and end: a tick, `120`, or seconds, `2.5s`.
    include, exclude, remap : sequence of str
    """

    cell: str
    connect: str | None = None
    rate: float = 1.0
    loop: bool = False
    paused: bool = False
    stay: bool = False
    first: str | None = None
    last: str | None = None
    include: Sequence[str] = ()
    exclude: Sequence[str] = ()
    remap: Sequence[str] = ()


def replay(
    path: Path,
    wanted: Wanted,
    console: Console,
    beside: Callable[[str], AbstractContextManager[None]] = lambda connect: nullcontext(),
) -> int:
    """Replay a log.

    Parameters
    ----------
    path : Path
    wanted : Wanted
    console : Console
    beside : callable
        Given the router's endpoint, what runs as long as the replay does.

    Returns
    -------
    int
        0 once it has ended, or was told to stop.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog, NothingToReplay
        There is nothing to replay.
    BadKey, BadPlace, BadRate, BadCell, BadEndpoint
        What was asked for can't be done.
    LiveCell
        The cell is no place for it, or became none.
    NoRouter, NoAnswer
        There is no router at `connect`.
    """
    rate = checked_rate(wanted.rate)
    runtime.record_path(wanted.cell)  # a name that can't be one is refused before anything starts
    selection = Selection(
        wanted.include, wanted.exclude, [parse_remap(text) for text in wanted.remap]
    )
    recording = read_recording(path, selection)
    try:
        player = first_player(recording.timeline, wanted, rate)
        for text in recording.damage:
            console.print(f"{escape(str(path))} is damaged: {escape(text)}", style="red")
        if recording.damage:
            console.print("what could be read of it is replayed", style="red")
        stop = StopFlag()
        stop.install()
        with router_of(wanted.cell, wanted.connect, stop.is_set) as connect, beside(connect):
            _run(recording, player, wanted, connect, console, stop)
    finally:
        recording.close()
    return EXIT_OK


def first_player(timeline: Timeline, wanted: Wanted, rate: float) -> Player:
    """Return how a replay begins.

    Raises
    ------
    BadPlace, NothingToReplay
    """
    begin = timeline.begin if wanted.first is None else _place(timeline, wanted.first, last=False)
    end = timeline.end if wanted.last is None else _place(timeline, wanted.last, last=True)
    if begin.before >= end.before:
        raise NothingToReplay(
            f"nothing stands from {wanted.first or 'the start'} to {wanted.last or 'the end'}: the "
            f"log has {timeline.duration_ns / 1e9:.2f} s and ticks up to {timeline.last_tick}"
        )
    return Player(
        timeline,
        begin,
        end,
        rate=rate,
        loop=wanted.loop,
        state="paused" if wanted.paused else "playing",
        index=begin.before,
        at_ns=begin.at_ns,
    )


def _place(timeline: Timeline, text: str, *, last: bool) -> Place:
    if re.fullmatch(r"[0-9]+", text):
        return timeline.after_tick(int(text)) if last else timeline.before_tick(int(text))
    if found := re.fullmatch(r"([0-9]+(?:\.[0-9]*)?|\.[0-9]+)s", text):
        return timeline.at(round(float(found[1]) * 1e9))
    raise BadPlace(text)


@contextmanager
def router_of(cell: str, connect: str | None, cancelled: Callable[[], bool]) -> Generator[str]:
    """Give the endpoint of a router: the one named, else one of our own within the block.

    Raises
    ------
    LiveCell
        Something runs in the cell at another router of this machine.
    """
    if connect is not None:
        Endpoint.parse(connect)
        yield connect
        return
    if others := runtime.all_of(cell):
        raise LiveCell(cell, [f"process {other.pid} at {other.connect}" for other in others])
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    table = load_table(find_table("local"))
    alone = msgspec.structs.replace(table, processes={ROUTER: table.processes[ROUTER]})
    with tempfile.TemporaryDirectory(prefix="fras-replay-") as folder:
        logs = Path(folder)
        stack = Stack(alone, cell, endpoint, logs, lambda: (), cancelled=cancelled)
        with runtime.noted(cell, endpoint, logs), stack:
            yield endpoint


def _run(
    recording: Recording,
    player: Player,
    wanted: Wanted,
    connect: str,
    console: Console,
    stop: StopFlag,
) -> None:
    instance = uuid.uuid4().hex[:4]
    host = ReplayHost()
    host.log = configure_logging(host.name, "WARNING", host.publish_log)
    bus = ZenohBus(
        wanted.cell,
        connect,
        f"{host.name}/{instance}",
        on_malformed=host.count_malformed,
        open_timeout_s=OPEN_TIMEOUT_S,
        identity=identity_for(host.name, wanted.cell, connect),
    )
    sys.setswitchinterval(SWITCH_S)
    try:
        host.attach(bus)
        service = ReplayService(
            host, recording, player, Settings(wanted.cell, instance, wanted.stay)
        )
        console.print(
            f"replaying {escape(str(recording.path))} into cell {wanted.cell} at {connect}: "
            f"{recording.timeline.end.before} messages of {len(recording.lines)} keys, "
            f"{recording.timeline.duration_ns / 1e9:.2f} s",
            soft_wrap=True,
        )
        if sys.stdin.isatty():
            console.print(HELP, style="dim", highlight=False, soft_wrap=True)

        def on_key(key: bytes) -> None:
            host.post(lambda: _told(service, key))

        with watched_terminal(on_key, lambda: _line(service.status(), recording)):
            run_shell(host, service, stop)
        _say_end(service, console)
    finally:
        bus.close()
    if service.intruder is not None:
        raise service.intruder


def _told(service: ReplayService, key: bytes) -> None:
    status = service.status()
    command = command_of(key, status.phase == "playing", status.rate)
    if command is not None:
        try:
            service.control(command)
        except FrasError as error:
            # A key at the last mark: there is nowhere to go, and nothing to end.
            sys.stderr.write(f"\r\x1b[K{error}\n")


def _line(status: ReplayStatus, recording: Recording) -> str:
    mark = recording.mark_text(status.mark)
    return in_words(status) + (f" | {mark}" if mark else "")


def _say_end(service: ReplayService, console: Console) -> None:
    status = service.status()
    late = service.lateness
    told = (
        f"; late by {late.percentile_ms(50):.2f} ms in the median, "
        f"{late.percentile_ms(99):.2f} ms p99"
        if len(late)
        else ""
    )
    console.print(
        f"{status.phase} at {status.position_s:.2f} s, tick {status.tick}, "
        f"{status.messages} of {status.of} messages{told}",
        highlight=False,
    )


__all__ = ["UNLIMITED", "Wanted", "first_player", "replay", "router_of"]
