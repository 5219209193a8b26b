"""Messages of a key by the tick that they are about."""

from bisect import bisect_right
from collections.abc import Sequence
from typing import TypeVar

from fras_common.messages import Header, RpcRecord

H = TypeVar("H", bound=Header)


def by_tick(messages: Sequence[H]) -> dict[int, list[H]]:
    """Group messages by tick, in recorded order."""
    found: dict[int, list[H]] = {}
    for message in messages:
        found.setdefault(message.tick, []).append(message)
    return found


def first_of_tick(messages: Sequence[H]) -> dict[int, H]:
    """Return the first message of each tick: it is the one that was worked on."""
    return {tick: those[0] for tick, those in by_tick(messages).items()}


def ticks_while(mirror: RpcRecord, said: Sequence[Header]) -> range:
    """Ticks at which a query may have been answered, by what its server published.

    Parameters
    ----------
    mirror : RpcRecord
        Stamped once the answer was sent; it says how long that took.
    said : sequence of Header
        One message a tick, of the same process and so of the same clock, in order.
    """
    stamps = [one.stamp_ns for one in said]
    began_ns = mirror.stamp_ns - int(mirror.duration_s * 1e9)
    before = max(0, bisect_right(stamps, began_ns) - 1)
    after = max(0, bisect_right(stamps, mirror.stamp_ns) - 1)
    return range(said[before].tick, said[after].tick + 1) if said else range(0)
