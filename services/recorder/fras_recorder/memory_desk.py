"""What was said last: told to whoever starts again, once what was said before is known, too."""

from collections.abc import Callable, Sequence

from fras_common.bus import RawSample
from fras_common.messages import LastReply, LastRequest, SinceReply, SinceRequest
from fras_common.service import Deferred, ServiceHost
from fras_common.topics import RECORDER_LAST, RECORDER_SINCE
from fras_recorder.memory import Memory

__all__ = ["MemoryDesk"]


class MemoryDesk:
    """Serves `recorder/last` and `recorder/since`.

    Parameters
    ----------
    host : ServiceHost
    """

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        self._memory = Memory()
        self._remembers = False
        self._asked: list[Callable[[], None]] = []
        host.serve_deferred(RECORDER_LAST, self._tell_last)
        host.serve_deferred(RECORDER_SINCE, self._tell_since)

    def note(self, sample: RawSample, present: Callable[[str], bool]) -> None:
        """Take a sample into the memory, on the receiving thread; `present` as of `Memory.note`."""
        if not self._memory.note(sample.key, sample.payload, present):
            self._host.count_refusal("said_before")

    def remember(self, cached: Sequence[RawSample]) -> None:
        """Begin with what was said before this recorder listened; then answer who has asked."""
        self._memory.precede(cached)
        self._remembers = True
        asked, self._asked = self._asked, []
        for answer in asked:
            answer()

    def _when_remembered(self, answer: Callable[[], None]) -> None:
        if self._remembers:
            answer()
        else:
            self._asked.append(answer)

    def _tell_last(self, pending: Deferred[LastRequest, LastReply]) -> None:
        key = pending.request.key
        self._when_remembered(lambda: pending.reply(LastReply(payload=self._memory.last(key))))

    def _tell_since(self, pending: Deferred[SinceRequest, SinceReply]) -> None:
        key, tick = pending.request.key, pending.request.tick
        self._when_remembered(lambda: pending.reply(self._memory.since(key, tick)))
