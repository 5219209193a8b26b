"""Writing on a thread of its own: a slow disk keeps nobody from being heard or answered."""

import queue
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fras_common.bus import RawSample
from fras_common.codec import HeaderFields, read_header
from fras_common.errors import FrasError
from fras_log import AuditLog, LogExists
from fras_recorder.completeness import Completeness

__all__ = ["Facts", "Opened", "Trial", "Writing"]

FLUSH_S = 0.5
# What waits to be written: so many messages or bytes; what comes then is lost, and told.
PLACES = 10_000
BYTES = 256 * 2**20
# While a log is taken up, for which caches are asked up to 20 s: what is said meanwhile waits.
PLACES_EARLY = 100_000
# Of either: motion is told to wait. Four seconds of a trial at pace 1.
BEHIND = 0.25
CAUGHT_UP = 0.025

# The disk's fault, or a file that stands where the next one of the log has to.
_UNWRITABLE = (OSError, LogExists)

Post = Callable[[Callable[[], None]], None]


@dataclass(frozen=True)
class Trial:
    """What a log is of.

    Attributes
    ----------
    name : str
    since_ns : int
        What publishers still cache of other trials, from before this moment, is left out.
    """

    name: str
    since_ns: int = 0

    def holds(self, header: HeaderFields) -> bool:
        """Whether a sample belongs into the log."""
        return header.trial == self.name or header.stamp_ns >= self.since_ns


@dataclass(frozen=True)
class Facts:
    """How far a log has come."""

    path: str = ""
    messages: int = 0
    bytes: int = 0
    lost: int = 0

    @classmethod
    def of(cls, log: AuditLog) -> "Facts":
        """Describe a log now."""
        return cls(str(log.path), log.messages, log.bytes_written, log.lost)


@dataclass(frozen=True)
class Opened:
    """A log, of what it is, what it holds already, and what is to be written first.

    Attributes
    ----------
    cached : sequence of RawSample
        What publishers cached when it was taken up: older than what waits to be written.
    """

    log: AuditLog
    trial: Trial
    seen: Completeness
    cached: Sequence[RawSample] = ()


Gap = Callable[[str, str, int], None]
"""Told key, publisher and count of messages that never arrived."""
Behind = Callable[[bool], None]
"""Told when too much waits to be written, and when little does again."""
Failed = Callable[[Exception, Facts], None]
"""Told that the log can't be written any more, and how far it had come."""


class Writing:
    """Owns the log that is open; jobs and samples are done in the order in which they came.

    Parameters
    ----------
    post : callable
        Has a job done on the service's loop: all that is told below is told there.
    on_gap, on_behind, on_failed : callable
    """

    def __init__(self, post: Post, on_gap: Gap, on_behind: Behind, on_failed: Failed) -> None:
        self._post = post
        self._on_gap = on_gap
        self._on_behind = on_behind
        self._on_failed = on_failed
        self._queue: queue.SimpleQueue[Callable[[], None] | tuple[RawSample, int] | None] = (
            queue.SimpleQueue()
        )
        self._lock = threading.Lock()
        self._places = 0
        self._bytes = 0
        self._is_behind = False
        # Whether samples are taken: a log is open, or is about to be.
        self._listening = False
        self._awaited = False
        # Whether what came before the log was open still waits.
        self._is_early = False
        self._dropped = 0
        self._gaps: Counter[tuple[str, str]] = Counter()
        self.last_arrival_s = 0.0
        self._early: list[tuple[RawSample, int]] = []
        self._log: AuditLog | None = None
        self._trial = Trial("")
        self._taken_up_ns = 0
        self._flush_at_s = 0.0
        self.seen = Completeness("")
        self._thread = threading.Thread(target=self._run, name="writing", daemon=True)
        self._thread.start()

    # --- any thread -----------------------------------------------------------------------

    def put(self, sample: RawSample, arrival_ns: int) -> None:
        """Have a sample written; dropped and counted if too much waits."""
        if not self._listening:
            return
        size = len(sample.payload)
        self.last_arrival_s = time.monotonic()
        with self._lock:
            self._is_early = self._awaited or (self._is_early and self._places >= PLACES)
            places = PLACES_EARLY if self._is_early else PLACES
            if self._places >= places or (self._places and self._bytes + size > BYTES):
                self._dropped += 1
                return
            self._places += 1
            self._bytes += size
            becomes_behind = not self._is_behind and self._load() > BEHIND
            self._is_behind = self._is_behind or becomes_behind
        self._queue.put((sample, arrival_ns))
        if becomes_behind:
            self._post(lambda: self._on_behind(True))

    def listen(self) -> None:
        """Let what comes wait for the log that is about to be opened."""
        with self._lock:
            self._awaited = self._listening = True

    def _listen_no_more(self) -> None:
        """Take no samples, unless another log is about to be opened."""
        with self._lock:
            self._listening = self._awaited

    @property
    def waiting(self) -> int:
        """Samples that wait to be written."""
        return self._places

    @property
    def is_behind(self) -> bool:
        """Whether too much of them waits."""
        return self._is_behind

    def take_dropped(self) -> int:
        """How many samples were dropped since this was last asked."""
        with self._lock:
            dropped, self._dropped = self._dropped, 0
        return dropped

    def open(
        self,
        make: Callable[[], Opened],
        done: Callable[[Facts | FrasError, Facts | None], None],
    ) -> None:
        """Open a log, and finish the one that is open.

        Parameters
        ----------
        make : callable
            Makes it, on the writing thread. A `FrasError` that it raises costs nothing.
        done : callable
            Told how it went, and of the log that was finished for it, if any.
        """
        self.listen()
        self._queue.put(lambda: self._open(make, done))

    def close(self, reason: str, done: Callable[[Facts | None], None]) -> None:
        """Finish the log when all that waits is written; None if there is none, or it failed."""
        self._queue.put(lambda: self._close(reason, done))

    def end(self) -> None:
        """Write what waits, finish the log, and end the thread."""
        self._queue.put(lambda: self._close("stopped", lambda facts: None))
        self._queue.put(None)
        self._thread.join()

    # --- the writing thread ---------------------------------------------------------------

    def _run(self) -> None:
        try:
            while self._step():
                pass
        except Exception as error:  # noqa: BLE001 - it is raised again
            # A mistake of our own ends the process, not only the writing.
            mistake = error
            self._post(lambda: _raise(mistake))

    def _step(self) -> bool:
        timeout_s = None if self._log is None else max(0.0, self._flush_at_s - time.monotonic())
        try:
            job = self._queue.get(timeout=timeout_s)
        except queue.Empty:
            job = ()
        if job is None:
            return False
        if callable(job):
            job()
        elif job and self._log is None and self._listening:
            # It came before the log was made, and still counts among what waits.
            self._early.append(job)
        elif job:
            self._write(*job)
            self._done_with(job[0])
        if self._log is not None and time.monotonic() >= self._flush_at_s:
            self._flush_at_s = time.monotonic() + FLUSH_S
            try:
                self._log.flush(time.time_ns())
            except _UNWRITABLE as error:
                self._fail(error)
        return True

    def _write(self, sample: RawSample, arrival_ns: int, *, early: bool = False) -> None:
        log = self._log
        if log is None:
            return
        if self._trial.since_ns and self._is_old(sample, log, early=early):
            return
        lost = log.lost
        try:
            header = log.write(sample, arrival_ns)
        except _UNWRITABLE as error:
            self._fail(error)
            return
        if header is None:
            return
        self.seen.note(sample.key, header.trial, header.tick, header.seq)
        if (missing := log.lost - lost) > 0:
            self._note_gap(sample.key, header.source, missing)

    def _note_gap(self, key: str, source: str, missing: int) -> None:
        """Have it told with those that wait to be told: there may be one before each sample."""
        with self._lock:
            waits = bool(self._gaps)
            self._gaps[key, source] += missing
        if not waits:
            self._post(self._tell_gaps)

    def _tell_gaps(self) -> None:
        with self._lock:
            gaps, self._gaps = self._gaps, Counter()
        for (key, source), missing in gaps.items():
            self._on_gap(key, source, missing)

    def _is_old(self, sample: RawSample, log: AuditLog, *, early: bool) -> bool:
        """Whether a log that was taken up holds a sample already, or shouldn't hold it.

        What publishers cache, and what came before the log was taken up, is `early`. What was sent
        since is recorded whatever its number: nobody can hide behind a low one.
        """
        header = read_header(sample.payload)
        if header is None:
            return False
        if early and header.trial != self._trial.name and log.precedes(sample.key, header):
            # By its number: the publisher's clock may have been ahead then.
            return True
        if header.stamp_ns >= self._taken_up_ns:
            return False
        return not self._trial.holds(header) or log.precedes(sample.key, header)

    def _write_early(self) -> None:
        early, self._early = self._early, []
        for sample, arrival_ns in early:
            self._write(sample, arrival_ns, early=True)
            self._done_with(sample)

    def _done_with(self, sample: RawSample) -> None:
        with self._lock:
            self._places -= 1
            self._bytes -= len(sample.payload)
            caught_up = self._is_behind and self._load() < CAUGHT_UP
            self._is_behind = self._is_behind and not caught_up
        if caught_up:
            self._post(lambda: self._on_behind(False))

    def _load(self) -> float:
        return max(self._places / PLACES, self._bytes / BYTES)

    def _open(
        self,
        make: Callable[[], Opened],
        done: Callable[[Facts | FrasError, Facts | None], None],
    ) -> None:
        # The new one first: a folder that can't take it must not cost the log that is open.
        try:
            opened = make()
        except FrasError as error:
            refusal = error
            with self._lock:
                self._awaited, self._listening = False, self._log is not None
            self._write_early()
            self._post(lambda: done(refusal, None))
            return
        finished = self._finish("superseded")
        self._log, self._trial, self.seen = opened.log, opened.trial, opened.seen
        with self._lock:
            self._awaited, self._listening = False, True
        self._flush_at_s = time.monotonic() + FLUSH_S
        facts = Facts.of(opened.log)
        # Said first: if it can't be written, that is told of a log that is known to be open.
        self._post(lambda: done(facts, finished))
        arrival_ns = self._taken_up_ns = time.time_ns()
        for sample in opened.cached:
            self._write(sample, arrival_ns, early=True)
        self._write_early()

    def _close(self, reason: str, done: Callable[[Facts | None], None]) -> None:
        facts = self._finish(reason)
        self._listen_no_more()
        self._post(lambda: done(facts))

    def _finish(self, reason: str) -> Facts | None:
        if self._log is None:
            return None
        try:
            self._log.close(reason, time.time_ns())
        except OSError as error:
            self._fail(error)
            return None
        log, self._log = self._log, None
        return Facts.of(log)

    def _fail(self, error: Exception) -> None:
        """Give the log up as it is: what was flushed stays readable."""
        log, self._log = self._log, None
        self._listen_no_more()
        if log is not None:
            log.abandon()
            facts = Facts.of(log)
            self._post(lambda: self._on_failed(error, facts))


def _raise(error: Exception) -> None:
    raise error
