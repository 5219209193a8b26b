"""The recorder's shell: every sample of the cell into one MCAP file a trial."""

import time
from pathlib import Path

import msgspec

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
)
from fras_common.messages.recorder import LogState
from fras_common.service import INBOX, Deferred, ServiceHost
from fras_common.topics import (
    RECORDER_CLOSE,
    RECORDER_EVENT,
    RECORDER_LAST,
    RECORDER_OPEN,
    RECORDER_STATUS,
)
from fras_log import LogFile
from fras_log.keys import default_key_path, load_or_make
from fras_recorder.completeness import Completeness
from fras_recorder.contents import open_log

FLUSH_S = 0.5
QUIET_S = 0.05
CLOSE_TIMEOUT_S = 3.0
# Of the inbox's places; what comes when it is full is lost. Four seconds of a trial at pace 1.
BEHIND = INBOX // 4


class NothingToClose(FrasError):
    """No log is open for the trial named."""


class RecorderService:
    """Writes what it hears; between trials it only listens.

    Parameters
    ----------
    host : ServiceHost
    key : Path, optional
        Private key that signs the logs; this machine's own by default, made if there is none.
    sign : str
        `no` leaves them unsigned.

    Raises
    ------
    BadKey
        There is no key to be had.
    """

    def __init__(self, host: ServiceHost, key: Path | None = None, sign: str = "yes") -> None:
        self._host = host
        self._signer = load_or_make(key or default_key_path()) if sign == "yes" else None
        host.facts["signed_by"] = self._signer.public.fingerprint if self._signer else "nobody"
        self._file: LogFile | None = None
        self._seen = Completeness("")
        self._closing: Deferred[CloseRequest, CloseReply] | None = None
        self._close_by_s = 0.0
        self._flush_at_s = 0.0
        self._last_arrival_s = 0.0
        self._last: dict[str, bytes] = {}
        self._status = host.publisher(RECORDER_STATUS)
        host.serve(RECORDER_OPEN, self._open)
        host.serve_deferred(RECORDER_CLOSE, self._begin_close)
        host.serve(RECORDER_LAST, self._tell_last)
        self._event = host.publisher(RECORDER_EVENT)
        self._is_behind = False
        self._tokens: set[str] = set()
        host.bus.subscribe_raw("**", self._on_sample)
        host.bus.watch_tokens(self._on_token)
        self._publish("idle")

    def _on_sample(self, sample: RawSample) -> None:
        arrival_ns = time.time_ns()
        self._host.post(lambda: self._write(sample, arrival_ns))

    def _on_token(self, token: str, present: bool) -> None:
        self._host.post(lambda: self._note_token(token, present))

    def _note_token(self, token: str, present: bool) -> None:
        if present:
            self._tokens.add(token)
        else:
            self._tokens.discard(token)
        kind = "present" if present else "absent"
        self._tell(RecorderEvent(kind=kind, subject=token, count=0))

    def _tell(self, event: RecorderEvent) -> None:
        self._event.put(msgspec.structs.replace(event, trial=self._seen.trial))

    def _write(self, sample: RawSample, arrival_ns: int) -> None:
        self._last[sample.key] = sample.payload
        if self._file is None:
            return
        self._last_arrival_s = time.monotonic()
        lost = self._file.lost
        try:
            header = self._file.write(sample, arrival_ns)
        except OSError as error:
            self._fail(error)
            return
        if header is None:
            self._host.log.warning("sample without a header recorded", key=sample.key)
        else:
            self._seen.note(sample.key, header.trial, header.tick, header.seq)
            if (missing := self._file.lost - lost) > 0:
                self._host.counts["gaps"] += missing
                subject = f"{sample.key} {header.source}"
                self._tell(RecorderEvent(kind="gap", subject=subject, count=missing))

    def _open(self, request: OpenRequest) -> ResetReply:
        # The new one first: a folder that can't take it must not cost the log that is open.
        file = open_log(request, time.time_ns(), self._signer)
        self._finish("superseded")
        self._file = file
        self._is_behind = False
        self._seen = Completeness(request.trial)
        self._host.gate.trial = request.trial
        self._publish("recording")
        for token in sorted(self._tokens):
            self._tell(RecorderEvent(kind="present", subject=token, count=0))
        self._host.log.info("log opened", path=str(file.path), trial=request.trial)
        return ResetReply(digest=content_digest(request.trial, request.scenario, request.mesh))

    def _tell_last(self, request: LastRequest) -> LastReply:
        return LastReply(payload=self._last.get(request.key, b""))

    def _begin_close(self, pending: Deferred[CloseRequest, CloseReply]) -> None:
        if self._file is None or pending.request.trial != self._seen.trial:
            pending.fail(NothingToClose(f"no log is open for trial {pending.request.trial!r}"))
            return
        if self._closing is not None:
            self._closing.fail(NothingToClose("superseded by a later request to close this log"))
        self._closing = pending
        self._close_by_s = time.monotonic() + CLOSE_TIMEOUT_S

    def wake(self) -> float | None:
        """Flush what is due, and close when the log is complete."""
        if self._file is None:
            return None
        self._say_if_behind()
        now_s = time.monotonic()
        if now_s >= self._flush_at_s:
            try:
                self._file.flush()
            except OSError as error:
                self._fail(error)
                return None
            self._flush_at_s = now_s + FLUSH_S
        if self._closing is None:
            return self._flush_at_s - now_s
        request = self._closing.request
        complete = self._seen.reached(request.last_tick, request.status_seq)
        # Mirrors of queries may still be under way; they are not numbered by tick.
        quiet = now_s - self._last_arrival_s >= QUIET_S
        if (complete and quiet) or now_s >= self._close_by_s:
            if not complete:
                self._host.log.warning("log closed incomplete", trial=request.trial)
            self._finish("closed")
            return None
        return QUIET_S

    def _say_if_behind(self) -> None:
        """Say when too much waits to be written, and when little does again."""
        waiting = self._host.waiting
        if not self._is_behind and waiting > BEHIND:
            self._is_behind = True
            self._publish("behind", reason=f"{waiting} messages wait to be written")
        elif self._is_behind and waiting < BEHIND // 10:
            self._is_behind = False
            self._publish("recording")

    def close(self) -> None:
        """Write what is still queued and finish the file; the process ends."""
        while self._host.drain(0.0):
            pass
        self._finish("stopped")

    def _finish(self, reason: str) -> None:
        file, self._file = self._file, None
        pending, self._closing = self._closing, None
        if file is None:
            return
        totals = {"messages": str(file.messages), "lost": str(file.lost), "reason": reason}
        try:
            file.close(totals)
        except OSError as error:
            self._file, self._closing = file, pending
            self._fail(error)
            return
        self._publish("closed", file, reason)
        if pending is not None:
            pending.reply(CloseReply(path=str(file.path), messages=file.messages, lost=file.lost))

    def _fail(self, error: OSError) -> None:
        """Give the file up as it is: what was flushed stays readable."""
        file, self._file = self._file, None
        pending, self._closing = self._closing, None
        if file is not None:
            file.abandon()
        self._host.log.error("log cannot be written", problem=str(error))
        self._publish("error", file, str(error))
        if pending is not None:
            pending.fail(FrasError(f"log cannot be written: {error}"))

    def _publish(self, state: LogState, file: LogFile | None = None, reason: str = "") -> None:
        file = file or self._file
        status = RecorderStatus(
            trial=self._seen.trial,
            state=state,
            path=str(file.path) if file else "",
            messages=file.messages if file else 0,
            bytes=file.bytes_written if file else 0,
            lost=file.lost if file else 0,
            reason=reason,
        )
        self._status.put(status)
