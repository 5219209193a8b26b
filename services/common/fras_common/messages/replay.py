"""What a replay is told and answers: everything that a time line needs."""

from typing import Literal

import msgspec

from fras_common.messages.base import Wire, require_finite

MarkKind = Literal[
    "plan", "re_plan", "crossing", "action_start", "action_end", "hold", "resume", "ended"
]
ReplayPhase = Literal["playing", "paused", "ended"]
ReplayCommand = Literal[
    "play",
    "pause",
    "step",
    "back",
    "seek_s",
    "seek_tick",
    "seek_mark",
    "next_mark",
    "previous_mark",
    "rate",
    "loop",
    "stop",
]


class ReplayMark(Wire, frozen=True, kw_only=True):
    """A place of interest; seeking to it shows what it tells of.

    Attributes
    ----------
    position_s : float
        From the log's first message.
    log_time_ns : int
        When the recorder got it [ns since the Unix epoch].
    """

    number: int
    kind: MarkKind
    position_s: float
    log_time_ns: int
    tick: int
    text: str


class ReplayControl(Wire, frozen=True, kw_only=True):
    """Tell a replay what to do; `value` is ignored where a command needs none.

    Attributes
    ----------
    command : str
        `play`, `pause`; `step`, `back`: to the verdict of the next tick, the previous one;
        `seek_s` [s from the log's start], `seek_tick`, `seek_mark` (its number), `next_mark`,
        `previous_mark`; `rate` (0: as fast as possible); `loop` (0 or 1); `stop`.
    """

    command: ReplayCommand
    value: float = 0.0

    def __post_init__(self) -> None:
        require_finite("value", self.value)


class ReplayStatusRequest(Wire, frozen=True, kw_only=True):
    """Ask where a replay stands; `marks`: tell the marks, too, once for a time line."""

    marks: bool = False


class ReplayStatus(Wire, frozen=True, kw_only=True):
    """Where a replay stands.

    Attributes
    ----------
    phase : {"playing", "paused", "ended"}
    position_s, begin_s, end_s, duration_s : float
        From the log's first message: now, the part that is played, all of it.
    log_time_ns : int
        When the recorder got what is played now [ns since the Unix epoch].
    tick, last_tick : int
        Tick of the last robot state sent, and of the log's last; -1 before the first.
    rate : float
        Seconds of the log a second; 0: as fast as possible.
    laps : int
        How often it began anew by itself.
    mark : int
        Number of the last mark passed, or -1.
    messages, of : int
        How many of the log's messages stand before the position, and how many there are.
    log, trial : str
        The file, and the trial in it.
    damage : list of str
        What of the file could not be read, and so is not played.
    marks : list
        Empty unless asked for.
    """

    phase: ReplayPhase
    position_s: float
    begin_s: float
    end_s: float
    duration_s: float
    log_time_ns: int
    tick: int
    last_tick: int
    rate: float
    loop: bool
    laps: int
    mark: int
    messages: int
    of: int
    log: str
    trial: str
    damage: list[str]
    marks: list[ReplayMark] = msgspec.field(default_factory=list[ReplayMark])
