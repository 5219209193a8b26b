"""When a soak is flat: by the second half, in spite of outliers, and not of a leak."""

import random

import pytest
from benchmarks.soak_verdict import BOUNDS, judge, rise


def noisy(slope: float, trials: int = 200, outliers: int = 0) -> list[float]:
    chance = random.Random(4)
    values = [100.0 + slope * trial + chance.gauss(0.0, 1.0) for trial in range(trials)]
    for trial in chance.sample(range(trials // 2, trials), outliers):
        values[trial] -= 60.0
    return values


def test_the_rise_is_the_median_of_all_pairs():
    assert rise([3.0]) == 0.0
    assert rise([1.0, 3.0, 5.0, 7.0]) == 2.0
    assert rise([1.0, 3.0, -90.0, 7.0, 9.0]) == pytest.approx(2.0)


@pytest.mark.parametrize("outliers", [0, 15])
def test_a_leak_is_seen_through_noise(outliers: int):
    bound = BOUNDS["memory_mib"]
    assert judge("sim", "memory_mib", noisy(0.0, outliers=outliers)).is_flat
    leak = judge("sim", "memory_mib", noisy(2 * bound, outliers=outliers))
    assert not leak.is_flat
    assert leak.slope == pytest.approx(2 * bound, rel=0.2)


def test_what_fills_in_the_first_half_is_no_leak():
    filling = [min(trial, 90) * 1.0 for trial in range(200)]
    assert judge("sim", "memory_mib", filling).is_flat
    assert (judge("sim", "memory_mib", filling).first, filling[100]) == (0.0, 90.0)


def test_a_descriptor_every_tenth_trial_is_a_leak_and_one_that_comes_and_goes_is_none():
    assert not judge("sa", "descriptors", [16 + trial // 10 for trial in range(200)]).is_flat
    assert judge("sa", "descriptors", [16 + trial % 2 for trial in range(200)]).is_flat
    # Steps of one, so that even a slow leak is more than a bound below one a trial.
    assert not judge("sa", "threads", [8 + trial // 40 for trial in range(200)]).is_flat
