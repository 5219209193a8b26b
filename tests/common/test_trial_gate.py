"""Only the current trial's messages pass; the next one's wait for its reset."""

from fras_common.messages import Header
from fras_common.service.gate import HELD, TrialGate


def message(trial: str, seq: int = 0) -> Header:
    return Header(trial=trial, seq=seq)


def test_messages_of_the_trial_pass():
    gate = TrialGate()
    gate.enter("t-1")
    assert gate.admit("key", message("t-1"))
    assert gate.dropped == 0


def test_others_do_not():
    gate = TrialGate()
    gate.enter("t-1")
    assert not gate.admit("key", message("t-0"))
    assert not gate.admit("key", message(""))


def test_before_the_first_reset_only_messages_without_a_trial_pass():
    gate = TrialGate()
    assert gate.admit("key", message(""))
    assert not gate.admit("key", message("t-1"))


def test_what_came_too_early_is_handed_out_in_order_of_arrival():
    gate = TrialGate()
    gate.enter("t-1")
    early = [("a", message("t-2", 0)), ("b", message("t-2", 0)), ("a", message("t-2", 1))]
    for route, early_message in early:
        assert not gate.admit(route, early_message)
    assert gate.enter("t-2") == early
    assert gate.dropped == 0
    assert gate.enter("t-2") == []


def test_what_belongs_to_no_new_trial_is_dropped_and_counted():
    gate = TrialGate()
    gate.enter("t-1")
    gate.admit("a", message("t-0"))
    gate.admit("a", message("t-2", 5))
    gate.admit("a", message("t-0"))
    assert [entry[1].seq for entry in gate.enter("t-2")] == [5]
    assert gate.dropped == 2
    assert gate.admit("a", message("t-2"))
    assert not gate.admit("a", message("t-1"))


def test_only_the_last_ones_are_kept():
    gate = TrialGate()
    gate.enter("t-1")
    for seq in range(HELD + 10):
        gate.admit("a", message("t-2", seq))
    assert gate.dropped == 10
    assert [entry[1].seq for entry in gate.enter("t-2")] == list(range(10, HELD + 10))


def test_each_drop_is_told_with_the_trial_that_is_served():
    told = []
    gate = TrialGate(lambda route, dropped, serves: told.append((route, dropped.trial, serves)))
    gate.enter("t-1")
    gate.admit("a", message("t-0"))
    gate.admit("b", message("t-2"))
    assert told == []  # both may yet begin
    gate.enter("t-2")
    assert told == [("a", "t-0", "t-2")]
