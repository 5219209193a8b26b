"""Two hosts, each with its own router and services: over a relay, and between two namespaces."""

import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import pytest
from benchmarks.two_hosts import READY, TwoHosts, summary_of
from benchmarks.wire import NotPermitted, Wire

from fras_audit import SERVICES, audit_log
from fras_cli.options import build_scenario
from fras_common.codec import decode
from fras_common.messages import Health, RobotState
from fras_common.scenario import to_toml
from fras_experiments.chaos.link import HOST, SlowLink
from fras_log import LogReader, verify_file
from fras_supervisor import free_port

# Motion says whom it waits for after 0.5 s; it looks every 0.25 s, and health goes out every 0.5 s.
# What is left is for a machine that does other work, too.
WAITING_WITHIN_S = 0.5 + 0.25 + 0.5 + 0.75
HEALTH_PERIOD_S = 0.5
# Below the rows there may be remarks that begin with the name, too.
ROW = re.compile("motion {2}")
TICK = re.compile(r"MB +(\d+)")
MESH = "11,13,2"
# Slow, so that a second partition still meets the trial.
PACE = "0.5"


@dataclass
class Relayed:
    """Both hosts on the loopback, and a relay between their routers."""

    link: SlowLink
    ports: dict[str, int]

    def command(self, host: str, *words: str) -> list[str]:
        del host
        return list(words)

    def options(self, host: str) -> list[str]:
        # A's router is itself on A, and behind the relay on B.
        address = HOST if host == "A" else f"{HOST}:{self.link.port}"
        return ["--port", str(self.ports[host]), "--address", f"A={address}"]


@pytest.fixture(scope="module")
def both_sides(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[SlowLink, TwoHosts]]:
    """A stack on both sides of a relay, which every machine can do."""
    ports = {host: free_port() for host in "AB"}
    with (
        SlowLink(ports["A"], free_port()) as link,
        TwoHosts(Relayed(link, ports), tmp_path_factory.mktemp("relayed")) as hosts,
    ):
        yield link, hosts


@pytest.fixture
def relayed(
    both_sides: tuple[SlowLink, TwoHosts], wait_until: Callable[..., Any]
) -> tuple[SlowLink, TwoHosts]:
    """The same, whole and idle, whatever the test before has left."""
    link, hosts = both_sides
    link.heal()
    link.delay_s = 0.0
    wait_until(lambda: is_idle(hosts), "both hosts are ready")
    return both_sides


def is_idle(hosts: TwoHosts) -> bool:
    """Whether every process is ready, and no trial under way."""
    status = hosts.start("A", "status")
    return status.end() == 0 and ("task " not in status.text or ": idle" in status.text)


@pytest.fixture(scope="module")
def wired(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Wire, TwoHosts]]:
    """A stack on both sides of a wire between two namespaces: a minute, for who asks for it."""
    if os.environ.get("FRAS_WIRE") != "1":
        pytest.skip("set FRAS_WIRE=1 to try a wire between two namespaces")
    try:
        wire = Wire()
        wire.__enter__()
    except NotPermitted as error:
        pytest.skip(str(error))
    try:
        with TwoHosts(wire, tmp_path_factory.mktemp("wired")) as hosts:
            yield wire, hosts
    finally:
        wire.__exit__()


def require_whole(hosts: TwoHosts, out: str, summary: dict[str, Any]) -> None:
    """The log lacks nothing and is what was recorded."""
    assert summary["lost"] == 0
    assert summary["complete"]
    assert verify_file(hosts.log(out)).intact


def messages(log: Path, key: str, kind: Any) -> list[Any]:
    return [decode(kind, one.payload, key) for one in LogReader(log).messages() if one.key == key]


@dataclass
class Partition:
    """The hosts don't hear each other for a while."""

    part: Callable[[], None]
    heal: Callable[[], None]
    parted_ns: int = 0
    healed_ns: int = 0

    def last_until(self, seen: Callable[[], None]) -> None:
        """Begin, and end when something was seen."""
        self.part()
        self.parted_ns = time.time_ns()
        try:
            seen()
        finally:
            self.healed_ns = time.time_ns()
            self.heal()

    def check(self, log: Path) -> None:
        """The arms stood, motion said for whom it waited, and they went on."""
        robot = messages(log, "robot/state", RobotState)
        meanwhile = {one.tick for one in robot if self.parted_ns < one.stamp_ns < self.healed_ns}
        # What B had said before may still be read, and answered with one more tick; the last one is
        # said again and again while nobody answers.
        before = max(one.tick for one in robot if one.stamp_ns <= self.parted_ns)
        assert meanwhile <= {before, before + 1}
        last = max(
            (one for one in robot if one.stamp_ns < self.healed_ns), key=lambda one: one.tick
        )
        assert last.tick < robot[-1].tick
        health = messages(log, "health/motion", Health)
        place, waiting = next(
            (place, one)
            for place, one in enumerate(health)
            if one.stamp_ns > self.parted_ns and one.state in ("waiting: sim", "waiting: sa")
        )
        # Health is not repeated: a report that the log lacks may have said it before.
        lost = waiting.seq - health[place - 1].seq - 1
        late_s = (waiting.stamp_ns - last.stamp_ns) * 1e-9 - lost * HEALTH_PERIOD_S
        assert late_s < WAITING_WITHIN_S


class Watch:
    """`fras status --watch`, and what its newest rows say of motion."""

    def __init__(self, hosts: TwoHosts, wait_until: Callable[..., Any]) -> None:
        self._program = hosts.start("A", "status", "--watch")
        self._wait_until = wait_until
        self._program.until("motion")

    def rows(self) -> list[str]:
        """Rows of motion, one a look, the newest last."""
        lines = self._program.text.split("\n")[:-1]  # the last one is still being written
        return [one for one in lines if ROW.match(one)]

    def until_waiting(self) -> None:
        """Wait until motion is seen to wait for somebody on B, on two looks."""
        seen = len(self.rows())
        self._wait_until(
            lambda: len([row for row in self.rows()[seen:] if "waiting: s" in row]) >= 2,
            "motion waits",
        )

    def until_it_moves(self) -> None:
        """Wait until motion is seen to tick, twice: once may be what happened before."""
        seen = len(self.rows())
        self._wait_until(lambda: len(set(TICK.findall("".join(self.rows()[seen:])))) >= 3, "ticks")

    def end(self) -> None:
        """Stop looking."""
        self._program.process.send_signal(signal.SIGINT)
        self._program.end()


def partitions_from_mid_lift(
    hosts: TwoHosts, out: str, partitions: list[Partition], wait_until: Callable[..., Any]
) -> None:
    """A trial, parted first in a lift, stands as often as the hosts don't hear each other."""
    watch = Watch(hosts, wait_until)
    trial = hosts.start("A", "run", "a", "--mesh", MESH, "--pace", PACE, "--json", "--out", out)
    trial.until("lifting")
    for partition in partitions:
        # That an action is announced does not mean that motion has it already.
        watch.until_it_moves()
        partition.last_until(watch.until_waiting)
    assert trial.end() == 0, trial.text
    watch.end()
    summary = summary_of(trial)
    assert summary["outcome"] == "success"
    require_whole(hosts, out, summary)
    for partition in partitions:
        partition.check(hosts.log(out))


def test_partitions_stand_the_arms_and_heal(
    relayed: tuple[SlowLink, TwoHosts], tmp_path: Path, wait_until: Callable[..., Any]
) -> None:
    """First nothing is heard of the other host, then the connection is cut."""
    link, hosts = relayed
    both = [Partition(part, link.heal) for part in (link.silence, link.cut)]
    out = str(tmp_path / "parted")
    partitions_from_mid_lift(hosts, out, both, wait_until)
    assert audit_log(hosts.log(out), SERVICES, lambda *_: None).passed


def test_a_partition_that_lasts_ends_the_trial_by_name_and_another_runs_over_a_slow_link(
    relayed: tuple[SlowLink, TwoHosts], tmp_path: Path
) -> None:
    link, hosts = relayed
    scenario = build_scenario("a", mesh=MESH)
    run = msgspec.structs.replace(scenario.run, peer_timeout_s=1.0)
    path = tmp_path / "impatient.toml"
    path.write_text(to_toml(msgspec.structs.replace(scenario, run=run)))
    lasts, slow = str(tmp_path / "lasts"), str(tmp_path / "slow")
    trial = hosts.start("A", "run", str(path), "--json", "--out", lasts)
    trial.until("lifting")
    known = {host: hosts.up[host].text.count(READY) for host in "AB"}
    link.cut()
    try:
        hosts.up["A"].until("waiting for sim, sa of host B", times=known["A"])
        hosts.up["B"].until("of host A", times=known["B"])
        assert trial.end() == 1
        summary = summary_of(trial)
    finally:
        link.heal()
    assert summary["outcome"] == "aborted"
    assert summary["reason"] in ("hold:sim", "hold:sa")
    assert verify_file(hosts.log(lasts)).intact
    for host in "AB":
        hosts.up[host].until(READY, times=known[host] + 1)
    link.delay_s = 5e-3
    summary = hosts.run("a", slow, "--pace", "0", "--mesh", MESH)
    assert summary["outcome"] == "success"
    # Both ways for every tick: robot/state to B, the verdict back.
    assert summary["tick_ms"]["p50"] > 10.0
    require_whole(hosts, slow, summary)


def test_who_is_asked_on_one_host_knows_the_others(relayed: tuple[SlowLink, TwoHosts]) -> None:
    _, hosts = relayed
    status = hosts.start("A", "status")
    assert status.end() == 0, status.text
    for name in ("router-a", "router-b", "planner", "sim", "sa"):
        assert f"{name} " in status.text
    restart = hosts.start("A", "restart", "sa")
    assert restart.end() == 0, restart.text
    assert "sa is ready again" in restart.text
    refused = hosts.start("B", "up", "--compose", "two-hosts", "--host", "C", "--cell", "other")
    assert refused.end() == 2
    assert "there is no host 'C'; it has A, B" in refused.text


def test_a_trial_runs_over_a_lossy_wire(wired: tuple[Wire, TwoHosts], tmp_path: Path) -> None:
    wire, hosts = wired
    wire.loss = 0.01
    for delay_s in (5e-3, 20e-3):
        wire.delay_s = delay_s
        out = str(tmp_path / f"wire-{delay_s * 1e3:.0f}")
        summary = hosts.run("a", out, "--pace", "0")
        assert summary["outcome"] == "success"
        assert summary["tick_ms"]["p50"] > 2e3 * delay_s
        require_whole(hosts, out, summary)
    wire.loss = wire.delay_s = 0.0


def test_a_wire_that_carries_nothing_stands_the_arms(
    wired: tuple[Wire, TwoHosts], tmp_path: Path, wait_until: Callable[..., Any]
) -> None:
    wire, hosts = wired
    unplugged = Partition(
        lambda: setattr(wire, "carries", False), lambda: setattr(wire, "carries", True)
    )
    partitions_from_mid_lift(hosts, str(tmp_path / "unplugged"), [unplugged], wait_until)
