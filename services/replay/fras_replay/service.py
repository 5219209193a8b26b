"""The replay's shell: sends what is due, answers on `replay/...`, says what it is."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from fras_common.bus import RawPublisher
from fras_common.messages import ReplayControl, ReplayStatus, ReplayStatusRequest
from fras_common.service import ServiceHost
from fras_common.topics import REPLAY_CONTROL, REPLAY_STATUS, Qos
from fras_replay.cell import NAME, live
from fras_replay.errors import LiveCell, NoSuchMark
from fras_replay.flow import Flow
from fras_replay.lateness import Lateness
from fras_replay.player import UNLIMITED, Due, Player
from fras_replay.recording import NS, Recording

TOKENS_S = 5.0
# Between two of them questions are answered.
BURST = 64
# A sleeper is woken 0.1 ms late or so, so it looks at the clock for the last of its way. No longer
# than that: who spins uses its share of a busy processor up, and is then made to wait for 4 ms in
# mid-schedule (measured beside other work, one to four runs each: with 0 / 0.1 / 0.5 / 2 ms of
# spinning p99 3.0 to 5.2 / 3.1 to 3.2 / 2.6 to 5.3 / 4.3 ms, and 2 ms or so late already for one
# message in 10 with 0.5 ms; median 0.13 / 0.05 / 0.05 / 0.09 ms).
SPIN_NS = 100_000
# Who lost something as fast as it went learns so from a heartbeat (0.1 s), and asks for it.
LINGER_NS = NS // 2
MARK_PASSED_NS = NS


class Clock(Protocol):
    """Monotonic nanoseconds."""

    def __call__(self) -> int:
        """Return them."""
        ...


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


class ReplayHost(ServiceHost):
    """A host whose health says that what is heard here is a replay."""

    def __init__(self) -> None:
        super().__init__(NAME)
        self.telling: Callable[[], str] = lambda: "starting"

    @property
    def state(self) -> str:
        """`replay: ` and where it stands."""
        return f"replay: {self.telling()}"


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
    clock_ns : Clock

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
        clock_ns: Clock = time.monotonic_ns,
    ) -> None:
        self._host = host
        self._recording = recording
        self._settings = settings
        self._clock_ns = clock_ns
        self._leave_at_ns: int | None = None
        self._flow = Flow(host)
        self.lateness = Lateness()
        self.intruder: LiveCell | None = None
        self._require_dead(host.bus.tokens(TOKENS_S))
        self._publishers = [self._publisher(number) for number in range(len(recording.lines))]
        # Seen by others before it looks again: of two that begin at once none goes on.
        host.announce_alive()
        self._require_dead(host.bus.tokens(TOKENS_S))
        host.bus.watch_tokens(self._on_token)
        self._player = player
        self._begun = False
        host.gate.trial = recording.trial
        host.facts["replay_of"] = str(recording.path)
        host.telling = lambda: in_words(self.status())
        host.serve(REPLAY_CONTROL, self.control)
        host.serve(REPLAY_STATUS, self._tell)
        if player.index:
            self._show(player.index)

    def wake(self) -> float | None:
        """Send what is due; return the seconds until the next message is."""
        if self._flow.waiting:
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
        self._send(due)
        if due.player.laps != self._player.laps:
            self._show(due.player.index)
        self._player = due.player
        if due.player.state == "ended" and not self._settings.stay:
            self._leave_at_ns = self._clock_ns() + LINGER_NS
            self._flow.ask()
            return 0.0
        return self._wait()

    def close(self) -> None:
        """Leave the bus in order."""
        for publisher in self._publishers:
            publisher.close()

    def control(self, told: ReplayControl) -> ReplayStatus:
        """Do what was told, and tell where that leads.

        Raises
        ------
        BadRate, NoSuchMark
            It can't be done; nothing changes.
        """
        now_ns, player = self._clock_ns(), self._player
        match told.command:
            case "play":
                self._become(player.play(now_ns), anew=player.state == "ended")
            case "pause":
                self._become(player.pause(now_ns))
            case "step":
                due = player.step(now_ns)
                self._send(due, timed=False)
                self._become(due.player)
            case "back":
                self._become(player.back(now_ns), anew=True)
            case "rate":
                self._become(player.at_rate(told.value, now_ns))
            case "loop":
                self._become(player.looping(bool(told.value)))
            case "stop":
                self._host.stop()
            case _:
                self._seek(told, now_ns)
        return self.status()

    def status(self, marks: bool = False) -> ReplayStatus:
        """Tell where it stands; called by the health thread, too."""
        player, recording = self._player, self._recording
        timeline = recording.timeline
        place = player.place(self._clock_ns())
        return ReplayStatus(
            phase=player.state,
            position_s=place.at_ns / NS,
            begin_s=player.begin.at_ns / NS,
            end_s=player.end.at_ns / NS,
            duration_s=timeline.duration_ns / NS,
            log_time_ns=recording.began_ns + place.at_ns,
            tick=timeline.tick(place),
            last_tick=timeline.last_tick,
            rate=player.rate,
            loop=player.loop,
            laps=player.laps,
            mark=recording.mark_at(place),
            messages=place.before,
            of=timeline.end.before,
            log=str(recording.path),
            trial=recording.trial,
            damage=list(recording.damage),
            marks=[mark.told for mark in recording.marks] if marks else [],
        )

    def mark_text(self, number: int) -> str:
        """Return what a mark tells, in words; empty for none."""
        if number < 0:
            return ""
        told = self._recording.marks[number].told
        return f"{told.kind} {told.text}"

    # --- inside ---------------------------------------------------------------------------

    def _tell(self, request: ReplayStatusRequest) -> ReplayStatus:
        return self.status(request.marks)

    def _seek(self, told: ReplayControl, now_ns: int) -> None:
        timeline, player = self._recording.timeline, self._player
        match told.command:
            case "seek_s":
                place = timeline.at(round(told.value * NS))
            case "seek_tick":
                place = timeline.after_tick(int(told.value))
            case _:
                place = self._recording.marks[self._mark(told, now_ns)].place
        self._become(player.seek(place, now_ns), anew=True)

    def _mark(self, told: ReplayControl, now_ns: int) -> int:
        place = self._player.place(now_ns)
        last = self._recording.mark_at(place)
        match told.command:
            case "next_mark":
                number = last + 1
            case "previous_mark":
                # While it plays, the mark just passed is not the one that is meant.
                back_ns = MARK_PASSED_NS if self._player.state == "playing" else 0
                number = self._recording.mark_before(place, back_ns)
            case _:
                number = int(told.value)
        if not 0 <= number < len(self._recording.marks):
            raise NoSuchMark(
                f"there is no such mark; the log has {len(self._recording.marks)}", number=number
            )
        return number

    def _become(self, player: Player, anew: bool = False) -> None:
        self._player = player
        if anew:
            self._show(player.index)

    def _show(self, index: int) -> None:
        """Send what says how things stand at a place, and take back what was said after it."""
        for line in self._recording.timeline.unsaid(index):
            # A late viewer would be told it as the latest.
            if self._recording.lines[line].qos is Qos.EVENT:
                self._publishers[line].close()
                self._publishers[line] = self._publisher(line)
        for number in self._recording.timeline.picture(index):
            self._put(number)

    def _send(self, due: Due, timed: bool = True) -> None:
        rated = timed and self._player.rate != UNLIMITED
        for number in range(due.first, due.stop):
            self._put(number)
            if rated:
                self.lateness.note(self._clock_ns() - self._player.due_at_ns(number))
        self._flow.sent(due.stop - due.first, self._clock_ns())
        self._host.tick = self._recording.timeline.tick(due.player.place(self._clock_ns()))

    def _put(self, number: int) -> None:
        message = self._recording.message(number)
        self._publishers[message.line].put(message.payload, message.encoding)
        self._host.counts["published"] += 1

    def _wait(self) -> float | None:
        next_ns = self._player.next_ns()
        if next_ns is None:
            return None
        gap_ns = next_ns - self._clock_ns()
        if gap_ns > SPIN_NS:
            return (gap_ns - SPIN_NS) / NS
        while self._clock_ns() < next_ns:
            pass
        return 0.0

    def _publisher(self, line: int) -> RawPublisher:
        one = self._recording.lines[line]
        return self._host.bus.publisher_raw(one.key, one.qos)

    def _on_token(self, token: str, present: bool) -> None:
        if present and live({token}, self._settings.instance):
            self._host.post(lambda: self._flee({token}))

    def _flee(self, tokens: set[str]) -> None:
        """Stop before the next message: somebody who acts on them has come."""
        others = live(tokens, self._settings.instance)
        self.intruder = LiveCell(self._settings.cell, others)
        self._host.stop()

    def _require_dead(self, tokens: frozenset[str]) -> None:
        if others := live(tokens, self._settings.instance):
            raise LiveCell(self._settings.cell, others)


def in_words(status: ReplayStatus) -> str:
    """Where a replay stands, for people."""
    speed = "as fast as possible" if status.rate == UNLIMITED else f"rate {status.rate:g}"
    loop = f", lap {status.laps + 1}" if status.loop else ""
    return (
        f"{status.phase} {status.position_s:.2f} s of {status.duration_s:.2f} s, "
        f"tick {status.tick} of {status.last_tick}, {speed}{loop}"
    )
