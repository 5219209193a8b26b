"""What becomes of a process that ended, and of the stack: pure, time and chance are arguments."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final, Literal

Restart = Literal["never", "on-failure", "always"]
Verdict = Literal["whole", "incomplete", "safe_hold"]

CANNOT_START: Final = 3
"""Exit status of a service that can't start: a library or a file is missing."""
CANNOT_START_TRIES: Final = 2
"""So many in a row, and it is given up: once may be the router's absence, twice is no accident."""
JITTER: Final = 0.25
"""Largest part of a back-off that chance takes away, so that several don't start in step."""


@dataclass(frozen=True)
class Rules:
    """How often, and after what pause, a process is started again.

    Attributes
    ----------
    restart : {"never", "on-failure", "always"}
    backoff_s, backoff_cap_s : float [s]
        The first pause, doubled with every failure, and the longest one.
    stable_s : float [s]
        Who ran for so long begins with the first pause again.
    budget : int
        Restarts that `window_s` may hold.
    window_s : float [s]
    """

    restart: Restart = "never"
    backoff_s: float = 0.5
    backoff_cap_s: float = 10.0
    stable_s: float = 30.0
    budget: int = 5
    window_s: float = 60.0


@dataclass(frozen=True)
class Past:
    """What counts against a process.

    Attributes
    ----------
    restarts_at_s : tuple of float [s]
        When it was decided to start it again, within the window.
    in_a_row : int
        Ends since it last ran for `stable_s`.
    unstartable : int
        Ends with `CANNOT_START` in a row.
    """

    restarts_at_s: tuple[float, ...] = ()
    in_a_row: int = 0
    unstartable: int = 0


@dataclass(frozen=True)
class End:
    """How a life ended: when, after how long, with what status (negative: by that signal)."""

    at_s: float
    ran_s: float
    returncode: int


@dataclass(frozen=True)
class Again:
    """Start it again after `wait_s`; this is restart `number` of those that the window holds."""

    wait_s: float
    number: int


@dataclass(frozen=True)
class Done:
    """It ended in order, and nobody wants it back."""


@dataclass(frozen=True)
class GivenUp:
    """It is not started again before a person asks."""

    reason: str


def after(rules: Rules, past: Past, end: End, chance: float) -> tuple[Past, Again | Done | GivenUp]:
    """Decide what becomes of a process that ended unasked.

    Parameters
    ----------
    rules : Rules
    past : Past
        Of the lives before this one.
    end : End
    chance : float
        From 0 to 1; the more, the shorter the pause.

    Returns
    -------
    Past
        To be given in when it ends next.
    Again, Done or GivenUp

    Notes
    -----
    The pause before restart k in a row (k = 0, 1, ...) is
    ``min(backoff_cap_s, backoff_s * 2**k) * (1 - JITTER * chance)``.
    """
    failed = end.returncode != 0
    if rules.restart == "never":
        return past, GivenUp("it is never started again (restart)") if failed else Done()
    if not failed and rules.restart == "on-failure":
        return past, Done()
    unstartable = past.unstartable + 1 if end.returncode == CANNOT_START else 0
    recent = tuple(one for one in past.restarts_at_s if one > end.at_s - rules.window_s)
    in_a_row = 0 if end.ran_s >= rules.stable_s else past.in_a_row
    kept = Past(recent, in_a_row, unstartable)
    if unstartable >= CANNOT_START_TRIES:
        return kept, GivenUp(f"it said {unstartable} times in a row that it can't start")
    if len(recent) >= rules.budget:
        return kept, GivenUp(
            f"it was started again {len(recent)} times in {rules.window_s:g} s already"
        )
    wait_s = pause_s(rules, in_a_row) * (1.0 - JITTER * chance)
    later = replace(kept, restarts_at_s=(*recent, end.at_s), in_a_row=in_a_row + 1)
    return later, Again(wait_s, len(later.restarts_at_s))


def pause_s(rules: Rules, in_a_row: int) -> float:
    """Longest pause before the next start, after so many ends in a row before this one."""
    # The exponent is bounded: a process that dies for a year must not overflow a float.
    return min(rules.backoff_cap_s, rules.backoff_s * 2.0 ** min(in_a_row, 60))


def verdict(states: Iterable[str]) -> Verdict:
    """Judge a stack by where its processes stand."""
    seen = set(states)
    if "given_up" in seen:
        return "safe_hold"
    return "whole" if seen <= {"ready"} else "incomplete"
