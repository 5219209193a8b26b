"""What is done again and again, by a clock that is given."""


class Due:
    """Something to do every `period_s`; what was missed is left out, not made up for."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._next_s = 0.0

    def take(self, now_s: float) -> bool:
        """Whether it is due; it is then not, for a period."""
        if now_s < self._next_s:
            return False
        self._next_s = now_s + self._period_s
        return True

    def wait_s(self, now_s: float) -> float:
        """Seconds until it is due."""
        return max(0.0, self._next_s - now_s)
