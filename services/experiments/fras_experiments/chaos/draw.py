"""From a seed to faults: the same seed, the same faults, on every machine.

Kinds are dealt like cards, and so are the victims of a kind: after one round of trials each kind
has come once, after a few rounds each victim of each kind. When it happens, how long, how much, and
what else happens in the same trial is drawn.
"""

from collections.abc import Sequence
from random import Random
from typing import Final, TypeVar

from fras_experiments.chaos.faults import VICTIMS, WATCHDOG_S, Fault, Kind, Stretch

T = TypeVar("T")

ONE_MORE: Final = 0.3
TWO_MORE: Final = 0.1
"""Chance of so many faults besides the one that was dealt."""
WITHIN_S: Final = 0.03
"""A fault hits at any moment of a tick or two."""

# What a kind is dealt with: the victim, and which of two forms.
CARDS: Final[dict[Kind, tuple[tuple[str, str], ...]]] = {
    "kill": tuple((victim, "") for victim in VICTIMS),
    "pause": tuple((victim, form) for form in ("short", "long") for victim in VICTIMS),
    "router": (("router", ""),),
    "delay": tuple((victim, "") for victim in VICTIMS),
    "disk": (("recorder", ""),),
    "clock": tuple((victim, form) for form in ("ahead", "back") for victim in VICTIMS),
}


def draw(
    seed: int, number: int, kinds: Sequence[Kind], course: Sequence[Stretch]
) -> tuple[Fault, ...]:
    """Draw the faults of one trial, in the order in which they happen.

    Parameters
    ----------
    seed : int
        Of the campaign.
    number : int
        Of the trial, from 0.
    kinds : sequence of str
        Which may happen; each once. Their order does not matter.
    course : sequence of Stretch
        What the arms do in a trial in which nothing happens.

    Raises
    ------
    ValueError
        There are no kinds, or there is no course.
    """
    if not kinds or not course:
        raise ValueError("at least one kind of fault, and a course of at least one tick")
    known: list[Kind] = sorted(kinds)
    chance = Random(f"fras chaos {seed} {number}")
    dealt: Kind = _dealt(known, seed, "kinds", number)
    others: list[Kind] = [kind for kind in known if kind != dealt]
    more = (chance.random() < ONE_MORE + TWO_MORE) + (chance.random() < TWO_MORE)
    chosen: list[Kind] = [dealt, *chance.sample(others, min(more, len(others)))]
    faults = [
        _fault(chance, kind, _card(kind, seed, number // len(known)), course) for kind in chosen
    ]
    return tuple(sorted(faults, key=lambda fault: (fault.tick, fault.after_s)))


def _dealt(cards: Sequence[T], seed: int, what: str, number: int) -> T:
    """Deal card `number` of as many shuffled decks as it takes."""
    deck = list(cards)
    Random(f"fras chaos {seed} {what} {number // len(deck)}").shuffle(deck)
    return deck[number % len(deck)]


def _card(kind: Kind, seed: int, number: int) -> tuple[str, str]:
    return _dealt(CARDS[kind], seed, kind, number)


def _fault(chance: Random, kind: Kind, card: tuple[str, str], course: Sequence[Stretch]) -> Fault:
    victim, form = card
    # Each phase as often as each other: closing a jaw takes few ticks, and is no rarer for it.
    stretch = course[chance.randrange(len(course))]
    tick = stretch.first + chance.randrange(stretch.ticks)
    after_s = _rounded(chance.uniform(0.0, WITHIN_S))
    lasts_s, amount = 0.0, 0.0
    match kind:
        case "pause" if form == "short":
            lasts_s = chance.uniform(0.05, 0.6 * WATCHDOG_S)
        case "pause":
            lasts_s = WATCHDOG_S + chance.uniform(1.0, 3.0)
        case "delay":
            lasts_s, amount = chance.uniform(0.5, 3.0), chance.uniform(0.002, 0.1)
        case "disk":
            amount = float(chance.randrange(200_000))
        case "clock":
            jump_s = 10.0 ** chance.uniform(0.0, 5.0)
            amount = jump_s if form == "ahead" else -jump_s
        case _:
            pass
    return Fault(kind, victim, stretch.name, tick, after_s, _rounded(lasts_s), _rounded(amount))


def _rounded(value: float) -> float:
    return round(value, 4)
