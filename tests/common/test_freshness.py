"""A command acts once and at once."""

import pytest

from fras_common.messages import ServoJaw
from fras_common.service.freshness import MAX_AGE_S, MAX_SOURCES, Freshness, StaleCommand

NOW_NS = 1_700_000_000_000_000_000
KEY = "psm1/jaw/servo_jp"


def told(age_s: float = 0.0, seq: int = 0, source: str = "client/1") -> ServoJaw:
    return ServoJaw(stamp_ns=NOW_NS - round(age_s * 1e9), seq=seq, source=source, jaw_rad=0.1)


@pytest.fixture
def fresh() -> Freshness:
    return Freshness()


@pytest.mark.parametrize("age_s", [-0.99 * MAX_AGE_S, 0.0, 0.99 * MAX_AGE_S])
def test_a_new_command_is_admitted(fresh: Freshness, age_s: float):
    fresh.require(KEY, told(age_s), NOW_NS)


@pytest.mark.parametrize("age_s", [1.01 * MAX_AGE_S, -1.01 * MAX_AGE_S, NOW_NS * 1e-9])
def test_an_old_one_one_of_the_future_and_one_without_a_stamp_are_refused(
    fresh: Freshness, age_s: float
):
    with pytest.raises(StaleCommand) as caught:
        fresh.require(KEY, told(age_s), NOW_NS)
    assert caught.value.values["age_s"] == pytest.approx(age_s)


def test_a_command_acts_once(fresh: Freshness):
    fresh.require(KEY, told(seq=3), NOW_NS)
    with pytest.raises(StaleCommand):
        fresh.require(KEY, told(seq=3), NOW_NS)
    with pytest.raises(StaleCommand):
        fresh.require(KEY, told(age_s=0.01, seq=2), NOW_NS)


def test_a_clock_that_was_set_back_and_a_source_that_counts_anew_are_not_replays(fresh: Freshness):
    fresh.require(KEY, told(seq=3), NOW_NS)
    fresh.require(KEY, told(age_s=0.5, seq=4), NOW_NS)
    fresh.require(KEY, told(age_s=-0.5, seq=0), NOW_NS)
    for before in (told(seq=3), told(age_s=0.5, seq=4), told(seq=0)):
        with pytest.raises(StaleCommand):
            fresh.require(KEY, before, NOW_NS)


def test_sources_and_keys_do_not_disturb_each_other(fresh: Freshness):
    for key in (KEY, "psm2/jaw/servo_jp"):
        for source in ("client/1", "client/2"):
            fresh.require(key, told(source=source), NOW_NS)


def test_a_rogue_with_many_names_takes_no_more_than_so_much_memory(fresh: Freshness):
    for number in range(2 * MAX_SOURCES):
        fresh.require(KEY, told(source=f"rogue/{number}"), NOW_NS)
    fresh.require(KEY, told(source="rogue/0"), NOW_NS)  # forgotten
    with pytest.raises(StaleCommand):
        fresh.require(KEY, told(source=f"rogue/{2 * MAX_SOURCES - 1}"), NOW_NS)
