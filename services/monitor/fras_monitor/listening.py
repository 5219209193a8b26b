"""Everything that the page hears of its cell, on the bus's threads, and into one mailbox."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from fras_common import messages as m
from fras_common.bus import Recent
from fras_common.codec import MalformedMessage, decode
from fras_common.errors import FrasError
from fras_common.service import ServiceHost
from fras_common.topics import (
    ACTION_RESULT,
    CONTEXT,
    HEALTH,
    HOLDS,
    PLAN,
    RECORDER_LAST,
    RECORDER_STATUS,
    ROBOT_STATE,
    SUPERVISOR_STATUS,
    TASK_STATUS,
    TISSUE_MODEL,
    TISSUE_STATE,
    VERDICT,
    Topic,
)
from fras_monitor.mail import Mail
from fras_monitor.pace import Due
from fras_monitor.picture import Picture, apply, remembered, with_token

ANSWER_S: Final = 2.0
VERDICTS: Final = 500
"""Each is a point of a plot: more than may come between two pictures."""
MOST_GLANCE_S: Final = 0.1
"""For how long states are waited for: a trial may stand."""
CATCH_UP_S: Final = 0.5

# Of these only the latest counts; of the others each does.
LATEST: Final[tuple[Topic[Any], ...]] = (TISSUE_MODEL, CONTEXT, RECORDER_STATUS)
EACH: Final[tuple[Topic[Any], ...]] = (
    PLAN, TASK_STATUS, ACTION_RESULT, HOLDS, SUPERVISOR_STATUS,
)  # fmt: skip
STATES: Final[tuple[Topic[Any], ...]] = (TISSUE_STATE, ROBOT_STATE)
# Not latched: who opens the page between two actions would see nothing of them.
MISSED: Final[tuple[Topic[Any], ...]] = (*STATES, VERDICT, CONTEXT)


@dataclass(frozen=True)
class _Token:
    name: str
    present: bool


@dataclass(frozen=True)
class _Remembered:
    message: m.Header


class Listener:
    """Subscribes to what the page shows; `look` gives the picture of it.

    Parameters
    ----------
    host : ServiceHost
    """

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        self._mail = Mail()
        self._looked_s = time.monotonic()
        self.picture = Picture()
        bus = host.bus
        topic: Topic[Any]
        for topic in LATEST:
            bus.subscribe(topic, self._keep_latest(topic.key))
        for topic in EACH:
            bus.subscribe(topic, self.note)
        # Said each tick, which may be far more often than anything is drawn: looked at before that.
        self._states: tuple[Recent[m.Header], ...] = (
            bus.recent(TISSUE_STATE, 1),
            bus.recent(ROBOT_STATE, 1),
        )
        self._verdicts = bus.recent(VERDICT, VERDICTS)
        self._pauses = False
        self._missing: set[type] = set()
        self._missing_until_s = 0.0
        self._catching_up = Due(CATCH_UP_S)
        bus.subscribe(HEALTH, self._on_health)
        bus.watch_tokens(lambda name, present: self.note(_Token(name, present)))
        self._catch_up(*MISSED)

    def note(self, message: object) -> None:
        """Take in a message, or an answer to a question of the page; on any thread."""
        self._mail.append(message, time.monotonic())

    def look(self) -> Picture:
        """Take in what has arrived, and return all that is known."""
        # Verdicts first: none is on a state that is not taken then.
        for recent in (self._verdicts, *self._states):
            for message in recent.take():
                self._missing.discard(type(message))
                # At some time since then: of a state and the holds, which motion says as they
                # change, what was heard meanwhile is the later word.
                self._mail.append(message, self._looked_s)
        self._looked_s = time.monotonic()
        for message, at_s in self._mail.take():
            self.picture = _with(self.picture, message, at_s)
        self._host.counts["received"] = self._mail.received
        self._host.counts["queue_dropped"] = self._mail.dropped
        return self.picture

    def hear(self, *, sparingly: bool) -> None:
        """Hear each state, or none until `has_states`: most are replaced before the next picture.

        Of who hears each, and yet lacks some that were judged, the recorder is asked for them.
        """
        if sparingly:
            self._pauses = True
            for recent in self._states:
                recent.pause()
        elif self._lacks_states() and self._catching_up.take(time.monotonic()):
            self._catch_up(*STATES)

    def _lacks_states(self) -> bool:
        # In a replay that was set back verdicts of later may stand for a while.
        return self.picture.is_behind and not self.picture.is_replay

    def has_states(self, now_s: float) -> bool:
        """Hear states again if none were heard; whether one of each has come since, or will not."""
        if self._pauses:
            for recent in self._states:
                recent.resume()
            self._pauses = False
            self._missing = {one.type for one in STATES}
            self._looked_s, self._missing_until_s = now_s, now_s + MOST_GLANCE_S
        elif self._missing:
            self.look()
        return not self._missing or now_s >= self._missing_until_s

    def _catch_up(self, *topics: Topic[Any]) -> None:
        for topic in topics:
            request = m.LastRequest(key=topic.key)
            self._host.bus.ask(RECORDER_LAST, request, self._take_last(topic), ANSWER_S)

    def _keep_latest(self, key: str) -> Callable[[m.Header], None]:
        return lambda message: self._mail.replace(key, message, time.monotonic())

    def _on_health(self, health: m.Health) -> None:
        self._mail.replace(("health", health.service), health, time.monotonic())

    def _take_last(self, topic: Topic[Any]) -> Callable[[m.LastReply | FrasError], None]:
        def on_done(answer: m.LastReply | FrasError) -> None:
            # No recorder, or it has heard nothing: then there is nothing to see yet.
            if isinstance(answer, FrasError) or not answer.payload:
                return
            try:
                message = decode(topic.type, answer.payload, topic.key, topic.max_bytes)
            except MalformedMessage as error:
                self._host.count_malformed(error)
                return
            self.note(_Remembered(message))

        return on_done


def _with(picture: Picture, message: object, at_s: float) -> Picture:
    match message:
        case _Token(name, present):
            return with_token(picture, name, present)
        case _Remembered(what):
            return remembered(picture, what)
        case _:
            return apply(picture, message, at_s)
