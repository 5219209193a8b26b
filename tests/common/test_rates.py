"""How often something may happen, with a clock of the test's own."""

from hypothesis import given
from hypothesis import strategies as st

from fras_common.service.rates import (
    BURST,
    OTHERS,
    PER_S,
    SUBJECTS,
    TOLD_AT_ONCE,
    WAITING,
    Admission,
    Budget,
    Telling,
)


@given(gaps_s=st.lists(st.floats(0.0, 2.0), max_size=300), per_s=st.floats(0.5, 50.0))
def test_a_budget_is_never_exceeded_in_any_stretch_of_time(
    gaps_s: list[float], per_s: float
) -> None:
    budget, now_s, taken = Budget(per_s, burst=5), 0.0, list[float]()
    for gap_s in gaps_s:
        now_s += gap_s
        if budget.take(now_s):
            taken.append(now_s)
    for first, since_s in enumerate(taken):
        for last in range(first, len(taken)):
            allowed = 5 + (taken[last] - since_s) * per_s
            assert last - first + 1 <= allowed + 1e-6


def test_a_budget_is_full_again_after_a_rest_and_a_clock_that_goes_back_gives_nothing() -> None:
    budget = Budget(per_s=1.0, burst=3)
    assert [budget.take(0.0) for _ in range(4)] == [True, True, True, False]
    assert not budget.take(-100.0)
    assert not budget.take(0.5)
    assert budget.take(1.1)
    assert [budget.take(1000.0) for _ in range(4)] == [True, True, True, False]


def test_few_wait_however_slowly_they_come() -> None:
    admission = Admission()
    assert all(admission.enter(float(second)) for second in range(WAITING))
    assert not admission.enter(1e6)
    admission.leave()
    assert admission.enter(1e6)


def test_who_asks_ten_thousand_times_a_second_is_answered_as_often_as_is_allowed() -> None:
    admission, answered = Admission(), 0
    for number in range(100_000):
        if admission.enter(number / 10_000):
            admission.leave()
            answered += 1
    assert abs(answered - (BURST + 10 * PER_S)) <= 1


def test_what_is_not_told_is_told_of_later_and_each_subject_by_itself() -> None:
    telling = Telling()
    told = [telling.due("a", 0.0) for _ in range(TOLD_AT_ONCE + 5)]
    assert told == [0] * TOLD_AT_ONCE + [None] * 5
    assert telling.due("b", 0.0) == 0
    assert telling.due("a", 1.0) == 5
    assert telling.due("a", 1.0) is None


def test_subjects_without_end_take_no_memory_without_end() -> None:
    telling = Telling()
    told = [telling.due(f"subject {number}", 0.0) for number in range(10 * SUBJECTS)]
    assert len([one for one in told if one is not None]) == SUBJECTS + TOLD_AT_ONCE
    # Those of the last belong to all others together, whose budget is spent.
    assert telling.due(OTHERS, 0.0) is None
