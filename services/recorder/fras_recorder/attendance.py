"""Who is in the cell, and what else befell the log: told as events, so that it has them."""

from fras_common.messages import RecorderEvent
from fras_common.messages.recorder import EventKind
from fras_common.service import ServiceHost
from fras_common.topics import RECORDER_EVENT

__all__ = ["Attendance"]


class Attendance:
    """Says on `recorder/event` who comes and goes.

    Parameters
    ----------
    host : ServiceHost
    """

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        self._tokens: set[str] = set()
        self._event = host.publisher(RECORDER_EVENT)

    def begin(self) -> None:
        """Watch from now on."""
        self._host.bus.watch_tokens(self._on_token)

    def is_present(self, source: str) -> bool:
        """Whether a source of messages is here; on any thread."""
        return f"alive/{source}" in self._tokens

    def tell_all(self) -> None:
        """Say who is here: a log that begins knows nobody."""
        for token in sorted(self._tokens):
            self.tell("present", token)

    def tell(self, kind: EventKind, subject: str, count: int = 0) -> None:
        """Say what happened."""
        trial = self._host.gate.trial
        self._event.put(RecorderEvent(trial=trial, kind=kind, subject=subject, count=count))

    def _on_token(self, token: str, present: bool) -> None:
        self._host.post(lambda: self._note(token, present))

    def _note(self, token: str, present: bool) -> None:
        if present:
            self._tokens.add(token)
        else:
            self._tokens.discard(token)
        self.tell("present" if present else "absent", token)
