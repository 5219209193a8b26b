from fras_motion.holds import Holds
from fras_motion.patience import Patience


def test_silent_peer_is_named_and_then_given_up():
    patience = Patience(peer_timeout_s=10.0, hold_timeout_s=30.0)
    waits = [(t, patience.exhausted(t, "sa", Holds()), patience.waiting_for) for t in (5.0, 5.4)]
    waits += [(t, patience.exhausted(t, "sa", Holds()), patience.waiting_for) for t in (5.5, 14.9)]
    assert waits == [(5.0, "", ""), (5.4, "", ""), (5.5, "", "sa"), (14.9, "", "sa")]
    assert patience.exhausted(15.0, "sa", Holds()) == "hold:sa"


def test_answer_makes_the_waiting_begin_anew():
    patience = Patience(peer_timeout_s=10.0, hold_timeout_s=30.0)
    patience.exhausted(0.0, "sim", Holds())
    patience.rest()
    assert patience.exhausted(12.0, "sim", Holds()) == ""
    assert patience.exhausted(22.0, "sim", Holds()) == "hold:sim"


def test_hold_that_nobody_lifts_is_given_up():
    patience, holds = Patience(peer_timeout_s=10.0, hold_timeout_s=30.0), Holds()
    holds.hold("page", "look")
    assert [patience.exhausted(t, "", holds) for t in (1.0, 30.9, 31.0)] == [
        "", "", "hold:page:look",
    ]  # fmt: skip


def test_hold_on_a_kept_stack_is_never_given_up():
    patience, holds = Patience(peer_timeout_s=10.0, hold_timeout_s=0.0), Holds()
    holds.hold("page", "look")
    assert [patience.exhausted(t, "", holds) for t in (1.0, 1e9)] == ["", ""]
