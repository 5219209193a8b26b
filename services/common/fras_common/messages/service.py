"""What every service says about itself."""

import msgspec

from fras_common.messages.base import Header, TrialName, Wire
from fras_common.scenario.model import Scenario


class ResetRequest(Wire, frozen=True, kw_only=True):
    """Begin a trial: from now on messages of any other trial are dropped and counted."""

    trial: TrialName
    scenario: Scenario
    mesh: bytes = b""


class ResetReply(Wire, frozen=True, kw_only=True):
    """Digest of the request as the service understood it; the executive compares them."""

    digest: str


class Health(Header, frozen=True, kw_only=True):
    """Twice a second from every service.

    Attributes
    ----------
    state : str
        `starting`, `ready`, or `waiting: <service>`.
    rss_bytes, cpu_percent : int, float
        Resident memory and processor share (100 = one core) since the last report.
    received, published : int
        Messages since the start.
    malformed, refused, wrong_trial, queue_dropped, gaps : int
        Messages refused by the codec, by the handler for what they say, of another trial, for
        lack of room, and sequence gaps.
    refusals : dict
        What was refused or stopped since the start, by the name of what did it: a safeguard of
        motion (docs/reference/safety.md), else the type of the error.
    loop_lag_s : float
        How long the loop has not turned: the age of a job that waits in the inbox since an earlier
        report; 0 if that one is done.
    facts : dict
        What only this service can say, e.g. which linear solver it uses.
    """

    service: str
    state: str
    rss_bytes: int
    cpu_percent: float
    received: int
    published: int
    malformed: int
    refused: int
    wrong_trial: int
    queue_depth: int
    queue_dropped: int
    gaps: int
    facts: dict[str, str]
    refusals: dict[str, int] = msgspec.field(default_factory=dict[str, int])
    loop_lag_s: float = 0.0


class LogRecord(Header, frozen=True, kw_only=True):
    """A structured log record from WARNING up."""

    level: str
    event: str
    fields: dict[str, str]


class Fault(Wire, frozen=True, kw_only=True):
    """An error that travels: the type's name and a text that says what to do."""

    kind: str
    text: str


class FaultRecord(Header, frozen=True, kw_only=True):
    """A message that a service refused for what it says, and why.

    Attributes
    ----------
    key : str
        Where the message came in; its tick and trial are those of this record.
    kind : str
        Name of the error's type.
    values : dict
        The numbers and names behind the text.
    """

    key: str
    kind: str
    text: str
    values: dict[str, str]


NIL = msgspec.Raw(b"\xc0")


class RpcRecord(Header, frozen=True, kw_only=True):
    """Mirror of one query: queries are invisible to subscribers, the audit log must hold them.

    Attributes
    ----------
    request, reply : Raw
        As they travelled; the reply is nil where a fault came back. (Not optional in its type:
        msgspec can't decode a union with Raw.)
    """

    key: str
    request: msgspec.Raw
    reply: msgspec.Raw
    fault: Fault | None
    duration_s: float
