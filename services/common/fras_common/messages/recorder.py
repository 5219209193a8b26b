"""Commands to the recorder and its status."""

from typing import Literal

import msgspec

from fras_common.messages.base import Header, TrialName, Wire
from fras_common.scenario.model import Scenario


class OpenRequest(Wire, frozen=True, kw_only=True):
    """Start the log of a trial in `directory` (on the recorder's host).

    Attributes
    ----------
    rules : dict of str to str
        The rule files by which the planner decides, text by path below `asp/`: by value, for the
        recorder may stand elsewhere. None where no planner asks, or one of an older version.
    """

    trial: TrialName
    scenario: Scenario
    mesh: bytes
    directory: str
    rules: dict[str, str] = msgspec.field(default_factory=dict[str, str])


class CloseRequest(Wire, frozen=True, kw_only=True):
    """Finish the log once it holds every tick up to `last_tick` and the status `status_seq`."""

    trial: str
    last_tick: int
    status_seq: int


class LastRequest(Wire, frozen=True, kw_only=True):
    """Ask for the last message of a key, in a trial or not."""

    key: str


class LastReply(Wire, frozen=True, kw_only=True):
    """It as it travelled; empty if none was heard."""

    payload: bytes


class SinceRequest(Wire, frozen=True, kw_only=True):
    """Ask for the messages of a key from a tick on, of its latest trial."""

    key: str
    tick: int


class SinceReply(Wire, frozen=True, kw_only=True):
    """They as they travelled, in the order in which they arrived.

    Attributes
    ----------
    forgotten : bool
        Whether there may have been earlier ones that the recorder no longer remembers.
    more : bool
        Whether there are later ones that did not fit: ask again from the last one's tick on.
    """

    payloads: list[bytes]
    forgotten: bool
    more: bool


class CloseReply(Wire, frozen=True, kw_only=True):
    """What the finished file holds."""

    path: str
    messages: int
    lost: int


EventKind = Literal["present", "absent", "gap"]


class RecorderEvent(Header, frozen=True, kw_only=True):
    """What the recorder saw that is no message: it is one so that it stands in the log.

    Attributes
    ----------
    kind : {"present", "absent", "gap"}
        A liveliness token came or went; messages of a publisher never arrived.
    subject : str
        The token (`ready/sim/3f2a`), or key and publisher of what is missing.
    count : int
        Messages missing; 0 for tokens.
    """

    kind: EventKind
    subject: str
    count: int


LogState = Literal["idle", "recording", "behind", "closed", "error"]


class RecorderStatus(Header, frozen=True, kw_only=True):
    """State of the log; latched.

    Attributes
    ----------
    state : {"idle", "recording", "behind", "closed", "error"}
        `behind`: so much waits to be written that motion must wait, too.
    """

    state: LogState
    path: str
    messages: int
    bytes: int
    lost: int
    reason: str
