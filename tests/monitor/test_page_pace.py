"""How often the page is drawn."""

import pytest

from fras_monitor.pace import FRAME_S, MOST_S, SHARE, Frames

TOOK_S = 0.004


def run(speed: float, took_s: float = TOOK_S, pictures: int = 50) -> float:
    """Draw a trial of some speed; return the pictures a second."""
    frames, now_s = Frames(), 100.0
    for _ in range(pictures):
        frames.drawn(now_s, took_s, speed * (now_s - 100.0))
        now_s += frames.wait_s(now_s)
    return pictures / (now_s - 100.0)


def test_a_trial_at_the_pace_of_life_is_drawn_twenty_times_a_second_whatever_it_takes():
    assert run(1.0) == pytest.approx(1.0 / FRAME_S)
    assert run(1.0, took_s=0.02) == pytest.approx(1.0 / FRAME_S)


def test_one_that_runs_faster_takes_no_more_than_its_share_of_a_processor():
    assert run(5.0) * TOOK_S == pytest.approx(SHARE, rel=0.05)


def test_one_that_runs_faster_is_drawn_twice_a_second_whatever_it_takes():
    assert run(5.0, took_s=0.1) == pytest.approx(1.0 / MOST_S, rel=0.05)


def test_one_that_runs_faster_is_drawn_as_often_where_that_is_cheap():
    assert run(5.0, took_s=0.001) == pytest.approx(1.0 / FRAME_S)


def test_a_trial_that_begins_anew_or_stands_is_drawn_as_often_as_ever():
    frames = Frames()
    frames.drawn(100.0, TOOK_S, 50.0)
    frames.drawn(100.1, TOOK_S, 0.0)
    assert frames.wait_s(100.1) == pytest.approx(FRAME_S)
    assert not frames.fast
    frames.drawn(100.2, TOOK_S, 0.0)
    assert frames.wait_s(100.2) == pytest.approx(FRAME_S)
    frames.drawn(100.3, TOOK_S, 0.5)
    assert frames.fast


def test_a_glance_is_waited_for_and_no_longer():
    frames = Frames()
    frames.drawn(100.0, TOOK_S, 0.0)
    wait_s = frames.glance(101.0)
    assert 0.0 < wait_s < FRAME_S
    assert frames.wait_s(101.0) == pytest.approx(wait_s)
