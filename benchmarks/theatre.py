"""A stack under the surgeon's page, and the latest that it said."""

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import msgspec
import psutil

from fras_cli.options import build_trial
from fras_cli.stack import UsedStack
from fras_cli.trial import TrialFollower
from fras_common.messages import Holds, Plan, Presence, ResumeRequest, RobotState, TaskStatus
from fras_common.scenario import Scenario
from fras_common.topics import HOLDS, PLAN, PRESENCE, RESUME, ROBOT_STATE, TASK_STATUS

PATIENCE_S: Final = 90.0


def eventually(condition: Callable[[], Any], what: str) -> Any:
    """Wait until a condition gives something true, and return that."""
    deadline_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline_s:
        if found := condition():
            return found
        time.sleep(0.01)  # the interval between two looks, not the wait itself
    raise AssertionError(f"not within {PATIENCE_S} s: {what}")


class Theatre:
    """One stack, its trials and what it says of them.

    Parameters
    ----------
    stack : UsedStack
    folder : Path
        For logs.
    """

    def __init__(self, stack: UsedStack, folder: Path) -> None:
        self.link = stack.link
        self.robot: list[RobotState] = []
        self.plans: list[Plan] = []
        self.task: list[TaskStatus] = []
        self.held: list[Holds] = []
        self.present: list[Presence] = []
        self.folder = self._folder = folder
        self._count = 0
        self._follower = TrialFollower(stack)
        bus = self.link.bus
        bus.subscribe(ROBOT_STATE, self.robot.append)
        bus.subscribe(PLAN, self.plans.append)
        bus.subscribe(TASK_STATUS, self.task.append)
        bus.subscribe(HOLDS, self.held.append)
        bus.subscribe(PRESENCE, self.present.append)

    def start(
        self,
        pace: float = 1.0,
        name: str = "a",
        mesh: str = "11,13,2",
        seed: int | None = None,
        **options: Any,
    ) -> None:
        """Begin a trial, on a coarse mesh by default; `options` are fields of its sections."""
        self._count += 1
        for heard in (self.robot, self.plans, self.task):
            heard.clear()
        raw: dict[str, Any] = msgspec.to_builtins(
            build_trial(name, pace=pace, mesh=mesh, seed=seed).scenario
        )
        # A busy machine may be slow to answer, and a hold waits for as long as a test looks.
        raw["run"] |= {"peer_timeout_s": PATIENCE_S, "hold_timeout_s": 0.0}
        for section, fields in options.items():
            raw[section] |= fields
        scenario = msgspec.convert(raw, Scenario)
        self.folder = self._folder / str(self._count)
        self._follower.start(f"page-{self._count}", scenario, self.folder)

    def until_acting(self, name: str) -> None:
        """Wait until an arm is under way in an action."""
        eventually(
            lambda: any(
                one.action is not None and one.action.name == name and one.tick > 0
                for one in self.robot[-1:]
            ),
            name,
        )

    def until_seen(self) -> None:
        """Wait until a page says that somebody looks at it who could stop the arms."""
        eventually(lambda: self.present and self.present[-1].viewers, "somebody looks")

    def until_ended(self) -> TaskStatus:
        """Wait until the trial is over and its log closed."""
        return eventually(
            lambda: self.task and self.task[-1].phase == "idle" and self.task[-1], "the end"
        )

    def until_held(self, *holders: str) -> None:
        """Wait until exactly these hold the arms."""
        eventually(
            lambda: self.held and set(self.held[-1].holds) == set(holders), f"held by {holders}"
        )

    def end(self) -> None:
        """End a trial that is under way, and lift what holds the arms."""
        for holder in self.held[-1].holds if self.held else ():
            self.link.bus.query(RESUME, ResumeRequest(holder=holder, by="cli"), PATIENCE_S)
        if self.task and self.task[-1].phase != "idle":
            self._follower.abort("the test is over")
            self.until_ended()

    def process(self, service: str) -> psutil.Process:
        """Find a service's process."""
        return next(
            one
            for one in psutil.Process(os.getpid()).children(recursive=True)
            if f"fras_{service}" in (command := one.cmdline()) and self.link.cell in command
        )
