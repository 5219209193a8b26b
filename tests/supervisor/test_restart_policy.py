"""The policy without a process: what becomes of one that ended, by what happened before."""

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fras_supervisor.policy import (
    CANNOT_START,
    CANNOT_START_TRIES,
    JITTER,
    Again,
    Done,
    End,
    GivenUp,
    Past,
    Rules,
    after,
    pause_s,
    verdict,
)

RULES = Rules(
    "on-failure", backoff_s=0.5, backoff_cap_s=10.0, stable_s=30.0, budget=5, window_s=60.0
)


def lives(rules: Rules, ends: list[tuple[float, float, int]], chance: float = 0.0) -> list[Any]:
    """Decide on several ends, one after the other, up to the last that is not followed."""
    past, decisions = Past(), []
    for at_s, ran_s, returncode in ends:
        past, decision = after(rules, past, End(at_s, ran_s, returncode), chance)
        decisions.append(decision)
        if not isinstance(decision, Again):
            break
    return decisions


@pytest.mark.parametrize(
    ("restart", "returncode", "kind"),
    [
        ("never", -9, GivenUp),
        ("never", 0, Done),
        ("on-failure", 0, Done),
        ("on-failure", 1, Again),
        ("on-failure", -9, Again),
        ("always", 0, Again),
        ("always", 1, Again),
    ],
)
def test_who_is_started_again(restart: Any, returncode: int, kind: type) -> None:
    _, decision = after(replace(RULES, restart=restart), Past(), End(0.0, 5.0, returncode), 0.5)
    assert isinstance(decision, kind)


def test_the_pause_doubles_up_to_its_cap() -> None:
    many = replace(RULES, budget=100)
    pauses = [one.wait_s for one in lives(many, [(0.1 * n, 0.1, -9) for n in range(8)])]
    assert pauses == [0.5, 1.0, 2.0, 4.0, 8.0, 10.0, 10.0, 10.0]


def test_after_a_stable_time_the_pause_is_the_first_one_again() -> None:
    ends = [(1.0, 1.0, 1), (3.0, 1.0, 1), (40.0, 30.0, 1), (42.0, 1.0, 1)]
    assert [one.wait_s for one in lives(RULES, ends)] == [0.5, 1.0, 0.5, 1.0]
    almost = [(1.0, 1.0, 1), (3.0, 1.0, 1), (40.0, 29.9, 1)]
    assert lives(RULES, almost)[-1].wait_s == 2.0


def test_one_end_more_than_the_budget_within_the_window_is_the_last() -> None:
    decisions = lives(RULES, [(10.0 * n, 5.0, 1) for n in range(9)])
    assert [type(one) for one in decisions] == [Again] * 5 + [GivenUp]
    assert [one.number for one in decisions[:5]] == [1, 2, 3, 4, 5]
    assert "5 times in 60 s" in decisions[-1].reason


def test_what_happened_before_the_window_does_not_count() -> None:
    assert all(
        isinstance(one, Again) for one in lives(RULES, [(12.5 * n, 9.0, 1) for n in range(50)])
    )


def test_who_cannot_start_is_not_tried_for_ever() -> None:
    decisions = lives(RULES, [(100.0 * n, 1.0, CANNOT_START) for n in range(9)])
    assert [type(one) for one in decisions] == [Again] * (CANNOT_START_TRIES - 1) + [GivenUp]
    assert "can't start" in decisions[-1].reason


def test_a_crash_in_between_forgets_that_it_could_not_start() -> None:
    ends = [(100.0 * n, 1.0, CANNOT_START if n % 2 == 0 else 1) for n in range(9)]
    assert all(isinstance(one, Again) for one in lives(RULES, ends))


@pytest.mark.parametrize(
    ("states", "judged"),
    [
        (["ready", "ready"], "whole"),
        (["ready", "waiting"], "incomplete"),
        (["ready", "ended"], "incomplete"),
        (["given_up", "waiting", "ready"], "safe_hold"),
    ],
)
def test_the_verdict_on_a_stack(states: list[str], judged: str) -> None:
    assert verdict(states) == judged


rules = st.builds(
    lambda restart, first, factor, stable, budget, window: Rules(
        restart, first, first * factor, stable, budget, window
    ),
    st.sampled_from(["never", "on-failure", "always"]),
    st.floats(0.01, 100.0),
    st.floats(1.0, 1000.0),
    st.floats(0.1, 3600.0),
    st.integers(1, 20),
    st.floats(0.1, 3600.0),
)
histories = st.lists(
    st.tuples(st.floats(0.0, 100.0), st.floats(0.0, 100.0), st.sampled_from([0, 1, 3, -9, -11])),
    max_size=60,
)


@given(rules, histories, st.floats(0.0, 1.0))
def test_pauses_keep_to_their_bounds_whatever_happens(
    rules: Rules, history: list[tuple[float, float, int]], chance: float
) -> None:
    past, at_s = Past(), 0.0
    for idle_s, ran_s, returncode in history:
        at_s += idle_s + ran_s
        past, decision = after(rules, past, End(at_s, ran_s, returncode), chance)
        if isinstance(decision, Again):
            assert 0.0 < decision.wait_s <= rules.backoff_cap_s
            assert decision.wait_s >= rules.backoff_s * (1.0 - JITTER) * (1 - 1e-12)
            assert 1 <= decision.number <= rules.budget


@given(rules, histories)
def test_no_window_ever_holds_more_restarts_than_the_budget(
    rules: Rules, history: list[tuple[float, float, int]]
) -> None:
    past, at_s, restarts = Past(), 0.0, []
    for idle_s, ran_s, returncode in history:
        at_s += idle_s + ran_s
        past, decision = after(rules, past, End(at_s, ran_s, returncode), 0.0)
        if isinstance(decision, Again):
            restarts.append(at_s)
        within = [one for one in restarts if at_s - rules.window_s < one <= at_s]
        assert len(within) <= rules.budget
        # Nor is anybody given up for less.
        if (
            isinstance(decision, GivenUp)
            and "times in" in decision.reason
            and "row" not in decision.reason
        ):
            assert len(within) == rules.budget


@given(rules, st.integers(0, 10_000))
def test_a_pause_never_shrinks_with_failures(rules: Rules, in_a_row: int) -> None:
    assert pause_s(rules, in_a_row) <= pause_s(rules, in_a_row + 1) <= rules.backoff_cap_s


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_chance_only_shortens(one: float, other: float) -> None:
    waits = [after(RULES, Past(), End(0.0, 1.0, 1), chance)[1] for chance in sorted((one, other))]
    assert isinstance(waits[0], Again)
    assert isinstance(waits[1], Again)
    assert waits[1].wait_s <= waits[0].wait_s <= 0.5
