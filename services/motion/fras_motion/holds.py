"""Holds: a set with owners, changed from any thread, read by the loop before it moves anything."""

import threading
from collections.abc import Callable, Mapping
from typing import Final

from fras_common.errors import FrasError

LIFTS_ANY: Final = frozenset({"cli", "monitor"})
"""Where a person stands behind the request; software lifts its own holds only."""

CANCELLER: Final = "cancel"
"""Holder of motion's own hold, by which it brings a cancelled action to rest."""
RESTART: Final = "restart"
"""The one holder whose hold the executive lifts."""
UNREADABLE: Final = "unreadable"
"""Holder of the hold that stands where the last holds can't be read: for a person to lift."""

LOG: Final = "recorder"
"""Holder of motion's own hold, while the log of a trial that demands one is not being written."""

PAGE: Final = "monitor:page"
"""Holder of motion's own hold, since nobody looked at a page in a supervised trial: for a person to
lift, who does."""

_OURS: Final = (CANCELLER, RESTART, UNREADABLE, LOG, PAGE)
_OURS_BEGIN: Final = ("arms/", "crtk/")


MAX_HOLDS: Final = 64
HOLDER_LENGTH: Final = 80
REASON_LENGTH: Final = 400
"""Holds stand in each robot state. A stop is taken whatever it is called, and told shortened."""
OTHERS: Final = "others"
"""Holder of all the holds for which there is no place any more."""


def clients_name(holder: str) -> str:
    """Name under which a client's hold stands: one of motion's own would be lifted by software."""
    holder = holder[:HOLDER_LENGTH]
    ours = holder in _OURS or holder.startswith(_OURS_BEGIN)
    return f"client:{holder}" if ours else holder


class NotYourHold(FrasError):
    """A hold may be lifted by its owner, or by a person."""


class UnknownHold(FrasError):
    """Nobody of that name holds."""


class Holds:
    """Who holds the arms, and why; thread-safe.

    Parameters
    ----------
    on_change : callable, optional
        Gets all holds after each change, in the order of the changes, from `restore` on: told
        before, the recorder would forget what was held before this process.
    """

    def __init__(self, on_change: Callable[[dict[str, str]], None] = lambda holds: None) -> None:
        self._lock = threading.Lock()
        self._on_change = on_change
        self._reasons: dict[str, str] = {}
        self._restored = False
        self._made = 0
        self._last = ("", "")

    def hold(self, holder: str, reason: str) -> dict[str, str]:
        """Add a hold; returns all that are in force."""
        with self._lock:
            self._made += 1
            if self._restored and self._reasons.get(holder) == reason:
                # Told already; who repeats it without end tells nobody anything.
                self._last = (holder, reason)
                return dict(self._reasons)
            self._reasons[holder] = reason
            self._last = (holder, reason)
            return self._changed()

    def restore(self, holds: Mapping[str, str]) -> dict[str, str]:
        """Take over what was held before this process; holds of now stand. Returns all."""
        with self._lock:
            before = {clients_name(one) if one == CANCELLER else one: holds[one] for one in holds}
            self._reasons = {**before, **self._reasons}
            self._restored = True
            return self._changed()

    def resume(self, holder: str, by: str) -> dict[str, str]:
        """Lift a hold; returns those still in force.

        Raises
        ------
        UnknownHold
            If there is no such hold.
        NotYourHold
            If `by` is neither its owner nor a person, nor the executive after a restart.
        """
        with self._lock:
            if holder not in self._reasons:
                names = ", ".join(sorted(self._reasons)) or "nobody"
                raise UnknownHold(f"{holder!r} holds nothing; held by: {names}", holder=holder)
            after_restart = by == "executive" and holder == RESTART
            if by != holder and by not in LIFTS_ANY and not after_restart:
                raise NotYourHold(
                    f"the hold of {holder!r} is not for {by!r} to lift: ask {holder!r}, "
                    "or `fras resume`",
                    holder=holder,
                    by=by,
                )
            del self._reasons[holder]
            return self._changed()

    def hold_for_client(self, holder: str, reason: str) -> dict[str, str]:
        """Add a hold that came in from outside, see `clients_name`.

        Beyond `MAX_HOLDS` it stands among `others`: a stop is never refused.
        """
        name, held = clients_name(holder), self.current()
        if name not in held and len(held) >= MAX_HOLDS:
            name = OTHERS
        return self.hold(name, reason[:REASON_LENGTH])

    def resume_for_client(self, holder: str, by: str) -> dict[str, str]:
        """Lift a hold for someone outside, who speaks for no hold of motion's own; see `resume`.

        Raises
        ------
        UnknownHold, NotYourHold
        """
        person = by in LIFTS_ANY
        own = holder in self.current()
        if not (own if person else by == "executive" and holder == RESTART):
            holder = clients_name(holder)
        return self.resume(holder, by if person else clients_name(by))

    def look(self) -> tuple[dict[str, str], int, tuple[str, str]]:
        """All holds in force, how many were ever made, and holder and reason of the last."""
        with self._lock:
            return dict(self._reasons), self._made, self._last

    def current(self) -> dict[str, str]:
        """All holds in force."""
        with self._lock:
            return dict(self._reasons)

    def _changed(self) -> dict[str, str]:
        holds = dict(self._reasons)
        if self._restored:
            self._on_change(dict(holds))
        return holds

    def in_words(self) -> str:
        """Tell the holds in force; empty if there is none."""
        return "; ".join(f"{holder}: {reason}" for holder, reason in self.current().items())
