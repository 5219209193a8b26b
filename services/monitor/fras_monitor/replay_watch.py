"""Where a replay stands: it says so when asked, and is asked while its messages are shown."""

from typing import Final

from fras_common.errors import FrasError
from fras_common.messages import ReplayStatus, ReplayStatusRequest
from fras_common.service import ServiceHost
from fras_common.topics import REPLAY_STATUS
from fras_monitor.listening import Listener
from fras_monitor.pace import Due
from fras_monitor.picture import Picture

__all__ = ["ReplayWatch"]

REPLAY_S: Final = 0.1
ANSWER_S: Final = 2.0


class ReplayWatch:
    """Asks a replay where it stands, as often as anything is shown of it.

    Parameters
    ----------
    host : ServiceHost
    listener : Listener
        Takes the answers in.
    """

    def __init__(self, host: ServiceHost, listener: Listener) -> None:
        self._host = host
        self._listener = listener
        self._due = Due(REPLAY_S)

    def ask(self, picture: Picture, now_s: float) -> None:
        """Ask if the picture is of a replay and it is time to; the first time for marks, too."""
        if picture.is_replay and self._due.take(now_s):
            request = ReplayStatusRequest(marks=picture.replay is None)
            self._host.bus.ask(REPLAY_STATUS, request, self._on_answer, ANSWER_S)

    def _on_answer(self, answer: ReplayStatus | FrasError) -> None:
        # One that has just ended answers no more; its token goes, too, and with it the time line.
        if isinstance(answer, ReplayStatus):
            self._listener.note(answer)
