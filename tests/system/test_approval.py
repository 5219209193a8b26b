"""A person decides on the plans of a real trial, and the audit derives what came of it."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from fras_audit import audit_log
from fras_cli.stack import UsedStack
from fras_cli.trial import TrialView
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.messages import (
    ApproveRequest,
    DecisionReply,
    Plan,
    Presence,
    RejectRequest,
    ResumeRequest,
    RobotState,
    TaskStatus,
)
from fras_common.topics import PLAN, PRESENCE, RESUME, ROBOT_STATE, RPC, TASK_STATUS
from support.logs import messages

Request = ApproveRequest | RejectRequest
SUPERVISED = """\
seed = 2
[run]
supervised = true
[tissue]
node_counts = [11, 13, 2]
"""


class Page:
    """Somebody who looks at a page, as its process tells it."""

    def __init__(self, stack: UsedStack) -> None:
        self._stack = stack
        self._bus: ZenohBus | None = None
        self._ended = threading.Event()
        self._teller = threading.Thread(target=self._tell)
        self.words = 0

    @property
    def is_open(self) -> bool:
        """Whether it was opened."""
        return self._bus is not None

    def open(self) -> None:
        """Say four times a second that one person looks."""
        link = self._stack.link
        self._bus = ZenohBus(link.cell, link.connect, "monitor/test")
        self._bus.announce("alive/monitor")
        self._teller.start()

    def _tell(self) -> None:
        assert self._bus is not None
        presence = self._bus.publisher(PRESENCE)
        while True:
            presence.put(Presence(viewers=1))
            self.words += 1
            if self._ended.wait(0.25):
                return

    def close(self) -> None:
        """Leave."""
        self._ended.set()
        if self._bus is not None:
            self._teller.join()
            self._bus.close()


def setpoints(state: RobotState) -> tuple[Any, ...]:
    """Where the arms are sent."""
    return tuple((arm.setpoint_joints, arm.setpoint_jaw_rad) for arm in state.arms.values())


@pytest.fixture
def page(trials: Any) -> Iterator[Page]:
    made = Page(trials.stack)
    yield made
    made.close()


class Person:
    """Rejects the first plan, approves all others; remembers what was answered."""

    def __init__(self, decide: Callable[[Request], DecisionReply]) -> None:
        self._decide = decide
        self.replies: list[DecisionReply] = []
        self.plans: list[str] = []

    def look(self, view: TrialView) -> None:
        """Decide on a plan that waits, once."""
        task = view.task
        if task is None or task.phase != "awaiting_approval" or task.plan in self.plans:
            return
        about: dict[str, Any] = {"trial": task.trial, "plan": task.plan, "by": "cli"}
        first = not self.plans
        self.plans.append(task.plan)
        request = RejectRequest(**about, reason="vessel") if first else ApproveRequest(**about)
        self.replies.append(self._decide(request))


def test_a_rejected_plan_is_replaced_and_the_log_derives_it(trials: Any) -> None:
    person = Person(trials.follower.decide)
    summary, log = trials.run("default", person.look, seed=2, mesh="11,13,2", confirm=True)
    assert summary.outcome == "success"
    first, second, *_ = messages(log, PLAN.key)
    (excluded,) = person.replies[0].excluded
    assert excluded == first.target
    assert second.target not in {first.target, ""}
    assert "Planned anew: a person rejected the plan before, vessel." in second.explanation
    assert not any(excluded in action for action in summary.actions)
    statuses: list[TaskStatus] = messages(log, TASK_STATUS.key)
    assert [one.approved for one in statuses[-1].decisions] == [False, True]
    for name in ("approve", "reject"):
        assert len(messages(log, RPC.of(service="planner", name=name).key)) == 1
    report = audit_log(log, ("planner", "motion"), lambda *_: None)
    assert report.tallies
    assert all(one.is_clean for one in report.tallies), report
    assert isinstance(first, Plan)


def test_a_supervised_trial_waits_for_a_page_and_for_a_person_to_lift_the_hold(
    trials: Any, page: Page, tmp_path: Path
) -> None:
    """The hold stands from the start; with somebody at a page, and lifted, the trial goes on."""
    lifted: list[int] = []

    def look(view: TrialView) -> None:
        if view.robot is None or "monitor:page" not in view.robot.holds:
            return
        if not page.is_open:
            page.open()
        elif not lifted and page.words > 2:
            trials.stack.link.bus.query(RESUME, ResumeRequest(holder="monitor:page", by="cli"), 5.0)
            lifted.append(view.robot.tick)

    scenario = tmp_path / "supervised.toml"
    scenario.write_text(SUPERVISED)
    summary, log = trials.run(str(scenario), look)
    assert summary.outcome == "success"
    assert len(lifted) == 1
    states: list[RobotState] = messages(log, ROBOT_STATE.key)
    # An action that is asked for meanwhile takes a tick, and nothing moves in it.
    held = [one for one in states if "monitor:page" in one.holds]
    assert held[0].tick == 0
    assert {setpoints(one) for one in held} == {setpoints(states[0])}
    words: list[Presence] = messages(log, PRESENCE.key)
    assert words
    report = audit_log(log, ("motion",), lambda *_: None)
    assert "supervision" in {one.what for one in report.tallies}
    assert all(one.is_clean for one in report.tallies), report
