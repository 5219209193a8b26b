"""Stale is shown within 1.5 s: by health and liveliness, as functions of the time."""

import pytest

from fras_monitor.liveness import DEAD_S, LATE_S, freshness, life_of
from fras_monitor.pace import FRAME_S
from fras_monitor.picture import Picture, apply, with_token
from support import pictures as p

SHOWN_S = 1.5


def test_before_anything_has_started_the_page_says_that_it_waits():
    fresh = freshness(Picture(), 0.0)
    assert not fresh.live
    assert fresh.words == "Waiting for the system to start."


@pytest.mark.parametrize("service", ["motion", "sim", "sa"])
def test_a_silent_part_of_the_loop_makes_the_picture_old_in_time(service: str):
    # It still holds its token, as a frozen process does; the others go on.
    picture = p.picture_of(at_s=0.0)
    for other in {*p.SERVICES} - {service}:
        picture = apply(picture, p.health(other), SHOWN_S)
    assert freshness(picture, LATE_S - 0.1).live
    shown = freshness(picture, SHOWN_S - FRAME_S)
    assert not shown.live
    assert "silent for 1.4 s" in shown.words or "silent for 1.5 s" in shown.words


@pytest.mark.parametrize("service", ["planner", "recorder"])
def test_a_silent_service_outside_the_loop_leaves_the_picture_live(service: str):
    picture = with_token(p.picture_of(), f"alive/{service}/1", present=False)
    assert freshness(picture, 0.1).live
    assert life_of(picture, service, 0.1).life == "dead"


def test_a_token_that_goes_is_seen_at_once():
    picture = with_token(p.picture_of(), "alive/sim/1", present=False)
    assert life_of(picture, "sim", 0.1).life == "dead"
    assert not freshness(picture, 0.1).live


@pytest.mark.parametrize(
    ("age_s", "life"), [(0.5, "ready"), (LATE_S + 0.1, "late"), (DEAD_S + 0.1, "dead")]
)
def test_late_then_dead(age_s: float, life: str):
    assert life_of(p.picture_of(), "sim", age_s).life == life


def test_who_waits_says_for_whom_in_words():
    picture = apply(p.picture_of(), p.health("motion", "waiting: sim"), 0.0)
    assert life_of(picture, "motion", 0.1).words == "waits for the tissue model"
    assert freshness(picture, 0.1).live


def test_one_that_only_shows_itself_is_starting_and_one_that_does_not_is_absent():
    picture = with_token(Picture(), "alive/sim/1", present=True)
    assert life_of(picture, "sim", 0.0).life == "waiting"
    assert life_of(picture, "sa", 0.0).life == "absent"


def test_a_replay_is_neither_old_nor_live():
    picture = with_token(Picture(), "alive/replay/1", present=True)
    picture = apply(picture, p.health("replay", "replay: paused 1.0 s of 2.0 s"), 0.0)
    fresh = freshness(picture, 0.1)
    assert fresh.live
    assert "recording" in fresh.words
    assert life_of(picture, "replay", 0.1).words == "paused"
