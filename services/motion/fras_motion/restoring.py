"""What a motion that starts again must know: who held the arms before it."""

from collections.abc import Callable, Mapping

from fras_common.codec import MalformedMessage, decode
from fras_common.errors import FrasError
from fras_common.messages import Holds, LastReply, LastRequest
from fras_common.service import ServiceHost
from fras_common.topics import HOLDS, RECORDER_LAST
from fras_motion.holds import UNREADABLE

__all__ = ["Restoring"]

ANSWER_TIMEOUT_S = 2.0
RETRY_S = 0.5


class Restoring:
    """Asks the recorder for the last holds, as soon as there is one, until it has answered.

    The service is not ready before: no trial may begin that a person has stopped.

    Parameters
    ----------
    host : ServiceHost
    restore : callable
        Gets the holds, none or some, once.
    """

    def __init__(self, host: ServiceHost, restore: Callable[[Mapping[str, str]], None]) -> None:
        self._host = host
        self._restore = restore
        self._done = host.not_before("holds restored")
        self._asking = False
        self._is_done = False
        self._ask_at_s = 0.0
        host.require("recorder")

    def wake(self, now_s: float) -> float | None:
        """Ask if it is time to; seconds until it is again, or None."""
        if self._is_done or self._asking:
            return None
        if not self._host.present("alive/recorder"):
            return RETRY_S
        if now_s < self._ask_at_s:
            return self._ask_at_s - now_s
        self._asking = True
        self._ask_at_s = now_s + RETRY_S
        request = LastRequest(key=HOLDS.key)
        self._host.bus.ask(RECORDER_LAST, request, self._on_answer, ANSWER_TIMEOUT_S)
        return None

    def _on_answer(self, answer: LastReply | FrasError) -> None:
        self._host.post(lambda: self._take(answer))

    def _take(self, answer: LastReply | FrasError) -> None:
        self._asking = False
        if isinstance(answer, FrasError):
            self._host.log.warning("holds can't be restored yet", problem=str(answer))
            return
        self._is_done = True
        holds: Mapping[str, str] = _holds_in(answer.payload) if answer.payload else {}
        if holds:
            self._host.log.warning("holds restored", holds=holds)
        self._restore(holds)
        self._done()


def _holds_in(payload: bytes) -> Mapping[str, str]:
    try:
        return decode(Holds, payload, HOLDS.key).holds
    except MalformedMessage as error:
        # Nobody can tell any more who held the arms: a person has to look, the executive may not.
        return {UNREADABLE: f"the last holds can't be read: {error}"}
