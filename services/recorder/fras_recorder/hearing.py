"""What the recorder takes for said: nothing that one service says in the name of another."""

from collections.abc import Callable

from fras_common.bus import RawSample
from fras_common.provenance import WrongSource, require_speaker
from fras_common.service import ServiceHost
from fras_recorder.contents import in_order

__all__ = ["Hearing"]

CACHED_TIMEOUT_S = 20.0


class Hearing:
    """Hears what is genuine, of now and of before.

    Parameters
    ----------
    host : ServiceHost
    """

    def __init__(self, host: ServiceHost) -> None:
        self._host = host

    def may_speak(self, sample: RawSample) -> bool:
        """Whether a sample is of whom the table says; any other is counted."""
        try:
            require_speaker(sample.key, sample.payload)
        except WrongSource as error:
            # Its fault stands in the log; what it says must not be taken for another's word.
            self._host.count_malformed(error)
            return False
        return True

    def past(self, hear: Callable[[list[RawSample]], None]) -> None:
        """Ask for what publishers cache; `hear` gets it on the loop, in order."""

        def heard(cached: list[RawSample]) -> None:
            genuine = [sample for sample in cached if self.may_speak(sample)]
            self._host.post(lambda: hear(in_order(genuine)))

        self._host.bus.cached("**", heard, CACHED_TIMEOUT_S)
