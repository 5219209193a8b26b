"""Stopping: in reverse order of need, politely first, for certain in the end."""

import time
from collections.abc import Collection, Mapping
from signal import SIGINT, SIGKILL, SIGTERM
from typing import Final

from fras_supervisor.child import Child, Exit
from fras_supervisor.errors import Unstoppable

NEXT: Final = {None: SIGINT, SIGINT: SIGTERM, SIGTERM: SIGKILL}
KILL_WAIT_S: Final = 5.0


def shut_down(
    children: Mapping[str, Child],
    ended_before: Mapping[str, Collection[str]],
    poll_s: float,
) -> dict[str, Exit]:
    """Stop all children and say how each ended.

    Parameters
    ----------
    children : mapping of name to Child
        Those that were launched, dead or alive.
    ended_before : mapping of name to names
        Who must have ended before a process is asked to stop; processes that don't wait for
        each other are stopped at the same time.
    poll_s : float [s]
        How often to look.

    Returns
    -------
    dict of name to Exit
        In the order in which they ended.

    Raises
    ------
    Unstoppable
        Some outlived SIGKILL; the others were stopped.
    """
    exits: dict[str, Exit] = {}
    living = dict(children)
    stuck: dict[str, int] = {}
    while living:
        for name, child in list(living.items()):
            if (ended := child.poll()) is not None:
                exits[name] = ended
                del living[name]
            elif not any(other in living for other in ended_before[name]) and escalate(child):
                stuck[name] = child.pid
                del living[name]
        if living:
            time.sleep(poll_s)
    if stuck:
        raise Unstoppable(stuck)
    return exits


def escalate(child: Child) -> bool:
    """Send the next signal when its time has come; true if there is none left to send."""
    number, sent_at = child.last_signal() or (None, 0.0)
    waited_s = time.monotonic() - sent_at
    if number is SIGKILL:
        return waited_s >= KILL_WAIT_S
    if number is None and not child.has_started:
        # One that still loads its libraries would answer SIGINT with a traceback from any of them.
        child.send(SIGTERM)
    elif number is None or waited_s >= child.process.stop_timeout_s:
        child.send(NEXT[number])
    return False
