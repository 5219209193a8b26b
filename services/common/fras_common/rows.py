"""What a row of the topic table says: of a published key, and of a question."""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, Generic, TypeVar

from fras_common import messages as m
from fras_common.codec import MAX_MESSAGE_BYTES

M = TypeVar("M", bound=m.Header)
Req = TypeVar("Req")
Rep = TypeVar("Rep")

SMALL: Final = 64 * 2**10
"""Commands and questions [bytes]: names, a few numbers, a sentence."""
USUAL: Final = 2**20
"""What says how things stand [bytes]."""
WORDY: Final = 16 * 2**20
"""Contexts and plans [bytes]: thousands of atoms, at the finest grid of blocks."""
BULK: Final = MAX_MESSAGE_BYTES
"""What carries a mesh, or other messages [bytes]."""

KEPT: Final = 1000
"""Messages of a key: five seconds of ticks as fast as possible, or hundreds of a trial's events."""
SOME: Final = 100
"""Of what is larger and comes less often."""
FEW: Final = 16
"""Of what carries a mesh or other messages, and comes a few times in a trial."""


class Qos(StrEnum):
    """How a topic travels, and why.

    STATE: reliable, dropped under congestion and then recovered from the publisher's cache;
    never blocking, because one frozen subscriber would stop the loop for everyone.
    EVENT: the same, and the last value is kept for whoever comes later (latched).
    TELEMETRY: best effort; the next one replaces a lost one.
    COMMAND: reliable, but never kept: what was told to an arm before it listened, or while the
    network was cut, must not move it later.
    """

    COMMAND = "command"
    STATE = "state"
    EVENT = "event"
    TELEMETRY = "telemetry"


@dataclass(frozen=True)
class Topic(Generic[M]):
    """One published key.

    Attributes
    ----------
    producer : str
        A service; `*`: each of them; `arms`: whoever drives the robot; `client`: anyone.
    in_trial : bool
        Belongs to a trial: a service drops and counts it outside the trial of its last reset.
    max_bytes : int
        A longer payload is malformed, whatever it says.
    kept : int
        How many the publisher keeps for who lost them or comes late, and the recorder remembers.
    awaited : bool
        Somebody does nothing until it has come, and none follows by which its loss would show: who
        lost it is to learn so at once.
    """

    key: str
    type: type[M]
    producer: str
    qos: Qos
    when: str
    in_trial: bool = True
    max_bytes: int = USUAL
    kept: int = KEPT
    awaited: bool = False

    def of(self, **names: str) -> "Topic[M]":
        """Fill the placeholder: `HEALTH.of(service="sim")`."""
        return replace(self, key=self.key.format(**names))

    @property
    def wildcard(self) -> str:
        """Key expression that matches the whole family."""
        head, brace, _ = self.key.partition("{")
        return f"{head}**" if brace else self.key


@dataclass(frozen=True)
class Query(Generic[Req, Rep]):
    """One question that one service answers; mirrored on `rpc/<server>/<name>`.

    Attributes
    ----------
    askers : tuple of str
        Whose certificates may ask it under the security profile; `*`: each. Nobody by default.
    max_bytes : int
        A longer request is malformed.
    kept : int
        How many mirrors the publisher keeps, and the recorder remembers.
    """

    key: str
    request: type[Req]
    reply: type[Rep]
    server: str
    askers: tuple[str, ...] = ()
    max_bytes: int = SMALL
    kept: int = KEPT

    @property
    def mirror(self) -> str:
        """Key of the mirror."""
        return f"rpc/{self.server}/{self.key.partition('/')[2]}"
