"""A stack that others keep: who of it has gone for good, or stays away."""

import time

from fras_cli.link import Link
from fras_common.messages import SupervisorStatus
from fras_common.topics import SUPERVISOR_STATUS

ABSENCE_S = 3.0


class Absence:
    """Watches a stack that others keep: who has gone for good, or stays away.

    A supervisor says who is not started again; where none speaks, a service that is away for long
    has gone.

    Parameters
    ----------
    link : Link
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._since_s: float | None = None
        self._heard: dict[str, tuple[SupervisorStatus, float]] = {}
        link.bus.subscribe(SUPERVISOR_STATUS, self._on_status)

    def look(self) -> str:
        """Name those that have gone; empty while all are there or may come back."""
        now_s = time.monotonic()
        heard = [one for one, at_s in self._heard.values() if now_s - at_s < ABSENCE_S]
        if heard:
            self._since_s = None
            return "; ".join(gone for one in heard if (gone := gone_for_good(one)))
        missing = self._link.missing()
        if not missing:
            self._since_s = None
            return ""
        self._since_s = self._since_s or now_s
        gone = now_s - self._since_s >= ABSENCE_S
        return f"{', '.join(missing)} of cell {self._link.cell} have gone" if gone else ""

    def _on_status(self, status: SupervisorStatus) -> None:
        # On each host there may be one.
        self._heard[status.host] = (status, time.monotonic())


def gone_for_good(status: SupervisorStatus) -> str:
    """Tell which processes are not started again, in words; empty if all are there or may be."""
    return "; ".join(
        f"{one.name} was given up, it ended {one.last_exit}"
        if one.state == "given_up"
        else f"{one.name} ended {one.last_exit}"
        for one in status.processes
        if one.state in ("given_up", "ended")
    )
