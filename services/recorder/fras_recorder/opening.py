"""How a log is opened: begun, or taken up where another recorder left it; one after the other."""

from collections import deque
from collections.abc import Callable
from pathlib import Path

from fras_common.bus import RawSample
from fras_common.codec import content_digest
from fras_common.errors import FrasError
from fras_common.messages import OpenRequest, ResetReply
from fras_common.service import Deferred, ServiceHost
from fras_common.topics import RECORDER_OPEN
from fras_log import LogExists, Signer
from fras_recorder.contents import exists, is_written, log_path, open_log
from fras_recorder.hearing import Hearing
from fras_recorder.log_status import LogStatus
from fras_recorder.writing import Facts, Writing

__all__ = ["Opening"]


class Opening:
    """Serves `recorder/open`.

    Parameters
    ----------
    host : ServiceHost
    writing : Writing
    hearing : Hearing
    log : LogStatus
    signer : Signer or None
    below : Path or None
        The only folder below which logs may stand.
    on_opened : callable
        Told of the log that was finished for a new one, if any, and of that.
    """

    def __init__(
        self,
        host: ServiceHost,
        writing: Writing,
        hearing: Hearing,
        log: LogStatus,
        signer: Signer | None,
        below: Path | None,
        on_opened: Callable[[Facts | None, OpenRequest, Facts], None],
    ) -> None:
        self._writing = writing
        self._hearing = hearing
        self._log = log
        self._signer = signer
        self._below = below
        self._on_opened = on_opened
        # Logs that are to be opened, the first of them now; and what waits until they are.
        self._opens: deque[Deferred[OpenRequest, ResetReply]] = deque()
        self._early: list[Callable[[], None]] = []
        host.serve_deferred(RECORDER_OPEN, self._open)

    def keep(self, trial: str, again: Callable[[], None]) -> bool:
        """Keep what is asked of a log that is being opened; False if that of `trial` is not."""
        if not any(one.request.trial == trial for one in self._opens):
            return False
        self._early.append(again)
        return True

    def _open(self, pending: Deferred[OpenRequest, ResetReply]) -> None:
        """Open logs one after the other: one that is being opened must not be taken up, too."""
        self._opens.append(pending)
        if len(self._opens) == 1:
            self._open_next()

    def _open_next(self) -> None:
        while self._opens:
            request = self._opens[0].request
            if self._log.request == request:
                # Asked again by someone who has not heard the answer.
                self._answer(None)
                continue
            try:
                path = log_path(request, self._below)
                if self._log.request is not None and is_written(path, self._log.facts.path):
                    raise LogExists(f"{path} is being written, for another request", path=path)
                self._make(path, request)
            except FrasError as error:
                self._answer(error)
            else:
                return
        early, self._early = self._early, []
        for again in early:
            again()

    def _make(self, path: Path, request: OpenRequest) -> None:
        if not exists(path):
            self._writing.open(lambda: open_log(path, request, self._signer), self._opened)
            return
        # Another recorder may have begun it: what was said meanwhile is what publishers cache.
        self._writing.listen()

        def take_up(cached: list[RawSample]) -> None:
            self._writing.open(lambda: open_log(path, request, self._signer, cached), self._opened)

        self._hearing.past(take_up)

    def _opened(self, outcome: Facts | FrasError, finished: Facts | None) -> None:
        if isinstance(outcome, FrasError):
            self._answer(outcome)
        else:
            self._on_opened(finished, self._opens[0].request, outcome)
            self._answer(None)
        self._open_next()

    def _answer(self, refusal: FrasError | None) -> None:
        pending = self._opens.popleft()
        request = pending.request
        if refusal is not None:
            pending.fail(refusal)
        else:
            digest = content_digest(request.trial, request.scenario, request.mesh)
            pending.reply(ResetReply(digest=digest))
