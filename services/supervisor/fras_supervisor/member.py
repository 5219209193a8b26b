"""One process of the table through all its lives."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from signal import SIGKILL
from typing import Literal

from fras_supervisor.child import Child, Exit
from fras_supervisor.errors import describe_returncode
from fras_supervisor.policy import Again, Done, End, Past, after
from fras_supervisor.shutdown import escalate
from fras_supervisor.table import Process

State = Literal[
    "pending", "starting", "ready", "stopping", "waiting", "ended", "given_up", "stopped"
]
Level = Literal["info", "warning", "error"]
LIVING: tuple[State, ...] = ("starting", "ready", "stopping")


@dataclass(frozen=True)
class Event:
    """Something to tell of a process, how grave it is, and what it now counts as."""

    level: Level
    name: str
    text: str
    state: State


class Member:
    """State machine of one process.

    Parameters
    ----------
    process : Process
    launch : callable
        Launches it.
    chance : callable
        From 0 to 1; see `policy.after`.
    """

    def __init__(
        self, process: Process, launch: Callable[[], Child], chance: Callable[[], float]
    ) -> None:
        self.process = process
        self.state: State = "pending"
        self.child: Child | None = None
        self.restarts = 0
        self.due_s = 0.0
        self.ready_after_s: float | None = None
        self.last_exit = ""
        self.reason = ""
        self._launch = launch
        self._chance = chance
        self._past = Past()
        self._killed_for = ""
        self._stale = False

    @property
    def name(self) -> str:
        """Its name in the table."""
        return self.process.name

    @property
    def is_living(self) -> bool:
        """Whether it was launched and has not been seen to end."""
        return self.state in LIVING

    def launch(self, stale: bool) -> None:
        """Launch it.

        Parameters
        ----------
        stale : bool
            Whether what makes it ready is there already: left by its last life, so that it has to
            go before it counts.
        """
        if self.state != "pending":
            self.restarts += 1
        self._stale = stale
        self.child = self._launch()
        self.state = "starting"

    def look(self, condition: bool, now_s: float, started_s: float) -> Event | None:
        """Note whether what makes it ready is there."""
        if not condition:
            self._stale = False
        if self.state != "starting" or not condition or self._stale:
            return None
        self.state = "ready"
        if self.child is not None:
            self.child.has_started = True
        self.ready_after_s = now_s - started_s
        return Event("info", self.name, "ready", self.state)

    def reap(self, now_s: float) -> Event | None:
        """See whether it has ended, and decide what becomes of it."""
        if self.child is None or not self.is_living or (exit_ := self.child.poll()) is None:
            return None
        ordered = self.state == "stopping" and not self._killed_for
        self.last_exit = self._in_words(exit_)
        self._killed_for = ""
        if ordered:
            return self._wait(0.0, now_s, f"ended as asked, {self.last_exit}; starts again", "info")
        end = End(now_s, now_s - self.child.launched_at, exit_.returncode)
        self._past, decision = after(self.process.rules, self._past, end, self._chance())
        if isinstance(decision, Again):
            rules = self.process.rules
            text = (
                f"ended {self.last_exit}: starts again in {decision.wait_s:.1f} s "
                f"(restart {decision.number} of {rules.budget} in {rules.window_s:g} s)"
            )
            return self._wait(decision.wait_s, now_s, text, "warning")
        if isinstance(decision, Done):
            self.state, self.reason = "ended", f"ended {self.last_exit}"
            return Event("warning", self.name, self.reason, self.state)
        return self.give_up(f"it ended {self.last_exit}: {decision.reason}")

    def give_up(self, why: str) -> Event:
        """Start it no more before somebody asks."""
        if self.child is not None and self.child.poll() is None:
            self.child.send(SIGKILL)
        self.state, self.reason = "given_up", f"was given up: {why}"
        return Event("error", self.name, self.reason, self.state)

    def kill(self, why: str) -> Event | None:
        """End it at once, as a failure; nothing if it does not live."""
        if self.child is None or not self.is_living:
            return None
        self._killed_for = why
        self.state = "stopping"
        self.child.send(SIGKILL)
        return Event("error", self.name, f"killed: {why}", self.state)

    def kill_if_overdue(self, now_s: float) -> Event | None:
        """End it if it lives and has not become ready in time."""
        if self.child is None or self.state != "starting":
            return None
        waited_s = now_s - self.child.launched_at
        if waited_s < self.process.ready_timeout_s:
            return None
        return self.kill(f"not ready after {waited_s:.1f} s")

    def urge(self) -> None:
        """Go on with a stop that was ordered: SIGINT, later SIGTERM, SIGKILL."""
        if self.child is not None and self.state == "stopping":
            escalate(self.child)

    def restart(self, now_s: float) -> Event:
        """Order a restart: what counted against it is forgotten."""
        self._past = Past()
        if self.is_living:
            self.state = "stopping"
            return Event("info", self.name, "restart ordered", self.state)
        return self._wait(0.0, now_s, "start ordered", "info")

    def has_stopped(self) -> None:
        """Note that the stack was stopped."""
        if self.child is not None:
            self.state = "stopped"

    def waiting_s(self, now_s: float) -> float:
        """Tell what is left of its back-off."""
        return max(0.0, self.due_s - now_s) if self.state == "waiting" else 0.0

    def up_s(self) -> float:
        """Tell how long it has been up; 0 while it does not live."""
        return time.monotonic() - self.child.launched_at if self.child and self.is_living else 0.0

    def _wait(self, wait_s: float, now_s: float, text: str, level: Level) -> Event:
        self.state, self.reason = "waiting", text
        self.due_s = now_s + wait_s
        return Event(level, self.name, text, self.state)

    def _in_words(self, exit_: Exit) -> str:
        told = describe_returncode(exit_.returncode)
        if self._killed_for:
            return f"{told} ({self._killed_for})"
        return told
