"""Nothing moves unsupervised: motion's own hold while nobody looks at the surgeon's page."""

import time
from collections.abc import Callable
from typing import Final

from fras_common.messages import Presence
from fras_common.service import ServiceHost
from fras_common.topics import PRESENCE
from fras_motion.holds import PAGE, Holds

__all__ = ["PRESENCE_TIMEOUT_S", "PageWatch"]

PRESENCE_TIMEOUT_S: Final = 1.0
"""A page that has said nothing for so long is taken for lost; four of its words."""


class PageWatch:
    """Holds the arms of a supervised trial while no page is open from which it can be stopped.

    It never lifts that hold: a person does, who has seen how things stand.

    Parameters
    ----------
    host : ServiceHost
    holds : Holds
    clock : callable
        Returns monotonic seconds: for how long nothing was heard of a page.
    """

    def __init__(
        self, host: ServiceHost, holds: Holds, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._host = host
        self._holds = holds
        self._clock = clock
        self._is_required = False
        # Who has just started has not been able to hear a page yet.
        self._began_s = clock()
        self._seen_s: dict[str, float] = {}
        host.subscribe(PRESENCE, self._on_presence, required=False)

    def begin(self, *, required: bool) -> None:
        """Watch from now on, if the trial demands it."""
        self._is_required = required

    def end(self) -> None:
        """Watch no more: the trial is over. A hold that stands is a person's to lift."""
        self._is_required = False

    def _on_presence(self, presence: Presence) -> None:
        if presence.viewers > 0:
            self._seen_s[presence.source] = self._clock()
        else:
            self._seen_s.pop(presence.source, None)

    def wake(self) -> float | None:
        """Hold if nobody looks; seconds until that has to be asked again, or None."""
        if not self._is_required:
            return None
        now_s = self._clock()
        self._seen_s = {
            source: seen_s
            for source, seen_s in self._seen_s.items()
            if now_s - seen_s <= PRESENCE_TIMEOUT_S
        }
        left_s = PRESENCE_TIMEOUT_S - (now_s - max([self._began_s, *self._seen_s.values()]))
        problem = self._problem(just_started=now_s - self._began_s <= PRESENCE_TIMEOUT_S)
        if problem and PAGE not in self._holds.current():
            self._host.refusals["supervision"] += 1
            self._holds.hold(PAGE, problem)
        return max(left_s, 0.0) if not problem else PRESENCE_TIMEOUT_S

    def _problem(self, *, just_started: bool) -> str:
        if just_started:
            return ""
        if not self._host.present("alive/monitor"):
            return "no page is running"
        return "" if self._seen_s else "nobody looks at a page"
