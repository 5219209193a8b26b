"""Whether a loop turns, as seen from another thread."""

from collections.abc import Callable


class Pulse:
    """Puts a job into a loop's inbox, and tells how long it has been waiting there.

    A process whose other threads live on may still be stuck in its loop; and a loop that has
    nothing to do does not turn either, so a count of its turns would prove nothing.

    Parameters
    ----------
    put : callable
        Appends a job to the inbox, whether that is full or not.
    """

    def __init__(self, put: Callable[[Callable[[], None]], None]) -> None:
        self._put = put
        self._since_s: float | None = None

    def beat(self, now_s: float) -> None:
        """Put a job, unless the last one still waits."""
        if self._since_s is None:
            self._since_s = now_s
            self._put(self._done)

    def lag_s(self, now_s: float) -> float:
        """Age of the job that waits; 0 if none does."""
        since_s = self._since_s
        return 0.0 if since_s is None else now_s - since_s

    def _done(self) -> None:
        self._since_s = None
