"""The supervisor's hold: wanted while a process is given up, and asked for until it stands."""

from collections.abc import Callable
from typing import Final

from fras_common.errors import FrasError
from fras_common.messages import HoldRequest, HoldState
from fras_common.service import ServiceHost
from fras_common.topics import HOLD

HOLDER: Final = "supervisor"
ANSWER_S: Final = 2.0


class SafeHold:
    """Asks motion to hold the arms.

    It is never lifted from here: what was given up is mended by a person, who also knows whether
    the arms may go on (`fras resume --holder supervisor`).

    Parameters
    ----------
    host : ServiceHost
    tell : callable
        Gets what there is to say.
    """

    def __init__(self, host: ServiceHost, tell: Callable[[str], None]) -> None:
        self._host = host
        self._tell = tell
        self._reason = ""
        self._asked = False
        self._acknowledged_by: int | None = None

    @property
    def stands(self) -> bool:
        """Whether motion has acknowledged it."""
        return bool(self._reason) and self._acknowledged_by is not None

    def want(self, reason: str) -> None:
        """Want the arms to be held for a reason; none: want it no more."""
        if reason != self._reason:
            self._reason = reason
            self._acknowledged_by = None

    def wake(self, motion_life: int | None) -> None:
        """Ask if motion is there (`motion_life`) and has not yet answered in this life of its."""
        if not self._reason or motion_life is None or self._asked:
            return
        if self._acknowledged_by == motion_life:
            return
        self._asked = True
        reason = self._reason

        def on_done(answer: HoldState | FrasError) -> None:
            self._host.post(lambda: self._on_answer(answer, reason, motion_life))

        request = HoldRequest(holder=HOLDER, reason=reason)
        self._host.bus.ask(HOLD, request, on_done, ANSWER_S)

    def _on_answer(self, answer: HoldState | FrasError, reason: str, motion_life: int) -> None:
        self._asked = False
        if isinstance(answer, FrasError):
            self._host.log.warning("motion did not acknowledge the hold", problem=str(answer))
            return
        if reason == self._reason:
            self._acknowledged_by = motion_life
            self._tell(f"holds the arms at tick {answer.tick}: {reason}")
