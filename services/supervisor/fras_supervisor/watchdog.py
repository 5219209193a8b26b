"""Who lives but does not answer: pure, time is an argument.

A service publishes its health twice a second from a thread of its own, and says in it how long its
loop has not turned. So there are two signs: no health at all (the process is frozen, or a library
does not let go of the interpreter), and health that tells of a loop that is stuck.
"""

from dataclasses import dataclass
from typing import Final

STALL_S: Final = 2.0
"""We did not look for so long: it was we who stood still, and nobody is to blame."""
WITNESS_S: Final = 2.0
"""Health of another process that is younger proves that the bus carries."""
RECONNECT_S: Final = 10.0
"""Given after the router was away: a session tries again after 1, 2, 4 and 4 s."""


@dataclass(frozen=True)
class Patience:
    """How long a process may give no sign of life, and its loop not turn; 0: for ever."""

    silence_s: float
    loop_s: float


@dataclass(frozen=True)
class Stuck:
    """A process that has to be ended, and why; the router if `name` is empty."""

    name: str
    reason: str


@dataclass
class _Watched:
    patience: Patience
    heard_s: float
    loop_lag_s: float = 0.0


class Watchdog:
    """Remembers who was heard when."""

    def __init__(self) -> None:
        self._watched: dict[str, _Watched] = {}
        self._looked_s: float | None = None

    def watch(self, name: str, patience: Patience, now_s: float) -> None:
        """Begin to watch a process that has just become ready."""
        self._watched[name] = _Watched(patience, now_s)

    def forget(self, name: str) -> None:
        """Watch it no more: it has ended, or is about to."""
        self._watched.pop(name, None)

    def heard(self, name: str, loop_lag_s: float, now_s: float) -> None:
        """Note a process's health."""
        if (one := self._watched.get(name)) is not None:
            one.heard_s = max(one.heard_s, now_s)
            one.loop_lag_s = loop_lag_s

    def forgive(self, until_s: float) -> None:
        """Blame nobody for silence before `until_s`, nor for what they said before."""
        for one in self._watched.values():
            one.heard_s = max(one.heard_s, until_s)
            one.loop_lag_s = 0.0

    def look(self, now_s: float) -> list[Stuck]:
        """Find out who is stuck now; to be called often.

        Where everybody is silent the router is to blame: it carries what they say.
        """
        if self._looked_s is not None and now_s - self._looked_s > STALL_S:
            self.forgive(now_s)
        self._looked_s = now_s
        silent = {
            name: now_s - one.heard_s
            for name, one in self._watched.items()
            if 0.0 < one.patience.silence_s < now_s - one.heard_s
        }
        if len(self._watched) > 1 and silent and not self._any_heard_since(now_s - WITNESS_S):
            everybody = len(silent) == sum(
                one.patience.silence_s > 0.0 for one in self._watched.values()
            )
            reason = f"nobody has been heard for {min(silent.values()):.1f} s"
            return [Stuck("", reason)] if everybody else []
        found = [
            Stuck(name, f"no sign of life for {for_s:.1f} s") for name, for_s in silent.items()
        ]
        for name, one in self._watched.items():
            lag_s = one.loop_lag_s + max(0.0, now_s - one.heard_s) if one.loop_lag_s else 0.0
            if name not in silent and 0.0 < one.patience.loop_s < lag_s:
                found.append(Stuck(name, f"its loop has not turned for {lag_s:.1f} s"))
        return found

    def _any_heard_since(self, since_s: float) -> bool:
        return any(one.heard_s > since_s for one in self._watched.values())
