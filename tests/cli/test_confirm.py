"""`fras run --confirm`: asked once a plan, answered by a line."""

import io

import msgspec
import pytest
from rich.console import Console

from fras_cli.confirm import Confirmation, NoTerminal, require_terminal
from fras_cli.failures import exit_status
from fras_cli.trial import TrialView
from fras_common.messages import ApproveRequest, DecisionReply, RejectRequest
from fras_planner.memory import first_status
from support.recordings import plan

PLAN = msgspec.structs.replace(plan("initial"), request_id="c1", explanation=["Because {x} [b]."])
WAITS = msgspec.structs.replace(first_status("t"), phase="awaiting_approval", plan="c1")
WAITING = TrialView(task=WAITS, plan=PLAN)
TAKEN = DecisionReply(accepted=True)


class Terminal:
    """A person who types lines, and a planner that answers."""

    def __init__(self, *lines: str | type[EOFError] | None, reply: DecisionReply = TAKEN) -> None:
        self._lines = list(lines)
        self._out = io.StringIO()
        self.asked: list[ApproveRequest | RejectRequest] = []
        self.pauses = 0
        self._reply = reply
        console = Console(file=self._out, width=200)
        self._confirmation = Confirmation(console, self._decide, self._line)

    def _decide(self, request: ApproveRequest | RejectRequest) -> DecisionReply:
        self.asked.append(request)
        return self._reply

    def _line(self) -> str | None:
        line = self._lines.pop(0) if self._lines else None
        if line is EOFError:
            raise EOFError
        assert line is None or isinstance(line, str)
        return line

    def _pause(self) -> None:
        self.pauses += 1

    def look(self, view: TrialView = WAITING) -> bool:
        return self._confirmation.look(view, self._pause)

    @property
    def text(self) -> str:
        return self._out.getvalue()


def test_a_plan_is_shown_with_its_reasons_and_asked_about_once() -> None:
    terminal = Terminal(None, None)
    assert terminal.look()
    assert terminal.look()
    assert terminal.text.count("do it?") == 1
    assert "Because {x} [b]." in terminal.text
    assert terminal.pauses == 1
    assert terminal.asked == []


def test_yes_approves() -> None:
    terminal = Terminal("y")
    assert not terminal.look()
    assert terminal.asked == [ApproveRequest(trial="t", plan="c1", by="cli")]
    # Until the planner says so, the same plan seems to wait.
    assert not terminal.look()
    assert len(terminal.asked) == 1


def test_no_asks_why_and_rejects() -> None:
    terminal = Terminal("n", None, "too near the vessel")
    assert [terminal.look() for _ in range(3)] == [True, True, False]
    (request,) = terminal.asked
    assert isinstance(request, RejectRequest)
    assert (request.reason, request.exclude) == ("too near the vessel", [])


@pytest.mark.parametrize("line", ["", "maybe", "yn"])
def test_anything_else_is_asked_again(line: str) -> None:
    terminal = Terminal(line)
    assert terminal.look()
    assert terminal.text.count("do it?") == 2
    assert terminal.asked == []


def test_a_refused_decision_is_told_and_asked_again() -> None:
    refused = DecisionReply(accepted=False, reason="nothing_to_exclude", text="nothing is left")
    terminal = Terminal("n", "no", "y", reply=refused)
    assert all(terminal.look() for _ in range(3))
    assert "nothing_to_exclude" in terminal.text
    assert isinstance(terminal.asked[1], ApproveRequest)


def test_what_the_page_decided_is_not_asked_any_more() -> None:
    terminal = Terminal(None)
    terminal.look()
    assert not terminal.look(TrialView(task=first_status("t"), plan=PLAN))
    assert "decided elsewhere" in terminal.text


def test_a_plan_that_has_not_come_yet_is_not_asked_about() -> None:
    late = msgspec.structs.replace(PLAN, request_id="c0")
    assert not Terminal().look(TrialView(task=WAITS, plan=late))


def test_the_end_of_the_input_decides_nothing() -> None:
    terminal = Terminal(EOFError)
    assert all(terminal.look() for _ in range(3))
    assert terminal.text.count("nobody answers here any more") == 1
    assert terminal.asked == []


def test_without_a_terminal_it_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    with pytest.raises(NoTerminal) as caught:
        require_terminal()
    assert exit_status(caught.value) == 2
    assert "fras approve" in str(caught.value)
