"""What a replay says: each message as it was recorded, and after a seek how things stand there."""

from collections.abc import Callable

from fras_common.bus import RawPublisher
from fras_common.service import ServiceHost
from fras_common.topics import Qos
from fras_replay.flow import Flow
from fras_replay.lateness import Lateness
from fras_replay.player import UNLIMITED, Due, Player
from fras_replay.recording import Recording

__all__ = ["Sender"]


class Sender:
    """Puts the messages of a recording onto the bus.

    Parameters
    ----------
    host : ServiceHost
    recording : Recording
    clock_ns : callable
        Returns monotonic nanoseconds.

    Attributes
    ----------
    flow : Flow
    lateness : Lateness
        Of what was sent by a schedule.
    """

    def __init__(
        self, host: ServiceHost, recording: Recording, clock_ns: Callable[[], int]
    ) -> None:
        self._host = host
        self._recording = recording
        self._clock_ns = clock_ns
        self.flow = Flow(host)
        self.lateness = Lateness()
        self._publishers = [self._publisher(number) for number in range(len(recording.lines))]

    def send(self, due: Due, schedule: Player | None = None) -> None:
        """Send what is due.

        Parameters
        ----------
        due : Due
        schedule : Player, optional
            By which it is; none where a step was asked for.
        """
        rated = schedule if schedule is not None and schedule.rate != UNLIMITED else None
        for number in range(due.first, due.stop):
            self._put(number)
            if rated is not None:
                self.lateness.note(self._clock_ns() - rated.due_at_ns(number))
        self.flow.sent(due.stop - due.first, self._clock_ns())
        self._host.tick = self._recording.timeline.tick(due.player.place(self._clock_ns()))

    def show(self, index: int) -> None:
        """Send what says how things stand at a place, and take back what was said after it."""
        for line in self._recording.timeline.unsaid(index):
            # A late viewer would be told it as the latest.
            if self._recording.lines[line].qos is Qos.EVENT:
                self._publishers[line].close()
                self._publishers[line] = self._publisher(line)
        for number in self._recording.timeline.picture(index):
            self._put(number)

    def close(self) -> None:
        """Leave the bus in order."""
        for publisher in self._publishers:
            publisher.close()

    def _put(self, number: int) -> None:
        message = self._recording.message(number)
        self._publishers[message.line].put(message.payload, message.encoding)
        self._host.counts["published"] += 1

    def _publisher(self, line: int) -> RawPublisher:
        one = self._recording.lines[line]
        return self._host.bus.publisher_raw(one.key, one.qos)
