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
    """

    def __init__(self, name: str, build: Callable[[ServiceHost], Service], client: str) -> None:
        self.fabric = fabric = MemoryFabric()
        self.client = MemoryBus(fabric, "cell", client)
        self.fabric = fabric
        self.host = ServiceHost(name)
        self.host.attach(
            MemoryBus(fabric, "cell", f"{name}/test", on_malformed=self.host.count_malformed)
        )
        self.service = build(self.host)

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
        self.client.close()
