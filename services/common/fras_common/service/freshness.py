"""Commands act once and at once: one that is old, or was seen before, has no effect."""

from collections import OrderedDict

from fras_common.errors import FrasError
from fras_common.messages import Header

MAX_AGE_S = 1.0
"""A command is older only if it waited somewhere, or somebody sends it again."""

MAX_SOURCES = 256


class StaleCommand(FrasError):
    """A command that is not new. Attributes: ``source``, ``age_s``."""

    counted_as = "stale_command"


class Freshness:
    """Admits each command of a source once, in order, and only while it is new.

    A source that starts again may count its messages anew, with later stamps; a clock may be set
    back as long as the count goes on.
    """

    def __init__(self) -> None:
        # Latest stamp, last number, and the latest stamp of before it counted anew.
        self._last: OrderedDict[tuple[str, str], tuple[int, int, int]] = OrderedDict()

    def require(self, key: str, message: Header, now_ns: int) -> None:
        """Refuse a command that is not new, and remember one that is.

        Raises
        ------
        StaleCommand
            Its stamp is more than `MAX_AGE_S` away from now, or neither its stamp nor its number
            is beyond that of the source's last one.
        """
        age_s = (now_ns - message.stamp_ns) * 1e-9
        if abs(age_s) > MAX_AGE_S:
            raise StaleCommand(
                f"{key}: stamped {age_s:.3g} s ago, {MAX_AGE_S:g} s are allowed: stamp each "
                "command when it is sent (stamp_ns), and keep the machines' clocks together",
                source=message.source,
                age_s=age_s,
            )
        stream = (key, message.source)
        stamp_ns, seq, floor_ns = self._last.get(stream, (-1, -1, -1))
        goes_on = message.seq > seq and message.stamp_ns > floor_ns
        if not goes_on and message.stamp_ns <= stamp_ns:
            raise StaleCommand(
                f"{key}: number {message.seq} of {message.source!r} came before; a command is sent "
                "once",
                source=message.source,
                age_s=age_s,
            )
        floor_ns = floor_ns if goes_on else stamp_ns
        self._last[stream] = (max(stamp_ns, message.stamp_ns), message.seq, floor_ns)
        self._last.move_to_end(stream)
        if len(self._last) > MAX_SOURCES:
            self._last.popitem(last=False)
