"""What is due now: play, pause, step, seek, rate and loop over a time line; time is an argument.

Notes
-----
While it plays at a rate r, the log's time at the clock's time t is ``at + r (t - since)``; each
change of rate or state begins a new such line at the place where the old one stood.
"""

from bisect import bisect_right
from dataclasses import dataclass, replace
from math import ceil
from typing import Literal, NamedTuple

from fras_replay.errors import BadRate
from fras_replay.timeline import Place, Timeline

State = Literal["playing", "paused", "ended"]
SLOWEST, FASTEST = 0.1, 100.0
UNLIMITED = 0.0
# Further behind than this the schedule gives way: who can't keep up must not answer a pause with
# all that it owes.
SLIP_NS = 250_000_000


class Due(NamedTuple):
    """What to send now, and how the replay stands then.

    Attributes
    ----------
    player : Player
    first, stop : int
        Messages of the log, `stop` excluded.
    """

    player: "Player"
    first: int
    stop: int


@dataclass(frozen=True)
class Player:
    """A replay at one moment; every method that changes it returns another one.

    Parameters
    ----------
    timeline : Timeline
    begin, end : Place
        The part that is played.
    rate : float
        Seconds of the log a second; `UNLIMITED` (0): as fast as possible.
    loop : bool
        Begin anew at the end.
    state : {"playing", "paused", "ended"}
    index : int
        Messages before the place where it stands.
    at_ns, since_ns : int
        The log's time, and the clock's time at which that was so [ns].
    laps : int
        How often it began anew.
    """

    timeline: Timeline
    begin: Place
    end: Place
    rate: float = 1.0
    loop: bool = False
    state: State = "playing"
    index: int = 0
    at_ns: int = 0
    since_ns: int = 0
    laps: int = 0

    def place(self, now_ns: int) -> Place:
        """Where it stands now."""
        return Place(self.index, self._log_time(now_ns))

    def take(self, now_ns: int, most: int) -> Due:
        """Take what is due now, `most` messages at a time; at the end, end or begin anew."""
        if self.state != "playing":
            return Due(self, self.index, self.index)
        at_ns = self.end.at_ns if self.rate == UNLIMITED else self._log_time(now_ns)
        due_ns = self.timeline.due_ns
        due = bisect_right(due_ns, at_ns, self.index, self.end.before)
        stop = min(due, self.index + most)
        player = replace(self, index=stop)
        if stop < due:
            behind_ns = at_ns - due_ns[stop]
            if self.rate == UNLIMITED or behind_ns > SLIP_NS * self.rate:
                player = replace(player, at_ns=due_ns[stop], since_ns=now_ns)
        elif stop == self.end.before and at_ns >= self.end.at_ns:
            player = self._finish(now_ns)
        return Due(player, self.index, stop)

    def due_at_ns(self, message: int) -> int:
        """When a message is due by the clock [ns]; as fast as possible: always."""
        if self.rate == UNLIMITED:
            return self.since_ns
        return self.since_ns + ceil((self.timeline.due_ns[message] - self.at_ns) / self.rate)

    def next_ns(self) -> int | None:
        """When there is something to take next by the clock [ns]; None: not by itself."""
        if self.state != "playing":
            return None
        if self.rate == UNLIMITED:
            return self.since_ns
        if self.index < self.end.before:
            return self.due_at_ns(self.index)
        return self.since_ns + ceil((self.end.at_ns - self.at_ns) / self.rate)

    def play(self, now_ns: int) -> "Player":
        """Go on; from the end, begin anew."""
        if self.state == "ended":
            return replace(self.seek(self.begin, now_ns), state="playing")
        return replace(self, state="playing", since_ns=now_ns) if self.state == "paused" else self

    def pause(self, now_ns: int) -> "Player":
        """Stand still."""
        return replace(self._anchored(now_ns), state="paused") if self.state == "playing" else self

    def step(self, now_ns: int) -> Due:
        """Take everything up to and including the next tick's verdict, and stand still there."""
        place = min(self.timeline.next_verdict(self.place(now_ns)), self.end)
        state: State = "ended" if place == self.end else "paused"
        player = replace(self, index=place.before, at_ns=place.at_ns, since_ns=now_ns, state=state)
        return Due(player, self.index, place.before)

    def back(self, now_ns: int) -> "Player":
        """Stand still after the verdict before."""
        place = self.timeline.previous_verdict(self.place(now_ns))
        return replace(self.seek(place, now_ns), state="paused")

    def seek(self, place: Place, now_ns: int) -> "Player":
        """Go to a place of the part that is played; one that had ended stands still there."""
        place = min(max(place, self.begin), self.end)
        state: State = "paused" if self.state == "ended" else self.state
        return replace(self, index=place.before, at_ns=place.at_ns, since_ns=now_ns, state=state)

    def at_rate(self, rate: float, now_ns: int) -> "Player":
        """Go on from here at another rate.

        Raises
        ------
        BadRate
        """
        return replace(self._anchored(now_ns), rate=checked_rate(rate))

    def looping(self, loop: bool) -> "Player":
        """Begin anew at the end, or not."""
        return replace(self, loop=loop)

    def _log_time(self, now_ns: int) -> int:
        if self.state != "playing" or self.rate == UNLIMITED:
            return self.at_ns
        gone_ns = int(max(0, now_ns - self.since_ns) * self.rate)
        return min(self.at_ns + gone_ns, self.end.at_ns)

    def _anchored(self, now_ns: int) -> "Player":
        return replace(self, at_ns=self._log_time(now_ns), since_ns=now_ns)

    def _finish(self, now_ns: int) -> "Player":
        if self.loop:
            return replace(self.seek(self.begin, now_ns), laps=self.laps + 1)
        return replace(self.seek(self.end, now_ns), state="ended")


def checked_rate(rate: float) -> float:
    """Return the rate if it can be kept.

    Raises
    ------
    BadRate
    """
    if rate != UNLIMITED and not SLOWEST <= rate <= FASTEST:
        raise BadRate(rate, SLOWEST, FASTEST)
    return rate
