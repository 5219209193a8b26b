"""How the executive has a log closed that cannot be written for a while."""

from typing import Any

import pytest

from fras_common.bus import NoAnswer, RemoteFault
from fras_common.errors import FrasError
from fras_common.messages import CloseReply, CloseRequest, Fault, OpenRequest, ResetReply
from fras_common.scenario import Scenario
from fras_planner.effects import Ask, Pause
from fras_planner.requests import LOG_PAUSES_S, close_log

CLOSING = CloseRequest(trial="t", last_tick=7, status_seq=3)
OPENING = OpenRequest(trial="t", directory="/logs/t", scenario=Scenario(), mesh=b"")
OPENED, CLOSED = ResetReply(digest=""), CloseReply(path="/logs/t", messages=1, lost=0)


def fault(kind: str) -> RemoteFault:
    return RemoteFault("recorder/close", Fault(kind=kind, text="no room"))


def perform(answers: list[Any]) -> list[str | float]:
    """Answer what is asked; returns the questions and pauses."""
    steps, done = close_log(CLOSING, OPENING), list[str | float]()
    outcome: Any = None
    while True:
        try:
            effect = steps.throw(outcome) if isinstance(outcome, FrasError) else steps.send(outcome)
        except StopIteration:
            assert answers == []
            return done
        if isinstance(effect, Pause):
            assert effect.waiting_for == "recorder"
            done.append(effect.seconds_s)
            outcome = None
        else:
            assert isinstance(effect, Ask)
            assert effect.request in (CLOSING, OPENING)
            done.append(effect.query.key.removeprefix("recorder/"))
            outcome = answers.pop(0)


def test_a_log_is_closed_once():
    assert perform([CLOSED]) == ["close"]


def test_another_recorder_is_asked_at_once_to_take_it_up():
    assert perform([fault("NothingToClose"), OPENED, CLOSED]) == ["close", "open", "close"]


def test_a_disk_that_has_room_again_gets_the_end():
    answers = [fault("LogFailed"), fault("LogUnwritable"), OPENED, fault("NothingToClose")]
    told = perform([*answers, OPENED, CLOSED])
    assert told == ["close", 0.5, "open", 1.0, "open", "close", 2.0, "open", "close"]


def test_a_disk_that_stays_full_ends_it_with_what_was_wrong_last():
    answers: list[Any] = [fault("LogFailed")] * (1 + len(LOG_PAUSES_S))
    with pytest.raises(RemoteFault, match="no room"):
        perform([fault("NothingToClose"), *answers])


@pytest.mark.parametrize("error", [fault("LogExists"), NoAnswer("recorder/close", 15.0)])
def test_what_will_not_pass_is_not_waited_for(error: FrasError):
    with pytest.raises(type(error)):
        perform([error])
