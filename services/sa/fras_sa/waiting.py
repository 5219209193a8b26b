"""For whom a tick has been waiting: time is an argument."""

from typing import Final

TOLD_AFTER_S: Final = 0.5


class Waiting:
    """Measures how long one and the same service has been missing."""

    period_s: Final = 0.25

    def __init__(self) -> None:
        self._missing = ""
        self._since_s = 0.0

    def told(self, missing: str, now_s: float) -> str:
        """Return `missing` once it has been so for half a second; each tick waits for a moment.

        Parameters
        ----------
        missing : str
            The service whose state is missing now; empty if none is.
        now_s : float [s]
            Monotonic clock.
        """
        if missing != self._missing:
            self._missing, self._since_s = missing, now_s
        return missing if now_s - self._since_s >= TOLD_AFTER_S else ""
