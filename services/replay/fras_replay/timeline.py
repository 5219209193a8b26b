"""When each message of a log is due, and where its ticks begin and end; no clock, no bytes.

A place in a log is how many messages stand before it and the log's time there: several messages
may be due at one time, and a filter may leave ticks without any.
"""

from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple


class Place(NamedTuple):
    """A place in a log; places are ordered.

    Attributes
    ----------
    before : int
        Messages before it.
    at_ns : int
        Time since the log's first message [ns].
    """

    before: int
    at_ns: int


@dataclass(frozen=True)
class Ticks:
    """Places that belong to ticks, both in their order.

    Attributes
    ----------
    places : list of Place
    numbers : list of int
        The tick of each; of one trial, so they only rise.
    """

    places: list[Place]
    numbers: list[int]


@dataclass(frozen=True)
class Timeline:
    """A log as a schedule.

    Attributes
    ----------
    due_ns : array of int
        When each message is due, from the log's first message [ns]; never falls.
    duration_ns : int
        From the first to the last message of the log, sent or not [ns].
    starts : Ticks
        Before the robot state with which each tick begins.
    verdicts : Ticks
        After the verdict with which each tick ends.
    lasting : mapping of int to array of int
        By key, the messages that say how things stand, which is what a seek has to show again.
    """

    due_ns: "array[int]"
    duration_ns: int
    starts: Ticks
    verdicts: Ticks
    lasting: Mapping[int, "array[int]"]

    @property
    def begin(self) -> Place:
        """Before everything."""
        return Place(0, 0)

    @property
    def end(self) -> Place:
        """After everything."""
        return Place(len(self.due_ns), self.duration_ns)

    def at(self, at_ns: int) -> Place:
        """Return the place at a time of the log: what is due then has not been sent."""
        at_ns = min(max(at_ns, 0), self.duration_ns)
        if at_ns == self.duration_ns:
            return self.end
        return Place(bisect_left(self.due_ns, at_ns), at_ns)

    def before_tick(self, tick: int) -> Place:
        """Return the place where a tick begins, or the end if it never does."""
        number = bisect_left(self.starts.numbers, tick)
        return self.starts.places[number] if number < len(self.starts.places) else self.end

    def after_tick(self, tick: int) -> Place:
        """Return the place after a tick's verdict, or the last one before it; else the start."""
        number = bisect_right(self.verdicts.numbers, tick) - 1
        return self.verdicts.places[number] if number >= 0 else self.begin

    def tick(self, place: Place) -> int:
        """Return the tick of the last robot state before a place; -1 before the first."""
        number = bisect_left(self.starts.places, place)
        return self.starts.numbers[number - 1] if number else -1

    @property
    def last_tick(self) -> int:
        """Last tick of the log, -1 if there is none."""
        return self.starts.numbers[-1] if self.starts.numbers else -1

    def next_verdict(self, place: Place) -> Place:
        """Return the place after the next verdict, or the end if there is none."""
        number = bisect_right(self.verdicts.places, place)
        return self.verdicts.places[number] if number < len(self.verdicts.places) else self.end

    def previous_verdict(self, place: Place) -> Place:
        """Return the place after the last verdict before a place, or the start."""
        number = bisect_left(self.verdicts.places, place) - 1
        return self.verdicts.places[number] if number >= 0 else self.begin

    def picture(self, index: int) -> list[int]:
        """Return the messages that say how things stand at a place, in the log's order."""
        found = (
            messages[number]
            for messages in self.lasting.values()
            if (number := bisect_left(messages, index) - 1) >= 0
        )
        return sorted(found)

    def unsaid(self, index: int) -> list[int]:
        """Return the keys that tell how things stand, but had not yet at a place."""
        return [key for key, messages in self.lasting.items() if messages[0] >= index]
