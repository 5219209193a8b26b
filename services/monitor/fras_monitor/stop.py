"""The stop: straight from a button to motion, on a thread that nothing drawn can keep waiting."""

import queue
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

from fras_common.bus import Bus
from fras_common.errors import FrasError
from fras_common.messages import HoldRequest, HoldState, RobotState
from fras_common.topics import HOLD, ROBOT_STATE

HOLDER: Final = "monitor"
REASON: Final = "stop pressed on the surgeon's page"
ANSWER_S: Final = 0.5
"""How long one question may take before it is asked again."""
LOOK_S: Final = 0.002
"""How often the arms are looked at while they come to rest."""

StopState = Literal["none", "sent", "acknowledged", "at_rest"]
# Phases in which an action's arm stands still.
_AT_REST: Final = frozenset({"held", "interrupted", "done"})


@dataclass(frozen=True)
class StopRecord:
    """One press of the button, and what came of it; times by a clock that never goes back.

    Attributes
    ----------
    pressed_s : float
        When the page's server got it.
    acknowledged_s, at_rest_s : float or None
        When motion said that it holds, and when it said that the arms stand still.
    attempts : int
        How often motion was asked.
    problem : str
        Why it has not answered yet.
    """

    pressed_s: float = 0.0
    state: StopState = "none"
    acknowledged_s: float | None = None
    at_rest_s: float | None = None
    attempts: int = 0
    problem: str = ""

    def asked(self) -> "StopRecord":
        """Note that motion is asked once more."""
        return replace(self, attempts=self.attempts + 1)

    def failed(self, problem: str) -> "StopRecord":
        """Note that it did not answer."""
        return replace(self, problem=problem) if self.state == "sent" else self

    def acknowledged(self, now_s: float) -> "StopRecord":
        """Note that it holds."""
        if self.state != "sent":
            return self
        return replace(self, state="acknowledged", acknowledged_s=now_s, problem="")

    def seen(self, robot: RobotState, now_s: float) -> "StopRecord":
        """Note a state of the arms: they are at rest once one shows the hold, and no motion."""
        if self.state not in ("sent", "acknowledged") or HOLDER not in robot.holds:
            return self
        if robot.action is not None and robot.action.phase not in _AT_REST:
            return self
        known_s = self.acknowledged_s if self.acknowledged_s is not None else now_s
        return replace(self, state="at_rest", acknowledged_s=known_s, at_rest_s=now_s, problem="")

    def in_words(self, now_s: float) -> str:
        """Tell what the surgeon has to know."""
        if self.state == "none":
            return ""
        if self.state == "sent":
            waited_s = now_s - self.pressed_s
            late = f"; no answer yet: {self.problem}" if self.problem else ""
            return f"Stop sent {waited_s:.1f} s ago, not acknowledged{late}"
        words = f"Stop acknowledged after {_ms(self.acknowledged_s, self.pressed_s)}"
        if self.at_rest_s is None:
            return words
        return f"{words}, arms at rest after {_ms(self.at_rest_s, self.pressed_s)}"


class Stopper:
    """Asks motion to hold, at once and again until it has said yes.

    Parameters
    ----------
    bus : Bus
    on_change : callable
        Told, on any thread, that the record has changed.
    clock : callable
        Monotonic seconds.
    """

    def __init__(
        self,
        bus: Bus,
        on_change: Callable[[], None] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._bus = bus
        self._robot = bus.recent(ROBOT_STATE, 1)
        self._hearing = threading.Lock()
        self._on_change = on_change
        self._clock = clock
        self._lock = threading.Lock()
        self._record = StopRecord()
        self._presses: queue.SimpleQueue[bool] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="stop", daemon=True)
        self._thread.start()

    @property
    def record(self) -> StopRecord:
        """The last press."""
        with self._lock:
            return self._record

    def press(self) -> None:
        """Stop the arms; returns at once. Pressed again, motion is asked again."""
        self._change(lambda _: StopRecord(pressed_s=self._clock(), state="sent"))
        self._presses.put(True)

    def hear(self, *, sparingly: bool) -> None:
        """Hear each state of the arms, or none before the next press."""
        with self._hearing:
            if not sparingly:
                self._robot.resume()
            elif self.record.state not in ("sent", "acknowledged"):
                self._robot.pause()

    def see_holds(self, holds: Mapping[str, str], at_s: float) -> None:
        """Forget the last press if somebody else has lifted it, at a terminal say.

        Parameters
        ----------
        holds : mapping of holder to reason
            As motion last told them.
        at_s : float
            When it did.
        """
        acknowledged_s = self.record.acknowledged_s
        if acknowledged_s is not None and at_s > acknowledged_s and HOLDER not in holds:
            self.clear()

    def clear(self) -> None:
        """Forget the last press, once what it held has been let go."""
        self._change(lambda record: record if record.state == "sent" else StopRecord())

    def close(self) -> None:
        """End the thread; a stop that was not answered yet is asked no more."""
        self._presses.put(False)
        self._thread.join()

    def _run(self) -> None:
        while self._presses.get():
            with self._hearing:
                self._robot.resume()
            while self.record.state == "sent" and self._presses.empty():
                self._ask()
            while self.record.state == "acknowledged" and self._presses.empty():
                self._look()
                self._pause(LOOK_S)

    def _ask(self) -> None:
        """Ask once; an answer is waited for as long as the next attempt is not due."""
        self._change(StopRecord.asked)
        answers: queue.SimpleQueue[HoldState | FrasError] = queue.SimpleQueue()
        began_s = self._clock()
        try:
            self._bus.ask(HOLD, HoldRequest(holder=HOLDER, reason=REASON), answers.put, ANSWER_S)
            answer = answers.get(timeout=2.0 * ANSWER_S)
        except queue.Empty:
            self._change(lambda record: record.failed("the system's network does not answer"))
            self._look()
            return
        except FrasError as error:
            answer = error
        if isinstance(answer, FrasError):
            problem = str(answer)
            self._change(lambda record: record.failed(problem))
            # An answer may be lost, and yet the arms stand.
            self._look()
            # A router that is away refuses at once: asked again, but not as fast as one can.
            self._pause(ANSWER_S - (self._clock() - began_s))
        else:
            now_s = self._clock()
            self._change(lambda record: record.acknowledged(now_s))

    def _look(self) -> None:
        """See how the arms are."""
        for robot in self._robot.take():
            self._change(lambda record, robot=robot: record.seen(robot, self._clock()))

    def _pause(self, rest_s: float) -> None:
        """Wait, unless somebody presses again or the page ends."""
        if rest_s > 0.0:
            try:
                again = self._presses.get(timeout=rest_s)
            except queue.Empty:
                return
            self._presses.put(again)

    def _change(self, change: Callable[[StopRecord], StopRecord]) -> None:
        with self._lock:
            self._record = change(self._record)
        self._on_change()


def _ms(later_s: float | None, earlier_s: float) -> str:
    return f"{((later_s or earlier_s) - earlier_s) * 1e3:.0f} ms"
