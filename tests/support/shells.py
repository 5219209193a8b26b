"""A service's shell on an in-memory bus, driven by hand, and a client that plays its peers."""

from collections.abc import Callable
from typing import Any

from fras_common.bus import MemoryBus, MemoryFabric
from fras_common.errors import FrasError
from fras_common.service import Service, ServiceHost

ANSWER_S = 30.0


class ShellBench:
    """One shell; nothing happens but in `settle`.

    Parameters
    ----------
    name : str
        Service in the topic table.
    build : callable
        Makes the shell on its host.
    client : str
        Source that the client's messages bear.
    fabric : MemoryFabric, optional
        One that others are on already.
    instance : str
        Of the shell's process: each life has its own.
    """

    def __init__(
        self,
        name: str,
        build: Callable[[ServiceHost], Service],
        client: str,
        fabric: MemoryFabric | None = None,
        instance: str = "test",
    ) -> None:
        self.fabric = fabric = fabric or MemoryFabric()
        self.client = MemoryBus(fabric, "cell", client)
        self._peers: dict[str, MemoryBus] = {}
        self.host = ServiceHost(name)
        self.host.attach(
            MemoryBus(fabric, "cell", f"{name}/{instance}", on_malformed=self.host.count_malformed)
        )
        self.service = build(self.host)

    def peers(self, topic: Any) -> Any:
        """Publisher of a topic, as the service that the table says."""
        if topic.producer not in self._peers:
            self._peers[topic.producer] = MemoryBus(self.fabric, "cell", f"{topic.producer}/test")
        return self._peers[topic.producer].publisher(topic)

    def heard(self, topic: Any) -> list[Any]:
        """List that fills with the messages of a key."""
        messages: list[Any] = []
        self.client.subscribe(topic, messages.append)
        return messages

    def settle(self) -> None:
        """Do what is due and handle everything that is there."""
        self.service.wake()
        while self.host.drain(0.0):
            self.service.wake()

    def kill(self) -> None:
        """End the shell without a word, its caches and tokens with it."""
        self.host.bus.close()

    def ask(self, query: Any, request: Any) -> list[Any]:
        """Ask; the list fills when the answer comes, now or later."""
        answers: list[Any] = []
        self.client.ask(query, request, answers.append, ANSWER_S)
        self.settle()
        return answers

    def answer(self, query: Any, request: Any) -> Any:
        """Ask what is answered at once; an error that comes back is raised."""
        (answer,) = self.ask(query, request)
        if isinstance(answer, FrasError):
            raise answer
        return answer

    def close(self) -> None:
        """Leave the bus."""
        self.host.bus.close()
        for bus in (self.client, *self._peers.values()):
            bus.close()
