"""What only a wire can do: freeze, break, come back."""

import signal
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from typing import Any

import psutil
import pytest

from fras_common.bus import BusClosed, Call, RemoteFault
from fras_common.bus.zenoh_bus import NoRouter, ZenohBus
from fras_common.bus.zenoh_router import route
from fras_common.errors import FrasError
from fras_common.messages import LogRecord, RecorderStatus, RestartReply, RestartRequest
from fras_common.topics import LOG, RECORDER_STATUS, SUPERVISOR_RESTART

Listen = Callable[[], Any]

SIM_LOG = LOG.of(service="sim")
# More than all buffers on the way hold, and less than a publisher keeps.
BIG = "x" * 60_000
FROZEN_PUTS = 900
# For so long Zenoh waits for one who takes in nothing, before it breaks the link.
LINK_HELD_S = 6.0

LISTENER = """
import sys, threading
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.codec import decode
from fras_common.messages import LogRecord
from fras_common.topics import LOG
expected, done, seqs = int(sys.argv[3]), threading.Event(), []
def on_log(message):
    seqs.append(message.seq)
    if message.event == "warm-up" and len(seqs) == 1:
        print("hearing", flush=True)
    if message.event == "last":
        done.set()
bus = ZenohBus(sys.argv[1], sys.argv[2], "sa/frozen")
if sys.argv[4] == "typed":
    bus.subscribe(LOG.of(service="sim"), on_log)
else:
    bus.subscribe_raw("**", lambda one: on_log(decode(LogRecord, one.payload, one.key)))
print("subscribed", flush=True)
done.wait(60)
print(seqs == list(range(seqs[0], seqs[0] + len(seqs))), seqs[-1], flush=True)
bus.close()
"""


# Asks for all that a cache holds, as the bus does, and stands still as the first of it comes.
FREEZES = """
import os, signal, sys, threading
from fras_common.bus.zenoh_bus import ZenohBus
bus = ZenohBus(sys.argv[1], sys.argv[2], "sa/frozen")
def freeze(*_):
    os.kill(os.getpid(), signal.SIGSTOP)
bus._get_cached("log/sim/@adv/pub/**", freeze, freeze, 30.0)
threading.Event().wait(60)
"""


@pytest.fixture(params=["typed", "raw"])
def listener(
    router: Any, request: pytest.FixtureRequest
) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    cell = f"frozen-{uuid.uuid4().hex[:6]}"
    process = subprocess.Popen(
        [sys.executable, "-c", LISTENER, cell, router.endpoint, str(FROZEN_PUTS), request.param],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    with process:
        assert process.stdout.readline() == "subscribed\n"
        yield cell, process
        process.kill()


def line_of(process: subprocess.Popen[str]) -> list[str]:
    lines: list[str] = []
    assert process.stdout is not None
    reader = threading.Thread(
        target=lambda out: lines.append(out.readline()), args=(process.stdout,)
    )
    reader.start()
    return lines


def put_until_heard(publisher: Any, heard: Any, also: Callable[[], bool] = lambda: True) -> None:
    """Nothing of before a subscription is heard, and only the router knows when that was."""
    deadline = time.monotonic() + 20.0
    while not (heard and also()):
        assert time.monotonic() < deadline, "never heard"
        before = len(heard)
        publisher.put(LogRecord(level="", event="warm-up", fields={}))
        try:
            heard.until(lambda got, before=before: len(got) > before, timeout_s=0.05)
        except AssertionError:
            continue


def test_a_frozen_subscriber_blocks_nobody_and_misses_nothing(
    router: Any, listener: tuple[str, subprocess.Popen[str]], listen: Listen
):
    cell, process = listener
    heard = listen()
    publishing = ZenohBus(cell, router.endpoint, "sim/1")
    hearing = ZenohBus(cell, router.endpoint, "cli/1")
    try:
        hearing.subscribe(SIM_LOG, heard)
        publisher = publishing.publisher(SIM_LOG)
        said = line_of(process)
        put_until_heard(publisher, heard, lambda: bool(said))
        assert said == ["hearing\n"]

        process.send_signal(signal.SIGSTOP)
        worst = 0.0
        for _ in range(FROZEN_PUTS):
            since = time.monotonic()
            publisher.put(LogRecord(level="", event="big", fields={"data": BIG}))
            worst = max(worst, time.monotonic() - since)
        last = publisher.put(LogRecord(level="", event="last", fields={}))
        heard.until(lambda got: got[-1].event == "last", timeout_s=30.0)
        process.send_signal(signal.SIGCONT)

        assert worst < 1.0, "a put waited for a subscriber"
        out, _ = process.communicate(timeout=60)
        assert out == f"True {last.seq}\n", "the frozen subscriber missed something"
    finally:
        process.send_signal(signal.SIGCONT)
        hearing.close()
        publishing.close()


@pytest.fixture
def frozen(router: Any) -> Iterator[Callable[[str], subprocess.Popen[bytes]]]:
    begun: list[subprocess.Popen[bytes]] = []

    def begin(cell: str) -> subprocess.Popen[bytes]:
        begun.append(subprocess.Popen([sys.executable, "-c", FREEZES, cell, router.endpoint]))
        return begun[-1]

    yield begin
    for process in begun:
        with process:
            process.kill()


def stands_still(process: subprocess.Popen[bytes]) -> bool:
    return psutil.Process(process.pid).status() == psutil.STATUS_STOPPED


def test_who_freezes_as_a_cache_answers_blocks_nobody(
    router: Any, frozen: Callable[[str], subprocess.Popen[bytes]], listen: Listen
):
    """A cache holds back its publisher's puts while it answers."""
    cell, heard = f"frozen-{uuid.uuid4().hex[:6]}", listen()
    hearing = ZenohBus(cell, router.endpoint, "sa/1")
    publishing = ZenohBus(cell, router.endpoint, "sim/1")
    try:
        publisher = publishing.publisher(SIM_LOG)
        for _ in range(FROZEN_PUTS):
            publisher.put(LogRecord(level="", event="big", fields={"data": BIG}))
        hearing.subscribe(SIM_LOG, heard)
        put_until_heard(publisher, heard)
        asker = frozen(cell)
        assert longest_way(publisher, heard, lambda: stands_still(asker)) < 1.0
    finally:
        hearing.close()
        publishing.close()


def longest_way(publisher: Any, heard: Any, stands: Callable[[], bool]) -> float:
    """Put until one has stood still for as long as Zenoh would wait for it; tell the worst [s]."""
    worst, since = 0.0, None
    deadline = time.monotonic() + 30.0
    while since is None or time.monotonic() < since + LINK_HELD_S:
        assert time.monotonic() < deadline, "nothing froze"
        begun = time.monotonic()
        last = publisher.put(LogRecord(level="", event="small", fields={}))
        heard.until(lambda got, last=last: bool(got) and got[-1].seq == last.seq, timeout_s=20.0)
        worst = max(worst, time.monotonic() - begun)
        if since is None and stands():
            since = time.monotonic()
    return worst


def test_after_a_router_restart_nothing_the_cache_holds_is_lost(own_router: Any, listen: Listen):
    heard, raw, tokens = listen(), listen(), listen()
    publishing = ZenohBus("one", own_router.endpoint, "sim/1")
    hearing = ZenohBus("one", own_router.endpoint, "sa/1")
    try:
        hearing.subscribe(SIM_LOG, heard)
        hearing.subscribe_raw("**", raw)
        hearing.watch_tokens(tokens)
        publishing.announce("alive/sim")
        tokens.count(1)
        publisher = publishing.publisher(SIM_LOG)
        while not heard:
            publisher.put(LogRecord(level="", event="warm-up", fields={}))
            try:
                heard.until(bool, timeout_s=0.05)
            except AssertionError:
                continue
        own_router.stop()
        for _ in range(200):
            publisher.put(LogRecord(level="", event="away", fields={}))
        own_router.start()
        last = publisher.put(LogRecord(level="", event="back", fields={}))

        got = heard.until(lambda got: got[-1].seq == last.seq, timeout_s=30.0)
        assert [m.seq for m in got] == list(range(got[0].seq, last.seq + 1))
        raw.until(lambda got: len(got) == last.seq + 1, timeout_s=30.0)
        tokens.until(lambda got: got[-1] == ("alive/sim/1", True))
    finally:
        hearing.close()
        publishing.close()


def test_a_latched_value_is_told_after_a_router_restart(own_router: Any, listen: Listen):
    heard = listen()
    publishing = ZenohBus("one", own_router.endpoint, "recorder/1")
    try:
        publisher = publishing.publisher(RECORDER_STATUS)
        publisher.put(
            RecorderStatus(state="idle", path="", messages=0, bytes=0, lost=0, reason="kept")
        )
        own_router.stop()
        own_router.start()
        late = ZenohBus("one", own_router.endpoint, "cli/1")
        try:
            late.subscribe(RECORDER_STATUS, heard)
            assert heard.count(1)[0].reason == "kept"
        finally:
            late.close()
    finally:
        publishing.close()


def test_a_bus_closes_when_its_router_is_gone(own_router: Any):
    bus = ZenohBus("one", own_router.endpoint, "sim/1")
    publisher = bus.publisher(SIM_LOG)
    bus.subscribe(SIM_LOG, print)
    bus.announce("alive/sim")
    own_router.stop()
    bus.close()
    with pytest.raises(BusClosed):
        publisher.put(LogRecord(level="", event="late", fields={}))


def test_without_a_router_the_bus_says_what_to_do(own_router: Any):
    own_router.stop()
    with pytest.raises(NoRouter, match="fras up") as caught:
        ZenohBus("one", own_router.endpoint, "sim/1", open_timeout_s=0.2)
    assert caught.value.values == {"connect": own_router.endpoint}


@pytest.mark.parametrize("endpoint", ["nonsense", "tcp/nowhere.invalid:1", "carrier/pigeon:1"])
def test_an_impossible_endpoint_is_no_router(endpoint: str):
    with pytest.raises(NoRouter):
        ZenohBus("one", endpoint, "sim/1", open_timeout_s=0.2)
    with pytest.raises(NoRouter):
        route([endpoint], until=lambda: None)


def test_a_taken_port_is_named(router: Any):
    ZenohBus("one", router.endpoint, "cli/1").close()  # it listens
    with pytest.raises(NoRouter, match="can't listen on"):
        route([router.endpoint], until=lambda: None)


class NotHere(FrasError):
    """Another host's supervisor keeps it."""


@pytest.fixture
def open_zenoh(router: Any) -> Iterator[Callable[[str], ZenohBus]]:
    cell, opened = f"servers-{uuid.uuid4().hex[:6]}", list[ZenohBus]()

    def open_one(source: str) -> ZenohBus:
        opened.append(ZenohBus(cell, router.endpoint, source))
        return opened[-1]

    yield open_one
    for one in opened:
        one.close()


def test_of_two_servers_the_one_that_does_it_counts(open_zenoh: Callable[[str], ZenohBus]):
    """As where each of two hosts has a supervisor: whoever refuses keeps nobody from doing it."""

    def refuse(call: Call[RestartRequest, RestartReply]) -> None:
        call.fail(NotHere(call.request.name))

    def do(call: Call[RestartRequest, RestartReply]) -> None:
        if call.request.name == "sim":
            call.reply(RestartReply(name="sim", state="ready", restarts=1))
        else:
            refuse(call)

    for number, serve in enumerate((refuse, do, refuse)):
        open_zenoh(f"supervisor/{number}").serve(SUPERVISOR_RESTART, serve)
    client = open_zenoh("cli/1")
    for _ in range(20):
        asked = RestartRequest(name="sim", by="test")
        assert client.query(SUPERVISOR_RESTART, asked, 10.0).restarts == 1
    with pytest.raises(RemoteFault, match="NotHere"):
        client.query(SUPERVISOR_RESTART, RestartRequest(name="sun", by="test"), 10.0)
