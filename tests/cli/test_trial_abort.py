"""An interrupt stops the arms, whatever the planner does."""

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any, cast

import pytest

from fras_cli import trial
from fras_cli.stack import UsedStack
from fras_cli.trial import TrialFollower
from fras_common.bus import Call, MemoryBus, MemoryFabric, NoAnswer
from fras_common.messages import CancelReply, CancelRequest, TaskReply, TaskRequest
from fras_common.topics import CANCEL, TASK


class Cell:
    """A planner that answers as it is told to, a motion that notes, and a command line."""

    def __init__(self) -> None:
        fabric = MemoryFabric()
        self.bus = MemoryBus(fabric, "cell", "cli/test")
        self.peer = MemoryBus(fabric, "cell", "planner/test")
        self.cancels: list[str] = []
        self.asked: list[Call[TaskRequest, TaskReply]] = []
        self.on_task: Callable[[Call[TaskRequest, TaskReply]], Any] = self.asked.append
        self.on_cancel: Callable[[], Any] = lambda: None
        self.peer.serve(TASK, lambda call: self.on_task(call))
        self.peer.serve(CANCEL, self._cancel)
        stack = SimpleNamespace(link=SimpleNamespace(bus=self.bus), started_ns=0)
        self.follower = TrialFollower(cast(UsedStack, stack))

    def _cancel(self, call: Call[CancelRequest, CancelReply]) -> None:
        self.cancels.append(call.request.reason)
        self.on_cancel()
        call.reply(CancelReply(tick=7))


@pytest.fixture
def cell(monkeypatch: pytest.MonkeyPatch) -> Iterator[Cell]:
    monkeypatch.setattr(trial, "AT_ONCE_S", 0.05)
    monkeypatch.setattr(trial, "START_TIMEOUT_S", 0.3)
    made = Cell()
    yield made
    made.bus.close()
    made.peer.close()


ENDED = TaskReply(accepted=True, reason="")


def test_a_planner_that_answers_ends_the_trial_by_itself(cell: Cell) -> None:
    cell.on_task = lambda call: call.reply(ENDED)
    cell.follower.abort("Ctrl-C")
    assert cell.cancels == []


def test_a_planner_that_does_not_answer_keeps_no_arm_from_stopping(cell: Cell) -> None:
    with pytest.raises(NoAnswer):
        cell.follower.abort("Ctrl-C")
    assert cell.cancels == ["Ctrl-C"]


def test_a_planner_that_answers_late_is_awaited(cell: Cell) -> None:
    cell.on_cancel = lambda: cell.asked[0].reply(ENDED)
    cell.follower.abort("Ctrl-C")
    assert cell.cancels == ["Ctrl-C"]
