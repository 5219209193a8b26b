"""Who listens without losses: asks caches for what did not arrive."""

import threading
import time
from collections.abc import Callable, Iterable

from fras_common.bus.contract import RawSample
from fras_common.bus.past import Beat, Cached, Get, latest_selector
from fras_common.bus.recovery import Ask, Earlier, Recovery

__all__ = ["Asker", "Hearing"]

ANSWER_S = 10.0
"""A publisher that is busy answers late."""
BEATS_S = 0.1
"""How often what publishers repeat of their numbers is looked at: each time they may have."""


class Asker:
    """The thread on which all that a participant misses is asked for, begun when it is needed."""

    def __init__(self) -> None:
        self._hearings: tuple[Hearing, ...] = ()
        self._is_closed = False
        self._is_changed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="recovery", daemon=True)

    def add(self, hearing: "Hearing") -> None:
        """Ask for one more."""
        with self._changed:
            if not self._hearings:
                self._thread.start()
            self._hearings = (*self._hearings, hearing)

    def look(self) -> None:
        """See what is due: something has changed."""
        with self._changed:
            self._is_changed = True
            self._changed.notify()

    def close(self) -> None:
        """Ask no more."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        beats_s = 0.0
        while True:
            with self._changed:
                if self._is_closed:
                    return
                self._is_changed = False
                hearings = self._hearings
            if time.monotonic() >= beats_s:
                for one in hearings:
                    one.take_beats()
                beats_s = time.monotonic() + BEATS_S
            dues_s = [due_s for one in hearings if (due_s := one.ask()) is not None]
            with self._changed:
                if not self._is_changed and not self._is_closed:
                    self._changed.wait(max(0.0, min([*dues_s, beats_s]) - time.monotonic()))


class Hearing:
    """Tells samples on, and has asked for what is missing.

    Parameters
    ----------
    asker : Asker
    get : callable
        Asks a cache; may call back on any thread.
    beats : callable
        Gives what publishers have repeated of their numbers since the last time.
    callback : callable
        Gets the samples, one at a time, on any thread.
    earlier : Earlier
        What it gets of what was said before.
    """

    def __init__(
        self,
        asker: Asker,
        get: Get,
        beats: Callable[[], Iterable[Beat]],
        callback: Callable[[RawSample], None],
        earlier: Earlier,
    ) -> None:
        self._asker = asker
        self._get = get
        self._beats = beats
        self._callback = callback
        self._earlier = earlier
        self._recovery = Recovery(time.monotonic, earlier)
        self._is_telling = False
        self._due_s: float | None = None
        self._lock = threading.Lock()
        asker.add(self)

    def note(self, heard: Cached) -> None:
        """Take in what a publisher has just said."""
        with self._lock:
            self._recovery.note(heard)
            self._look()
        self._tell()

    def pass_on(self, sample: RawSample) -> None:
        """Tell on what bears no number."""
        with self._lock:
            self._recovery.told.append(sample)
        self._tell()

    def take_beats(self) -> None:
        """Take in which numbers were the publishers' latest."""
        with self._lock:
            for beat in self._beats():
                self._recovery.note_latest(beat.key, beat.publisher, beat.number)
            self._due_s = self._recovery.due_s()

    def ask_latest(self, key_expr: str) -> None:
        """Ask who is there for what is to be told of before, sooner than their next heartbeat."""
        if self._earlier.of_who_was_there > 0:
            self._get(latest_selector(key_expr), self._note_earlier, lambda: None, ANSWER_S)

    def ask(self) -> float | None:
        """Ask for what is missing by now; return when that is to be done next, or None."""
        with self._lock:
            asks = self._recovery.questions()
            due_s = self._due_s = self._recovery.due_s()
        for ask in asks:
            self._get(ask.selector, ask.found.append, lambda ask=ask: self._end(ask), ANSWER_S)
        return due_s

    def _note_earlier(self, found: Cached) -> None:
        with self._lock:
            self._recovery.note_earlier(found)
            self._look()
        self._tell()

    def _end(self, ask: Ask) -> None:
        with self._lock:
            self._recovery.answered(ask)
            self._look()
        self._tell()

    def _look(self) -> None:
        due_s = self._recovery.due_s()
        if due_s != self._due_s:
            self._due_s = due_s
            self._asker.look()

    def _tell(self) -> None:
        """Tell on what can be told, unless somebody is about it: the order is to stay.

        Without the lock, since who is told may himself say something that is heard here.
        """
        while True:
            with self._lock:
                if self._is_telling or not self._recovery.told:
                    return
                self._is_telling = True
                sample = self._recovery.told.popleft()
            try:
                self._callback(sample)
            finally:
                with self._lock:
                    self._is_telling = False
