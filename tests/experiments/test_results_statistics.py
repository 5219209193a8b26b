"""Statistics against analytic cases, published values and scipy's own."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from fras_experiments.results.statistics import (
    describe,
    difference_from_summary,
    difference_of_shares,
    growth,
    holm,
    paired_numbers,
    paired_shares,
    share,
    survival,
)
from fras_experiments.results.statistics.samples import bootstrap_interval


def test_a_description_has_the_moments_and_leaves_out_what_is_missing():
    told = describe(np.array([1.0, 2.0, math.nan, 3.0, 10.0]), seed=0)
    assert (told.n, told.mean, told.median) == (4, 4.0, 2.5)
    assert (told.lowest, told.highest) == (1.0, 10.0)
    assert told.sd == pytest.approx(np.std([1, 2, 3, 10], ddof=1))
    assert told.mean_ci.low < 4.0 < told.mean_ci.high


def test_the_interval_of_a_mean_is_scipys_bca_and_the_same_for_the_same_seed():
    values = np.random.default_rng(5).exponential(size=60)
    ours = bootstrap_interval(values, np.mean, seed=3)
    assert ours == bootstrap_interval(values, np.mean, seed=3)
    assert ours != bootstrap_interval(values, np.mean, seed=4)
    theirs = stats.bootstrap((values,), np.mean, method="BCa", rng=np.random.default_rng(3))
    assert ours.low == theirs.confidence_interval.low
    assert ours.high == theirs.confidence_interval.high


def test_the_interval_of_a_normal_mean_is_near_students():
    values = np.random.default_rng(0).normal(10.0, 2.0, 200)
    ours = bootstrap_interval(values, np.mean, seed=1)
    error = values.std(ddof=1) / math.sqrt(200)
    low, high = stats.t.interval(0.95, 199, loc=values.mean(), scale=error)
    assert ours.low == pytest.approx(low, abs=0.1 * error)
    assert ours.high == pytest.approx(high, abs=0.1 * error)


def test_intervals_hold_the_true_mean_as_often_as_they_say():
    random = np.random.default_rng(7)
    held = sum(
        bootstrap_interval(random.normal(1.0, 1.0, 40), np.mean, seed=run).holds(1.0)
        for run in range(200)
    )
    # 95 % of 200 is 190; below 180 or at 200 something is wrong (p < 0.001 each).
    assert 180 <= held < 200


@pytest.mark.parametrize("values", [[], [3.0], [math.nan, 3.0]])
def test_too_few_values_have_no_interval(values: list[float]):
    told = describe(np.array(values), seed=0)
    assert math.isnan(told.mean_ci.low)
    assert math.isnan(told.sd)


def test_equal_values_and_medians_without_spread_have_finite_intervals():
    told = describe(np.full(30, 0.5), seed=0)
    assert (told.mean_ci.low, told.mean_ci.high, told.sd) == (0.5, 0.5, 0.0)
    median = bootstrap_interval(np.array([1.0] * 29 + [2.0]), np.median, seed=0)
    assert (median.low, median.high) == (1.0, 1.0)


def test_large_samples_are_described_in_reasonable_time_and_memory():
    told = describe(np.random.default_rng(0).normal(size=20_000), seed=0)
    assert told.mean_ci.high - told.mean_ci.low == pytest.approx(
        2 * 1.96 / math.sqrt(20_000), rel=0.1
    )


def test_wilsons_interval_has_its_published_values():
    # Newcombe 1998 (two-sided intervals for the single proportion), table I.
    one = share(81, 263)
    assert (one.ci.low, one.ci.high) == (
        pytest.approx(0.2553, abs=5e-5),
        pytest.approx(0.3662, abs=5e-5),
    )
    none = share(0, 20)
    assert (none.ci.low, none.ci.high) == (0.0, pytest.approx(0.1611, abs=5e-5))
    assert math.isnan(share(0, 0).value)


def test_newcombes_interval_of_independent_shares_has_its_published_value():
    # Newcombe 1998 (interval estimation for the difference), table II: 56/70 - 48/80.
    ci = difference_of_shares(share(48, 80), share(56, 70))
    assert (ci.low, ci.high) == (pytest.approx(0.0524, abs=5e-5), pytest.approx(0.3339, abs=5e-5))


def test_a_difference_from_summaries_is_welchs():
    random = np.random.default_rng(2)
    one, two = random.normal(1.0, 1.0, 30), random.normal(0.5, 3.0, 50)
    ci = difference_from_summary(one.mean(), one.std(ddof=1), 30, two.mean(), two.std(ddof=1), 50)
    theirs = stats.ttest_ind(one, two, equal_var=False).confidence_interval()
    assert (ci.low, ci.high) == (pytest.approx(theirs.low), pytest.approx(theirs.high))


def test_growth_finds_an_exponent_and_its_interval():
    random = np.random.default_rng(3)
    times = {n: 2e-5 * n**3 * random.lognormal(0.0, 0.1, 50) for n in (5, 6, 7, 8, 9, 10)}
    fit = growth(times, seed=0)
    assert fit is not None
    assert fit.exponent == pytest.approx(3.0, abs=0.15)
    assert fit.ci.holds(3.0)
    assert fit.ci.high - fit.ci.low < 0.4
    assert fit.r_squared > 0.99
    exact = growth({n: np.array([2.0 * n**1.5]) for n in (2, 4, 8)}, seed=0)
    assert exact is not None
    assert exact.exponent == pytest.approx(1.5)
    assert exact.factor == pytest.approx(2.0)
    assert math.isnan(exact.ci.low)


def test_growth_needs_three_sizes_with_times():
    assert growth({5: np.ones(3), 6: np.ones(3)}, seed=0) is None
    assert growth({5: np.ones(3), 6: np.ones(3), 7: np.array([math.nan])}, seed=0) is None


def test_kaplan_and_meiers_curve_has_its_textbook_values():
    # Freireich et al. 1963, 6-MP: as in Kalbfleisch and Prentice.
    events = [6, 6, 6, 7, 10, 13, 16, 22, 23]
    censored = [6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35]
    curve = survival(
        np.array([*events, *censored], dtype=float),
        np.array([True] * len(events) + [False] * len(censored)),
    )
    assert (curve.events, curve.n) == (9, 21)
    for at, left in (
        (5, 1.0),
        (6, 0.857),
        (7, 0.807),
        (10, 0.753),
        (13, 0.690),
        (16, 0.627),
        (22, 0.538),
        (23, 0.448),
    ):
        assert curve.at_value(at) == pytest.approx(left, abs=5e-4)
    assert curve.median() == 23
    place = int(np.searchsorted(curve.at, 10))
    # Log-log limits, as R's survfit(conf.type = "log-log") gives them.
    assert curve.low[place] == pytest.approx(0.503, abs=1e-3)
    assert curve.high[place] == pytest.approx(0.889, abs=1e-3)


def test_a_curve_without_an_event_or_without_a_survivor_is_whole():
    kept = survival(np.array([50.0, 50.0]), np.array([False, False]))
    assert kept.at_value(49.0) == kept.at_value(60.0) == 1.0
    assert np.isfinite([kept.low, kept.high]).all()
    assert math.isnan(kept.median())
    gone = survival(np.array([10.0, 20.0]), np.array([True, True]))
    assert gone.at_value(20.0) == 0.0
    assert np.isfinite([gone.low, gone.high]).all()
    with pytest.raises(ValueError, match="shapes"):
        survival(np.array([]), np.array([], dtype=bool))


@given(
    st.lists(st.tuples(st.integers(1, 20), st.booleans()), min_size=1, max_size=40),
)
@settings(max_examples=50, deadline=None)
def test_a_curve_falls_between_its_limits(ends: list[tuple[int, bool]]):
    heights, happened = (np.array(column) for column in zip(*ends, strict=True))
    curve = survival(heights.astype(float), happened)
    assert np.all(np.diff(curve.share) <= 1e-12)
    assert np.all(curve.low <= curve.share + 1e-12)
    assert np.all(curve.share <= curve.high + 1e-12)


def test_paired_numbers_are_scipys_test_with_its_effect():
    one = np.array([125, 115, 130, 140, 140, 115, 140, 125, 140, 135], dtype=float)
    two = np.array([110, 122, 125, 120, 140, 124, 123, 137, 135, 145], dtype=float)
    told = paired_numbers(one, two, seed=0)
    # W+ = 18, W- = 27 of 45: the textbook case of the signed-rank test (Wikipedia, Lowry).
    assert told.rank_biserial == pytest.approx((18 - 27) / 45)
    assert told.p == stats.wilcoxon((two - one)[two != one])[1]
    assert told.mean_difference == pytest.approx(two.mean() - one.mean())
    assert told.mean_ci.holds(told.mean_difference)


def test_missing_pairs_are_left_out_and_equal_pairs_say_nothing():
    told = paired_numbers(
        np.array([1.0, math.nan, 3.0, 4.0]), np.array([1.0, 2.0, math.nan, 4.0]), seed=0
    )
    assert (told.n, told.missing) == (2, 2)
    assert (told.p, told.rank_biserial, told.mean_difference) == (1.0, 0.0, 0.0)
    nothing = paired_numbers(np.array([math.nan]), np.array([1.0]), seed=0)
    assert nothing.n == 0
    assert math.isnan(nothing.p)
    with pytest.raises(ValueError, match="pairs"):
        paired_numbers(np.ones(2), np.ones(3), seed=0)


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=2, max_size=30))
@settings(max_examples=30, deadline=None)
def test_swapping_the_two_turns_the_sign_and_keeps_p(pairs: list[tuple[int, int]]):
    one, two = (np.array(column, dtype=float) for column in zip(*pairs, strict=True))
    there, back = paired_numbers(one, two, seed=0), paired_numbers(two, one, seed=0)
    assert there.p == pytest.approx(back.p)
    assert there.rank_biserial == pytest.approx(-back.rank_biserial)
    assert there.mean_difference == pytest.approx(-back.mean_difference)


def split(both: int, gained: int, lost: int, neither: int):
    first = np.array([True] * both + [False] * gained + [True] * lost + [False] * neither)
    second = np.array([True] * (both + gained) + [False] * (lost + neither))
    return first, second


def test_mcnemars_test_is_the_binomial_of_the_pairs_that_differ():
    told = paired_shares(*split(20, 9, 1, 10))
    assert (told.gained, told.lost) == (9, 1)
    assert told.difference == pytest.approx(0.2)
    assert told.p == pytest.approx(22 / 1024)
    assert paired_shares(*split(5, 0, 0, 5)).p == 1.0


def test_newcombes_interval_of_paired_shares_has_its_published_value():
    # Newcombe 1998 (improved confidence intervals, paired data), table III: 36, 12, 2, 0 of 50.
    told = paired_shares(*split(36, 2, 12, 0))
    assert told.difference == pytest.approx(-0.20)
    assert told.ci.low == pytest.approx(-0.3404, abs=5e-5)
    assert told.ci.high == pytest.approx(-0.0569, abs=5e-5)


def test_the_interval_of_paired_shares_holds_the_truth_as_often_as_it_says():
    random = np.random.default_rng(11)
    held = 0
    for _ in range(1000):
        first = random.uniform(size=60) < 0.7
        second = np.where(random.uniform(size=60) < 0.8, first, random.uniform(size=60) < 0.9)
        # P(second) = 0.8 * 0.7 + 0.2 * 0.9 = 0.74.
        held += paired_shares(first, second).ci.holds(0.04)
    assert 930 <= held <= 985


def test_holm_steps_down_and_leaves_out_what_has_no_p():
    assert holm([0.01, 0.04, 0.03, math.nan])[:3] == pytest.approx((0.03, 0.06, 0.06))
    assert math.isnan(holm([0.01, math.nan])[1])
    assert holm([0.9, 0.8]) == pytest.approx((1.0, 1.0))
