"""Two hosts with certificates: what passes between their routers, and who is let in by either."""

import stat
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import zenoh
from benchmarks.two_hosts import HOSTS, TwoHosts

from fras_common.bus import NoAnswer, RemoteFault
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.identity import Identity, identity_in
from fras_common.messages import ExecuteRequest, HoldRequest, ResumeRequest
from fras_common.topics import (
    EXECUTE,
    HOLD,
    RESUME,
    ROBOT_STATE,
    TISSUE_STATE,
    VERDICT,
    Qos,
    Topic,
)
from fras_supervisor import free_port
from support.rogues import Rogues

LOOPBACK = "127.0.0.1"
ASKED_S, ANSWERED_S = 0.5, 10.0


@dataclass
class Beside:
    """Both hosts on the loopback, their routers side by side."""

    ports: dict[str, int]

    def command(self, host: str, *words: str) -> list[str]:
        del host
        return list(words)

    def options(self, host: str) -> list[str]:
        return ["--port", str(self.ports[host]), "--address", f"A={LOOPBACK}:{self.ports['A']}"]

    def endpoint(self, host: str) -> str:
        return f"tls/{LOOPBACK}:{self.ports[host]}"


@dataclass
class Stage:
    """Both hosts, up."""

    network: Beside
    hosts: TwoHosts
    folder: Path

    def rogues(self, host: str) -> Rogues:
        """Attackers of a host's router, who have stolen what A has."""
        folder = self.folder / f"rogues-{host}"
        folder.mkdir(exist_ok=True)
        return Rogues("local", self.network.endpoint(host), self.hosts.keys("A"), folder)

    def bus(self, host: str, identity: Identity) -> ZenohBus:
        return ZenohBus("local", self.network.endpoint(host), "cli/test", identity=identity)


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    folder = tmp_path_factory.mktemp("secure-hosts")
    network = Beside({host: free_port() for host in HOSTS})
    with TwoHosts(network, folder, secure=True) as hosts:
        yield Stage(network, hosts, folder)


def test_a_trial_runs_over_both(stage: Stage) -> None:
    summary = stage.hosts.run("a", "secure", "--pace", "0", "--mesh", "11,13,2")
    assert (summary["outcome"], summary["lost"], summary["complete"]) == ("success", 0, True)
    status = stage.hosts.start("A", "status")
    assert status.end() == 0, status.text
    restart = stage.hosts.start("A", "restart", "sa")
    assert restart.end() == 0, restart.text


def test_a_host_has_the_keys_of_its_own_services_alone(stage: Stage) -> None:
    keys = stage.hosts.keys("B")
    own = {"router-b", "sim", "sa", "supervisor"}
    assert {path.stem for path in keys.glob("*.key")} == own
    assert {path.stem for path in keys.glob("*.pem")} == {*own, "ca"}
    assert stat.S_IMODE(keys.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in keys.iterdir()} == {0o600}
    # And nothing but reading needs more: who wants to look there takes the people's key along.
    refused = stage.hosts.start("B", "status")
    assert refused.end() == 2
    assert "cli.pem" in refused.text


@pytest.mark.parametrize("host", HOSTS)
def test_neither_router_lets_in_who_has_no_certificate(stage: Stage, host: str) -> None:
    rogues = stage.rogues(host)
    strangers: dict[str, Callable[[], None]] = {
        "without any": rogues.without_certificate,
        "expired": lambda: rogues.open_with(rogues.expired()),
        "of another authority": lambda: rogues.open_with(rogues.of_another_authority()),
        "plain": lambda: rogues.open_with(None, rogues.plain()),
    }
    for come_in in strangers.values():
        with pytest.raises(zenoh.ZError):
            come_in()
    with rogues.named("sa"):
        pass  # with a certificate that counts the door is open


@pytest.mark.parametrize(
    ("there", "here", "thief", "other", "honest", "own"),
    [("A", "B", "motion", ROBOT_STATE, "sa", VERDICT),
     ("B", "A", "sim", TISSUE_STATE, "motion", ROBOT_STATE)],
)  # fmt: skip
def test_a_host_speaks_for_its_own_services_and_no_others(
    stage: Stage, wait_until: Any, there: str, here: str, thief: str, other: Topic[Any],
    honest: str, own: Topic[Any],
) -> None:  # fmt: skip
    """Even with the key of motion, somebody on B is not motion to A, nor sim on A to B."""
    ear = stage.bus(there, identity_in(stage.hosts.keys("A"), "cli"))
    heard: list[bytes] = []
    try:
        for topic in (own, other):
            ear.subscribe_raw(topic.key, lambda one: heard.append(one.payload))
        with stage.rogues(here).named(thief) as liar, stage.rogues(here).named(honest) as rogue:
            lies = liar.publisher_raw(other.key, Qos.TELEMETRY)
            words = rogue.publisher_raw(own.key, Qos.TELEMETRY)

            def said_often() -> bool:
                lies.put(b"lie", "application/msgpack")
                words.put(b"true", "application/msgpack")
                return heard.count(b"true") > 5

            wait_until(said_often, f"what is {here}'s to say reaches {there}")
        assert b"lie" not in heard
    finally:
        ear.close()


def test_from_the_host_that_computes_nothing_is_lifted_or_moved(stage: Stage) -> None:
    """Not even with the keys of people and of the planner; a stop is taken from there, too."""
    do = ExecuteRequest(
        trial="t", goal_id="g", name="release", arm="psm1", block="b(1,1)", target_m=None
    )
    refused: Any = (
        ("cli", RESUME, ResumeRequest(holder="somebody", by="cli")),
        ("planner", EXECUTE, do),
    )
    for name, query, request in refused:
        with stage.rogues("A").named(name) as near, stage.rogues("B").named(name) as far:
            with pytest.raises(NoAnswer):
                far.query(query, request, ASKED_S)
            # On A motion answers, if only to say that there is nothing to do.
            with suppress(RemoteFault):
                near.query(query, request, ANSWERED_S)
    with stage.rogues("B").named("sim") as far:
        held = far.query(HOLD, HoldRequest(holder="b", reason="a stop is safe"), ANSWERED_S)
    assert held.holds == {"b": "a stop is safe"}
    lifted = stage.hosts.start("A", "resume", "--holder", "b")
    assert lifted.end() == 0, lifted.text


def test_an_address_that_the_certificate_does_not_name_is_told_before_the_start(
    stage: Stage,
) -> None:
    refused = stage.hosts.start(
        "A", "up", "--compose", "two-hosts", "--host", "A", "--secure", "--cell", "other",
        "--port", str(free_port()), "--address", "A=localhost.localdomain",
    )  # fmt: skip
    assert refused.end() == 2
    assert "`fras keys rotate router-a --host localhost.localdomain`" in refused.text


def test_a_host_without_keys_makes_none_and_says_where_they_come_from(
    stage: Stage, tmp_path: Path
) -> None:
    refused = TwoHosts(stage.network, tmp_path).start(
        "B", "up", "--compose", "two-hosts", "--host", "B", "--secure", "--cell", "other",
        "--port", str(free_port()), "--address", f"A={LOOPBACK}",
    )  # fmt: skip
    assert refused.end() == 2
    assert "fras keys export" in refused.text
    assert not (tmp_path / "B" / "keys").exists()
