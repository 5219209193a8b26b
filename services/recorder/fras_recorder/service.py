"""The recorder's shell: every sample of the cell into the log of a trial."""

import time
from pathlib import Path

from fras_common.bus import RawSample
from fras_common.messages import OpenRequest
from fras_common.service import ServiceHost
from fras_log.keys import default_key_path, load_or_make
from fras_recorder.attendance import Attendance
from fras_recorder.closing import Closing
from fras_recorder.hearing import Hearing
from fras_recorder.log_status import LogStatus
from fras_recorder.memory_desk import MemoryDesk
from fras_recorder.opening import Opening
from fras_recorder.writing import Facts, Writing


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
        signer = load_or_make(key or default_key_path()) if sign == "yes" else None
        host.facts["signed_by"] = signer.public.fingerprint if signer else "nobody"
        self._hearing = Hearing(host)
        self._writing = Writing(host.post, self._on_gap, self._on_behind, self._on_failed)
        host.waits_elsewhere = lambda: self._writing.waiting
        self._log = LogStatus(host)
        self._attendance = Attendance(host)
        self._opening = Opening(
            host, self._writing, self._hearing, self._log, signer, below, self._on_opened
        )
        self._closing = Closing(host, self._writing, self._log, self._opening)
        self._memory = MemoryDesk(host)
        host.bus.subscribe_raw("**", self._on_sample)
        self._attendance.begin()
        self._log.tell("idle")
        self._hearing.past(self._memory.remember)

    def _on_sample(self, sample: RawSample) -> None:
        arrival_ns = time.time_ns()
        if self._hearing.may_speak(sample):
            self._memory.note(sample, self._attendance.is_present)
            # The log has what was said, and who said it again.
            self._writing.put(sample, arrival_ns)

    def _on_opened(self, finished: Facts | None, request: OpenRequest, facts: Facts) -> None:
        self._closing.end("superseded", finished)
        self._log.begin(request, facts)
        self._host.gate.trial = request.trial
        # Enough may have come while the log was made, when there was no trial to say it of.
        self._on_behind(self._writing.is_behind)
        self._attendance.tell_all()
        self._host.log.info("log opened", path=facts.path, trial=request.trial)

    def wake(self) -> float | None:
        """Close the log when it is complete."""
        self._host.counts["queue_dropped"] += self._writing.take_dropped()
        return self._closing.wake()

    def close(self) -> None:
        """Write what is still queued and finish the file; the process ends."""
        while self._host.drain(0.0):
            pass
        self._writing.end()
        while self._host.drain(0.0):
            pass

    # --- told by the writing thread, on the loop ------------------------------------------

    def _on_gap(self, key: str, source: str, count: int) -> None:
        self._host.counts["gaps"] += count
        self._attendance.tell("gap", f"{key} {source}", count)

    def _on_behind(self, behind: bool) -> None:
        self._log.tell_behind(behind=behind, waiting=self._writing.waiting)

    def _on_failed(self, error: Exception, facts: Facts) -> None:
        self._host.log.error("log cannot be written", problem=str(error))
        self._closing.fail(error, facts)
