"""Real-time pacing: a rate limiter on ticks, which decides when and never what."""


class Pacer:
    """Says when the next tick is due.

    Parameters
    ----------
    dt_s : float
        Simulated time of a tick [s].
    pace : float
        Simulated seconds a wall second; 0 = as fast as possible.
    """

    def __init__(self, dt_s: float, pace: float) -> None:
        self._period_s = dt_s / pace if pace > 0 else 0.0
        self._due_s = 0.0

    def wait_s(self, now_s: float) -> float:
        """Seconds until the next tick is due at `now_s`; 0 if it is."""
        return max(0.0, self._due_s - now_s)

    def ticked(self, now_s: float) -> None:
        """Note a tick; one that came late puts the following ones off, none catches up."""
        self._due_s = max(self._due_s, now_s - self._period_s) + self._period_s
