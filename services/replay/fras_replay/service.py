"""The replay's shell: sends what is due, answers on `replay/...`, says what it is."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from fras_common.messages import ReplayControl, ReplayStatus
from fras_common.topics import REPLAY_CONTROL, REPLAY_STATUS
from fras_replay.cell_watch import CellWatch
from fras_replay.commands import obey
from fras_replay.errors import LiveCell
from fras_replay.host import ReplayHost
from fras_replay.player import Player
from fras_replay.recording import NS, Recording
from fras_replay.sender import Sender
from fras_replay.standing import in_words, status_of
from fras_replay.waiting import wait_s

# Between two of them questions are answered.
BURST = 64
# Who lost something as fast as it went learns so from a heartbeat (0.3 s), and asks for it.
LINGER_NS = NS


@dataclass(frozen=True)
class Settings:
    """How a replay is run.

    Attributes
    ----------
    cell, instance : str
        Where, and the name of this participant there.
    stay : bool
        Stay at the end until it is told to stop.
    """

    cell: str
    instance: str
    stay: bool = False


class ReplayService:
    """Sends a recording into a cell where nobody acts on it.

    Parameters
    ----------
    host : ReplayHost
        Attached.
    recording : Recording
    player : Player
        How it begins.
    settings : Settings
    clock_ns : callable
        Returns monotonic nanoseconds.

    Raises
    ------
    LiveCell
        Somebody acts on messages there, or replays already.
    NoAnswer
        The router can't tell who is there.
    """

    def __init__(
        self,
        host: ReplayHost,
        recording: Recording,
        player: Player,
        settings: Settings,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._host = host
        self._recording = recording
        self._settings = settings
        self._clock_ns = clock_ns
        self._leave_at_ns: int | None = None
        self._cell = CellWatch(host, settings.cell, settings.instance)
        self._cell.require_dead()
        self._sender = Sender(host, recording, clock_ns)
        self.lateness = self._sender.lateness
        # Seen by others before it looks again: of two that begin at once none goes on.
        host.announce_alive()
        self._cell.require_dead()
        self._cell.begin()
        self._player = player
        self._begun = False
        host.gate.trial = recording.trial
        host.facts["replay_of"] = str(recording.path)
        host.telling = lambda: in_words(self.status())
        host.serve(REPLAY_CONTROL, self.control)
        host.serve(REPLAY_STATUS, lambda asked: self.status(asked.marks))
        if player.index:
            self._sender.show(player.index)

    @property
    def intruder(self) -> LiveCell | None:
        """Who came and acts on messages, so that the replay was stopped; None if nobody did."""
        return self._cell.intruder

    def wake(self) -> float | None:
        """Send what is due; return the seconds until the next message is."""
        if self._sender.flow.waiting:
            return None
        if self._leave_at_ns is not None:
            left_ns = self._leave_at_ns - self._clock_ns()
            if left_ns <= 0:
                self._host.stop()
            return max(0, left_ns) / NS
        if not self._begun:
            # The schedule counts from the first look at it, not from what had to be set up.
            self._begun = True
            self._player = replace(self._player, since_ns=self._clock_ns())
        due = self._player.take(self._clock_ns(), BURST)
        self._sender.send(due, self._player)
        self._become(due.player, anew=due.player.laps != self._player.laps)
        if due.player.state == "ended" and not self._settings.stay:
            self._leave_at_ns = self._clock_ns() + LINGER_NS
            self._sender.flow.ask()
            return 0.0
        return wait_s(self._player.next_ns(), self._clock_ns)

    def close(self) -> None:
        """Leave the bus in order."""
        self._sender.close()

    def control(self, told: ReplayControl) -> ReplayStatus:
        """Do what was told, and tell where that leads.

        Raises
        ------
        BadRate, NoSuchMark
            It can't be done; nothing changes.
        """
        if told.command == "stop":
            self._host.stop()
        else:
            obeyed = obey(told, self._recording, self._player, self._clock_ns())
            if obeyed.due is not None:
                self._sender.send(obeyed.due)
            self._become(obeyed.player, obeyed.anew)
        return self.status()

    def status(self, marks: bool = False) -> ReplayStatus:
        """Tell where it stands; called by the health thread, too."""
        return status_of(self._recording, self._player, self._clock_ns(), marks=marks)

    def _become(self, player: Player, anew: bool = False) -> None:
        self._player = player
        if anew:
            self._sender.show(player.index)
