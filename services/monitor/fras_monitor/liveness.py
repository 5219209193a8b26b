"""Who speaks, who is late, who has gone: by liveliness and health, as functions of the time."""

from dataclasses import dataclass
from typing import Final, Literal

from fras_common.topics import SERVICES
from fras_monitor.picture import Picture
from fras_monitor.words import service_in_words

Life = Literal["ready", "waiting", "late", "dead", "absent"]

# Health comes twice a second: two in a row are missing. A picture redrawn 20 times a second so
# shows what is late within 1.5 s.
LATE_S: Final = 1.2
DEAD_S: Final = 5.0
LOOP: Final = ("motion", "sim", "sa")
"""Without one of them nothing moves, and what is seen is old."""


@dataclass(frozen=True)
class ServiceLife:
    """How one service is, for a light and a few words beside it."""

    name: str
    life: Life
    words: str


@dataclass(frozen=True)
class Freshness:
    """Whether what is shown is now, and if not, why, in words."""

    live: bool
    words: str


def life_of(picture: Picture, service: str, now_s: float) -> ServiceLife:
    """Judge one service."""
    present = picture.is_there(service)
    heard = picture.health.get(service)
    if heard is None:
        state: Life = "waiting" if present else "absent"
        return ServiceLife(service, state, "starting" if present else "not there")
    silent_s = now_s - heard.at_s
    if not present:
        return ServiceLife(service, "dead", f"gone for {silent_s:.0f} s")
    if silent_s > LATE_S:
        state = "dead" if silent_s > DEAD_S else "late"
        return ServiceLife(service, state, f"silent for {silent_s:.1f} s")
    told = heard.message.state
    if told == "ready":
        return ServiceLife(service, "ready", "working")
    if told.startswith("replay: "):
        return ServiceLife(service, "ready", told.removeprefix("replay: ").split(" ")[0])
    _, _, awaited = told.partition("waiting: ")
    words = f"waits for the {service_in_words(awaited)}" if awaited else "starting"
    return ServiceLife(service, "waiting", words)


def lives(picture: Picture, now_s: float) -> tuple[ServiceLife, ...]:
    """Judge every service of a stack."""
    return tuple(life_of(picture, service, now_s) for service in SERVICES)


def freshness(picture: Picture, now_s: float) -> Freshness:
    """Judge whether what is shown is how things stand."""
    if picture.is_replay:
        return Freshness(live=True, words="Replay of a recording: nothing here moves an arm.")
    judged = [life_of(picture, service, now_s) for service in LOOP]
    if all(one.life == "absent" for one in judged):
        return Freshness(live=False, words="Waiting for the system to start.")
    lost = [one for one in judged if one.life in ("late", "dead", "absent")]
    if lost:
        who = ", ".join(f"the {service_in_words(one.name)} {_been(one)}" for one in lost)
        return Freshness(live=False, words=f"Not live: {who}.")
    return Freshness(live=True, words="Live.")


def _been(one: ServiceLife) -> str:
    return f"is {one.words}" if one.life == "absent" else f"has been {one.words}"
