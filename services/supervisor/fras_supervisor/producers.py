"""Which service a process runs, and that no key has two producers."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Final, Protocol

from fras_common.topics import TOPICS
from fras_supervisor.errors import TableError

_MODULES: Final = {
    "fras_common.router": "router",
    "fras_motion.arms_main": "arms",
    "fras_sim.patient_main": "patient",
}


class Commanded(Protocol):
    """What these checks need to know of a process."""

    @property
    def command(self) -> tuple[str, ...]:
        """Program and arguments."""
        ...

    @property
    def host(self) -> str:
        """Where it runs."""
        ...

    @property
    def readiness(self) -> str:
        """The condition that makes it ready."""
        ...


def service_of(command: Sequence[str]) -> str:
    """Name the service that a command runs: `python -m fras_sim` or `fras sim`; empty if none.

    `_main` at the end of a module's name is how a second service of a package is called.
    """
    words = tuple(command)
    if "-m" in words[:-1]:
        module = words[words.index("-m") + 1]
        if module in _MODULES:
            return _MODULES[module]
        return module.removeprefix("fras_") if module.startswith("fras_") else ""
    if words[0].rpartition("/")[2] == "fras" and len(words) > 1:
        return words[1]
    return ""


def keys_of(command: Sequence[str]) -> tuple[str, ...]:
    """List the keys and families that a command's service alone may produce."""
    service = service_of(command)
    produced = tuple(topic.key for topic in TOPICS if topic.producer == service)
    if service == "motion" and not _drives_crtk(command):
        # The simulated arms are motion's own.
        produced += tuple(topic.key for topic in TOPICS if topic.producer == "arms")
    return produced


def check_producers(source: str, processes: Mapping[str, Commanded]) -> None:
    """Refuse two processes that run one service, or produce one key, and one that can't be ready.

    Raises
    ------
    TableError
    """
    services: dict[tuple[str, str], str] = {}
    producers: dict[str, str] = {}
    for name, process in processes.items():
        key = f"process.{name}.command"
        service = service_of(process.command)
        shown = " ".join(process.command)
        if service:
            # Each host has a router of its own, and the cell one of everything else.
            place = (service, process.host if service == "router" else "")
            if (other := services.setdefault(place, name)) != name:
                allowed = f"each service once, and process.{other} runs {service} already"
                raise TableError(source, key, shown, allowed)
            if process.readiness in ("token", "alive") and service != name:
                token = "ready" if process.readiness == "token" else "alive"
                allowed = (
                    f"a process of the name of the service it runs: {service} says "
                    f"{token}/{service}, and {token}/{name} would be waited for"
                )
                raise TableError(source, f"process.{name}", name, allowed)
        for one in keys_of(process.command):
            if (other := producers.setdefault(one, name)) != name:
                allowed = f"one producer a key, and process.{other} produces {one} already"
                raise TableError(source, key, shown, allowed)


def _drives_crtk(command: Sequence[str]) -> bool:
    words = tuple(command)
    return "--driver=crtk" in words or ("--driver", "crtk") in pairwise(words)
