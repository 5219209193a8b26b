"""The recorder's shell: every sample of the cell into the log of a trial."""

import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

from fras_common.bus import RawSample
from fras_common.codec import content_digest
from fras_common.errors import FrasError
from fras_common.messages import (
    CloseReply,
    CloseRequest,
    LastReply,
    LastRequest,
    OpenRequest,
    RecorderEvent,
    RecorderStatus,
    ResetReply,
    SinceReply,
    SinceRequest,
)
from fras_common.messages.recorder import EventKind, LogState
from fras_common.provenance import WrongSource, require_speaker
from fras_common.service import Deferred, ServiceHost
from fras_common.topics import (
    RECORDER_CLOSE,
    RECORDER_EVENT,
    RECORDER_LAST,
    RECORDER_OPEN,
    RECORDER_SINCE,
    RECORDER_STATUS,
)
from fras_log import LogExists
from fras_log.keys import default_key_path, load_or_make
from fras_recorder.contents import exists, in_order, is_written, log_path, open_log
from fras_recorder.memory import Memory
from fras_recorder.writing import Facts, Writing

QUIET_S = 0.05
CLOSE_TIMEOUT_S = 3.0
CACHED_TIMEOUT_S = 20.0


class NothingToClose(FrasError):
    """No log is open for the trial named."""


class LogFailed(FrasError):
    """The log that was to be closed can't be written."""


class RecorderService:
    """Writes what it hears; between trials it only listens.

    Parameters
    ----------
    host : ServiceHost
    key : Path, optional
        Private key that signs the logs; this machine's own by default, made if there is none.
    below : Path, optional
        The only folder below which logs may stand; whoever starts a trial says where its log is.
    sign : str
        `no` leaves them unsigned.

    Raises
    ------
    BadKey
        There is no key to be had.
    """

    def __init__(
        self,
        host: ServiceHost,
        key: Path | None = None,
        below: Path | None = None,
        sign: str = "yes",
    ) -> None:
        self._host = host
        self._below = below
        self._signer = load_or_make(key or default_key_path()) if sign == "yes" else None
        host.facts["signed_by"] = self._signer.public.fingerprint if self._signer else "nobody"
        self._memory = Memory()
        self._remembers = False
        self._asked: list[Callable[[], None]] = []
        self._writing = Writing(host.post, self._on_gap, self._on_behind, self._on_failed)
        host.waits_elsewhere = lambda: self._writing.waiting
        # What is open: the request for it, and how far it was when last told.
        self._request: OpenRequest | None = None
        self._facts = Facts()
        # Logs that are to be opened, the first of them now; and closed, once they are open.
        self._opens: deque[Deferred[OpenRequest, ResetReply]] = deque()
        self._closers: list[Deferred[CloseRequest, CloseReply]] = []
        self._closing: Deferred[CloseRequest, CloseReply] | None = None
        self._close_by_s = 0.0
        self._is_finishing = False
        self._tokens: set[str] = set()
        self._status = host.publisher(RECORDER_STATUS)
        self._event = host.publisher(RECORDER_EVENT)
        host.serve_deferred(RECORDER_OPEN, self._open)
        host.serve_deferred(RECORDER_CLOSE, self._begin_close)
        host.serve_deferred(RECORDER_LAST, self._tell_last)
        host.serve_deferred(RECORDER_SINCE, self._tell_since)
        host.bus.subscribe_raw("**", self._on_sample)
        host.bus.watch_tokens(self._on_token)
        self._publish("idle")
        self._hear_past(self._remember)

    # --- heard ----------------------------------------------------------------------------

    def _on_sample(self, sample: RawSample) -> None:
        arrival_ns = time.time_ns()
        if self._may_speak(sample):
            if not self._memory.note(sample.key, sample.payload, self._is_present):
                self._host.count_refusal("said_before")
            # The log has what was said, and who said it again.
            self._writing.put(sample, arrival_ns)

    def _may_speak(self, sample: RawSample) -> bool:
        try:
            require_speaker(sample.key, sample.payload)
        except WrongSource as error:
            # Its fault stands in the log; what it says must not be taken for another's word.
            self._host.count_malformed(error)
            return False
        return True

    def _on_token(self, token: str, present: bool) -> None:
        self._host.post(lambda: self._note_token(token, present))

    def _is_present(self, source: str) -> bool:
        return f"alive/{source}" in self._tokens

    def _note_token(self, token: str, present: bool) -> None:
        if present:
            self._tokens.add(token)
        else:
            self._tokens.discard(token)
        self._tell("present" if present else "absent", token)

    def _tell(self, kind: EventKind, subject: str, count: int = 0) -> None:
        trial = self._host.gate.trial
        self._event.put(RecorderEvent(trial=trial, kind=kind, subject=subject, count=count))

    def _hear_past(self, hear: Callable[[list[RawSample]], None]) -> None:
        def heard(cached: list[RawSample]) -> None:
            genuine = [sample for sample in cached if self._may_speak(sample)]
            self._host.post(lambda: hear(in_order(genuine)))

        self._host.bus.cached("**", heard, CACHED_TIMEOUT_S)

    def _remember(self, cached: list[RawSample]) -> None:
        """Begin with what was said before this recorder listened; then answer who has asked."""
        self._memory.precede(cached)
        self._remembers = True
        asked, self._asked = self._asked, []
        for answer in asked:
            answer()

    def _when_remembered(self, answer: Callable[[], None]) -> None:
        if self._remembers:
            answer()
        else:
            self._asked.append(answer)

    def _tell_last(self, pending: Deferred[LastRequest, LastReply]) -> None:
        key = pending.request.key
        self._when_remembered(lambda: pending.reply(LastReply(payload=self._memory.last(key))))

    def _tell_since(self, pending: Deferred[SinceRequest, SinceReply]) -> None:
        key, tick = pending.request.key, pending.request.tick
        self._when_remembered(lambda: pending.reply(self._memory.since(key, tick)))

    # --- opened ---------------------------------------------------------------------------

    def _open(self, pending: Deferred[OpenRequest, ResetReply]) -> None:
        """Open logs one after the other: one that is being opened must not be taken up, too."""
        self._opens.append(pending)
        if len(self._opens) == 1:
            self._open_next()

    def _open_next(self) -> None:
        while self._opens:
            request = self._opens[0].request
            if self._request == request:
                # Asked again by someone who has not heard the answer.
                self._answer_open(None)
                continue
            try:
                path = log_path(request, self._below)
                if self._request is not None and is_written(path, self._facts.path):
                    raise LogExists(f"{path} is being written, for another request", path=path)
                self._make(path, request)
            except FrasError as error:
                self._answer_open(error)
            else:
                return
        closers, self._closers = self._closers, []
        for closer in closers:
            self._begin_close(closer)

    def _make(self, path: Path, request: OpenRequest) -> None:
        if not exists(path):
            self._writing.open(lambda: open_log(path, request, self._signer), self._opened)
            return
        # Another recorder may have begun it: what was said meanwhile is what publishers cache.
        self._writing.listen()

        def take_up(cached: list[RawSample]) -> None:
            self._writing.open(lambda: open_log(path, request, self._signer, cached), self._opened)

        self._hear_past(take_up)

    def _opened(self, outcome: Facts | FrasError, finished: Facts | None) -> None:
        if isinstance(outcome, FrasError):
            self._answer_open(outcome)
        else:
            self._end("superseded", finished)
            self._begin(self._opens[0].request, outcome)
            self._answer_open(None)
        self._open_next()

    def _answer_open(self, refusal: FrasError | None) -> None:
        pending = self._opens.popleft()
        request = pending.request
        if refusal is not None:
            pending.fail(refusal)
        else:
            digest = content_digest(request.trial, request.scenario, request.mesh)
            pending.reply(ResetReply(digest=digest))

    def _begin(self, request: OpenRequest, facts: Facts) -> None:
        self._request, self._facts = request, facts
        self._host.gate.trial = request.trial
        # Enough may have come while the log was made, when there was no trial to say it of.
        self._on_behind(self._writing.is_behind)
        for token in sorted(self._tokens):
            self._tell("present", token)
        self._host.log.info("log opened", path=facts.path, trial=request.trial)

    # --- closed ---------------------------------------------------------------------------

    def _begin_close(self, pending: Deferred[CloseRequest, CloseReply]) -> None:
        trial = pending.request.trial
        if any(one.request.trial == trial for one in self._opens):
            self._closers.append(pending)
            return
        if self._request is None or trial != self._request.trial:
            pending.fail(NothingToClose(f"no log is open for trial {trial!r}"))
            return
        if self._closing is not None:
            self._closing.fail(NothingToClose("superseded by a later request to close this log"))
        self._closing = pending
        self._close_by_s = time.monotonic() + CLOSE_TIMEOUT_S

    def wake(self) -> float | None:
        """Close the log when it is complete."""
        self._host.counts["queue_dropped"] += self._writing.take_dropped()
        if self._closing is None or self._is_finishing:
            return None
        request, now_s = self._closing.request, time.monotonic()
        complete = self._writing.seen.reached(request.last_tick, request.status_seq)
        # Mirrors of queries may still be under way; they are not numbered by tick.
        quiet = not self._writing.waiting and now_s - self._writing.last_arrival_s >= QUIET_S
        if not (complete and quiet) and now_s < self._close_by_s:
            return QUIET_S
        if not complete:
            self._host.log.warning("log closed incomplete", trial=request.trial)
        self._is_finishing = True
        self._writing.close("closed", lambda facts: self._end("closed", facts))
        return None

    def _end(self, reason: str, facts: Facts | None) -> None:
        """Say that the log is finished; if it failed instead, that has been said."""
        self._is_finishing = False
        if facts is None:
            return
        self._publish("closed", reason, facts)
        self._request = None
        pending, self._closing = self._closing, None
        if pending is not None:
            reply = CloseReply(path=facts.path, messages=facts.messages, lost=facts.lost)
            pending.reply(reply)

    def close(self) -> None:
        """Write what is still queued and finish the file; the process ends."""
        while self._host.drain(0.0):
            pass
        self._writing.end()
        while self._host.drain(0.0):
            pass

    # --- told by the writing thread -------------------------------------------------------

    def _on_gap(self, key: str, source: str, count: int) -> None:
        self._host.counts["gaps"] += count
        self._tell("gap", f"{key} {source}", count)

    def _on_behind(self, behind: bool) -> None:
        if self._request is not None:
            reason = f"{self._writing.waiting} messages wait to be written" if behind else ""
            self._publish("behind" if behind else "recording", reason)

    def _on_failed(self, error: Exception, facts: Facts) -> None:
        self._host.log.error("log cannot be written", problem=str(error))
        self._is_finishing = False
        self._publish("error", str(error), facts)
        self._request = None
        pending, self._closing = self._closing, None
        if pending is not None:
            pending.fail(LogFailed(f"log cannot be written: {error}"))

    def _publish(self, state: LogState, reason: str = "", facts: Facts | None = None) -> None:
        self._facts = facts or self._facts
        status = RecorderStatus(
            trial=self._request.trial if self._request is not None else "",
            state=state,
            path=self._facts.path,
            messages=self._facts.messages,
            bytes=self._facts.bytes,
            lost=self._facts.lost,
            reason=reason,
        )
        self._status.put(status)
