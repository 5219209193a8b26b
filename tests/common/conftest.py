"""What the tests of the shared library share: a host on a bus in memory, driven by hand."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from fras_common.bus import MemoryBus, MemoryFabric
from fras_common.service import ServiceHost


class Bench:
    """A fabric, and hosts and plain buses on it; `settle` empties the hosts' inboxes."""

    def __init__(self) -> None:
        self.fabric = MemoryFabric()
        self.hosts: list[ServiceHost] = []
        self.buses: list[MemoryBus] = []

    def bus(self, source: str, **settings: Any) -> MemoryBus:
        self.buses.append(MemoryBus(self.fabric, "test", source, **settings))
        return self.buses[-1]

    def host(self, name: str) -> ServiceHost:
        host = ServiceHost(name)
        host.attach(self.bus(f"{name}/1", on_malformed=host.count_malformed))
        self.hosts.append(host)
        return host

    def settle(self) -> None:
        """Handle everything that is there; the bus in memory delivers within the put."""
        while any(host.drain(0.0) for host in self.hosts):
            pass

    def heard(self, topic: Any) -> list[Any]:
        """List that fills with the messages of a key."""
        messages: list[Any] = []
        self.bus("witness/1").subscribe(topic, messages.append)
        return messages


@pytest.fixture
def bench() -> Iterator[Bench]:
    bench = Bench()
    yield bench
    for bus in bench.buses:
        bus.close()


@pytest.fixture
def outcome() -> Callable[..., list[Any]]:
    """Asks without waiting; returns the list that the outcome will be in."""

    def ask(bus: MemoryBus, query: Any, request: Any, timeout_s: float = 30.0) -> list[Any]:
        outcomes: list[Any] = []
        bus.ask(query, request, outcomes.append, timeout_s)
        return outcomes

    return ask
