"""How long motion waits: for a peer's answer, and for somebody to lift a hold."""

from typing import Final

from fras_motion.holds import Holds

WAITING_AFTER_S: Final = 0.5


class Patience:
    """Measures waiting; time is an argument.

    Parameters
    ----------
    peer_timeout_s : float
        A peer silent for so long ends the action.
    hold_timeout_s : float
        A hold that nobody lifts for so long ends it; 0 = never.
    """

    period_s: Final = 0.25

    def __init__(self, peer_timeout_s: float, hold_timeout_s: float) -> None:
        self._peer_timeout_s = peer_timeout_s
        self._hold_timeout_s = hold_timeout_s
        self._since_s: float | None = None
        self._for: str = ""
        self.waiting_for = ""

    def rest(self) -> None:
        """Nothing is waited for."""
        self._since_s = None
        self._for = ""
        self.waiting_for = ""

    def exhausted(self, now_s: float, missing: str, holds: Holds) -> str:
        """Reason to give up, or nothing yet.

        Parameters
        ----------
        now_s : float
            Monotonic clock.
        missing : str
            Service whose answer is missing, or "" while the arms are held.
        holds : Holds
            Who holds them.
        """
        held = holds.current()
        subject = missing or next(iter(held), "")
        if self._since_s is None or bool(missing) != bool(self._for):
            self._since_s = now_s
        self._for = missing
        waited_s = now_s - self._since_s
        self.waiting_for = subject if missing and waited_s >= WAITING_AFTER_S else ""
        if missing and waited_s >= self._peer_timeout_s:
            return f"hold:{missing}"
        if held and not missing and 0 < self._hold_timeout_s <= waited_s:
            return f"hold:{subject}:{held[subject]}"
        return ""
