"""Whom motion names when no verdict comes."""

from collections.abc import Iterator
from typing import Any

import pytest

from fras_common.bus import MemoryBus, MemoryFabric
from fras_common.messages import Health
from fras_common.service import ServiceHost
from fras_common.topics import HEALTH
from fras_motion.peers import Peers

LOOP = ("sim", "sa", "patient")


class Theatre:
    """Motion's view of the others, each of which says of itself what a test has it say."""

    def __init__(self) -> None:
        self.returned = 0
        fabric = MemoryFabric()
        self.host = ServiceHost("motion")
        self.host.attach(MemoryBus(fabric, "cell", "motion/test"))
        self.host.enter_trial("t")
        self.peers = Peers(self.host, self._count)
        self.buses = {name: MemoryBus(fabric, "cell", f"{name}/test") for name in LOOP}
        self._health = {name: bus.publisher(HEALTH.of(service=name)) for name, bus in
                        self.buses.items()}  # fmt: skip

    def _count(self) -> None:
        self.returned += 1

    def say(self, service: str, token: str = "", **fields: Any) -> None:
        if token:
            self.buses[service].announce(f"{token}/{service}")
        else:
            told: dict[str, Any] = {"trial": "t", "tick": 5, "state": "ready", **fields}
            self._health[service].put(
                Health(
                    service=service, rss_bytes=1, cpu_percent=0.0, received=0, published=0,
                    malformed=0, refused=0, wrong_trial=0, queue_depth=0, queue_dropped=0, gaps=0,
                    facts={}, **told,
                )
            )  # fmt: skip
        while self.host.drain(0.0):
            pass


@pytest.fixture
def theatre() -> Iterator[Theatre]:
    made = Theatre()
    for service in ("sim", "sa"):
        made.say(service, "alive")
    yield made
    made.host.bus.close()
    for bus in made.buses.values():
        bus.close()


def test_the_patient_is_named_where_situation_awareness_says_that_it_waits_for_it(
    theatre: Theatre,
) -> None:
    theatre.say("sim", tick=5)
    assert theatre.peers.missing(5) == "sa"
    theatre.say("sa", state="waiting: patient")
    assert theatre.peers.missing(5) == "patient"
    theatre.say("sim", tick=4)
    assert theatre.peers.missing(5) == "sim"
    theatre.say("sim", tick=5)
    theatre.say("sa", state="waiting: patient", trial="yesterday")
    assert theatre.peers.missing(5) == "sa"
    theatre.say("sa", state="ready")
    assert theatre.peers.missing(5) == "sa"


def test_what_was_said_is_said_again_to_a_patient_that_is_back(theatre: Theatre) -> None:
    theatre.say("patient", "ready")
    assert theatre.returned == 1
