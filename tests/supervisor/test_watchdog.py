"""The watchdog without a process: who is stuck, by what was heard when."""

from collections.abc import Callable, Iterable

import pytest

from fras_supervisor.watchdog import RECONNECT_S, Patience, Stuck, Watchdog

PATIENT = Patience(5.0, 60.0)
NAMES = ("sim", "sa", "motion")
Lag = Callable[[str, float], float]


def names(stuck: Iterable[Stuck]) -> list[str]:
    return [one.name for one in stuck]


def run(
    watchdog: Watchdog,
    until_s: float,
    silent: Iterable[str] = (),
    lag: Lag = lambda name, now_s: 0.0,
    since_s: float = 0.0,
) -> list[tuple[float, Stuck]]:
    """Let time pass: health every half second, a look every tenth; until somebody is blamed."""
    for step in range(1, round((until_s - since_s) * 10) + 1):
        now_s = since_s + step / 10
        if step % 5 == 0:
            for name in NAMES:
                if name not in silent:
                    watchdog.heard(name, lag(name, now_s), now_s)
        if stuck := watchdog.look(now_s):
            return [(now_s, one) for one in stuck]
    return []


@pytest.fixture
def watchdog() -> Watchdog:
    made = Watchdog()
    for name in NAMES:
        made.watch(name, PATIENT, 0.0)
    return made


def test_nobody_is_blamed_who_is_heard(watchdog: Watchdog) -> None:
    assert run(watchdog, 100.0) == []


def test_one_that_is_silent_among_others_is_blamed_in_time(watchdog: Watchdog) -> None:
    ((at_s, stuck),) = run(watchdog, 100.0, silent=["sim"])
    assert 5.0 < at_s <= 5.2
    assert stuck.name == "sim"
    assert "no sign of life for 5." in stuck.reason


def test_two_at_once_are_both_blamed(watchdog: Watchdog) -> None:
    assert names(one for _, one in run(watchdog, 100.0, silent=["sim", "sa"])) == ["sim", "sa"]


def test_where_all_are_silent_the_router_is_blamed_and_none_of_them(watchdog: Watchdog) -> None:
    assert run(watchdog, 20.0) == []
    ((at_s, stuck),) = run(watchdog, 40.0, silent=NAMES, since_s=20.0)
    assert stuck.name == ""
    assert 25.0 < at_s <= 25.2


def test_silence_is_not_blamed_on_one_while_nobody_proves_that_the_bus_carries() -> None:
    watchdog = Watchdog()
    watchdog.watch("sim", Patience(2.0, 0.0), 0.0)
    watchdog.watch("sa", Patience(8.0, 0.0), 0.0)
    assert run(watchdog, 7.9, silent=NAMES) == []


def test_a_loop_that_does_not_turn_is_blamed_though_its_process_speaks(watchdog: Watchdog) -> None:
    ((at_s, stuck),) = run(
        watchdog, 100.0, lag=lambda name, now_s: max(0.0, now_s - 3.0) if name == "sa" else 0.0
    )
    assert stuck.name == "sa"
    assert "loop" in stuck.reason
    assert 63.0 <= at_s < 63.7


def test_a_long_job_is_none(watchdog: Watchdog) -> None:
    def busy(name: str, now_s: float) -> float:
        return now_s - 10.0 if name == "sim" and 10.0 < now_s < 60.0 else 0.0

    assert run(watchdog, 100.0, lag=busy) == []


def test_zero_is_never() -> None:
    watchdog = Watchdog()
    for name in NAMES:
        watchdog.watch(name, Patience(0.0, 0.0), 0.0)
    assert run(watchdog, 1000.0, silent=["sim"], lag=lambda name, now_s: now_s) == []


def test_after_we_stood_still_nobody_is_to_blame(watchdog: Watchdog) -> None:
    """A laptop that slept, a supervisor that was stopped."""
    assert run(watchdog, 10.0) == []
    assert watchdog.look(500.0) == []
    assert run(watchdog, 510.0, since_s=500.0) == []


def test_who_was_forgiven_has_the_whole_time_again(watchdog: Watchdog) -> None:
    assert run(watchdog, 4.0, silent=NAMES) == []
    watchdog.forgive(4.0 + RECONNECT_S)
    ((at_s, _),) = run(watchdog, 40.0, silent=NAMES, since_s=4.0)
    assert 19.0 < at_s <= 19.2


def test_one_that_is_not_watched_is_not_blamed(watchdog: Watchdog) -> None:
    watchdog.forget("sim")
    watchdog.heard("supervisor", 1000.0, 0.0)
    assert run(watchdog, 100.0, silent=["sim"]) == []


def test_health_of_an_earlier_life_does_not_count_against_the_new_one(watchdog: Watchdog) -> None:
    watchdog.heard("sim", 59.0, 1.0)
    watchdog.watch("sim", PATIENT, 2.0)
    assert watchdog.look(3.9) == []
