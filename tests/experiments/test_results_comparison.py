"""Two campaigns paired, compared and told."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.patches import Rectangle
from rich.console import Console

from fras_experiments.results.comparison import SHARES, chosen, compare, pair
from fras_experiments.results.comparison_told import as_plain, comparison_table, footnotes
from fras_experiments.results.errors import BadResults
from fras_experiments.results.figures.comparison import draw_comparison
from fras_experiments.results.reading import read_results
from fras_experiments.results.trials import Trials
from support.campaigns import drawn_campaign, results_folder


def trials(folder: Path, rows, *, swept=()) -> Trials:
    return read_results(results_folder(folder, rows, swept=swept)).trials


def test_pairs_are_made_by_scenario_and_seed_in_any_order(tmp_path: Path):
    first = trials(
        tmp_path / "a",
        [{"seed": seed, "visibility": seed / 100} for seed in (10, 9, 3)]
        + [{"scenario": "b", "seed": 9, "visibility": 0.99}],
    )
    second = trials(
        tmp_path / "b",
        [{"scenario": "b", "seed": 9, "visibility": 0.89}]
        + [{"seed": seed, "visibility": seed / 200} for seed in (9, 4, 10)],
    )
    pairs = pair(first, second)
    assert pairs.by == ("scenario", "seed")
    assert pairs.first.scenario.tolist() == pairs.second.scenario.tolist()
    assert pairs.first.seed.tolist() == pairs.second.seed.tolist() == [9, 9, 10]
    assert pairs.first.visibility.tolist() == [0.99, 0.09, 0.1]
    assert pairs.second.visibility.tolist() == [0.89, 0.045, 0.05]
    assert (pairs.first_alone, pairs.second_alone) == (1, 1)


@given(st.permutations(range(8)), st.permutations(range(8)))
@settings(max_examples=25, deadline=None)
def test_the_order_of_rows_is_of_no_matter(whole: Trials, ours: list[int], others: list[int]):
    worse = whole.taken(np.array(others))
    shuffled = compare(whole.taken(np.array(ours)), worse, seed=0)
    straight = compare(whole, whole, seed=0)
    assert shuffled.pairs.first.trial.tolist() == straight.pairs.first.trial.tolist()
    assert shuffled.numbers == straight.numbers
    assert shuffled.shares == straight.shares
    assert all(one.mean_difference == 0.0 for one in shuffled.numbers.values())


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Trials:
    rows = [{"visibility": 0.9 + seed / 100, "max_force_n": 0.1 * seed} for seed in range(8)]
    return trials(tmp_path_factory.mktemp("whole"), rows)


def test_a_swept_field_joins_where_a_seed_has_several_trials(tmp_path: Path):
    rows = [
        {"seed": seed, "planner.criterion": name} for seed in range(3) for name in ("sum", "lex")
    ]
    first = trials(tmp_path / "a", rows, swept=["planner.criterion"])
    second = trials(tmp_path / "b", rows[::-1], swept=["planner.criterion"])
    pairs = pair(first, second)
    assert pairs.by == ("scenario", "seed", "planner.criterion")
    assert (
        pairs.first.swept["planner.criterion"].tolist()
        == pairs.second.swept["planner.criterion"].tolist()
    )
    assert len(pairs.first) == 6
    # One point of each: the same campaign against itself, by seed alone.
    within = pair(
        chosen(first, {"planner.criterion": "sum"}), chosen(first, {"planner.criterion": "lex"})
    )
    assert within.by == ("scenario", "seed")
    assert len(within.first) == 3
    assert "share a scene" in footnotes(compare(first, second, seed=0))


def test_two_values_of_a_field_are_paired_by_the_other_fields(tmp_path: Path):
    names = ("twin.stiffness", "twin.shift")
    cross = [dict(zip(names, (a, b), strict=True)) for a in "12" for b in "345"]
    rows = [{"seed": seed, **point} for seed in range(2) for point in cross]
    whole = trials(tmp_path, rows, swept=names)
    soft, stiff = (chosen(whole, {"twin.stiffness": value}) for value in "12")
    pairs = pair(soft, stiff)
    assert pairs.by == ("scenario", "seed", "twin.shift")
    assert len(pairs.first) == 6
    assert pairs.first.swept["twin.shift"].tolist() == pairs.second.swept["twin.shift"].tolist()


def test_what_can_not_be_paired_is_named(tmp_path: Path):
    first = trials(tmp_path / "a", [{"seed": 1}, {"seed": 2}])
    with pytest.raises(BadResults, match=r"no scenario and seed in common.*seeds 1 to 2.*7 to 7"):
        compare(first, trials(tmp_path / "b", [{"seed": 7}]), seed=0)
    with pytest.raises(BadResults, match="no scenario and seed in common"):
        compare(first, trials(tmp_path / "c", [{"seed": 1, "scenario": "slab"}]), seed=0)
    with pytest.raises(BadResults, match=r"has no trial"):
        compare(first, first.where(np.zeros(2, dtype=bool)), seed=0)
    rows = [{"seed": 1, "x.y": "1"}, {"seed": 1, "x.y": "2"}]
    twice = trials(tmp_path / "d", rows, swept=["x.y"])
    with pytest.raises(BadResults, match=r"seed 1 is that of 2 trials \(0, 1\).*x\.y.*--where"):
        compare(first, twice, seed=0)
    with pytest.raises(BadResults, match=r"does not sweep 'x\.z': it sweeps x\.y"):
        chosen(twice, {"x.z": "1"})
    with pytest.raises(BadResults, match=r"x\.y is never '3'; it is one of 1, 2"):
        chosen(twice, {"x.y": "3"})


def test_a_comparison_finds_what_was_made(tmp_path: Path):
    first = read_results(drawn_campaign(tmp_path / "a")).trials
    second = read_results(drawn_campaign(tmp_path / "b", seed=2, better=0.3)).trials
    found = compare(
        chosen(first, {"planner.ignore_ap": "true"}),
        chosen(second, {"planner.ignore_ap": "true"}),
        seed=0,
    )
    crossed = found.shares["crossed"]
    assert crossed.lost > crossed.gained == 0
    assert found.adjusted_p["crossed"] < 0.001
    assert found.numbers["max_force_n"].mean_ci.high < 0.0
    assert found.numbers["ticks"].mean_difference == 0.0
    assert all(found.adjusted_p[name] >= one.p for name, one in found.numbers.items())


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("pair")
    ours = [
        {"visibility": 0.5, "max_force_n": 0.4, "outcome": "failed"},
        {"visibility": 0.9, "max_force_n": 0.4},
        {"visibility": "", "max_force_n": 0.4},
        {"visibility": 0.8, "max_force_n": ""},
    ]
    others = [
        {"visibility": 0.7, "max_force_n": 0.3},
        {"visibility": 0.9, "max_force_n": 0.5},
        {"visibility": 1.0, "max_force_n": 0.4},
        {"visibility": 0.6, "max_force_n": 0.2, "outcome": "failed"},
    ]
    return compare(trials(folder / "a", ours), trials(folder / "b", others), seed=0)


def test_the_table_fits_a_terminal_and_shows_the_numbers(comparison):
    console = Console(width=80, record=True, file=None, quiet=False)
    with console.capture() as captured:
        console.print(comparison_table(comparison, "first [a]", "second"))
    told = captured.get()
    assert "first [a]" in told
    assert "ticks above limit" in told
    assert "Pairs without a value: visibility [%] 1, force [N] 1." in footnotes(comparison)
    assert "…" not in told
    row = next(line for line in told.splitlines() if SHARES["success"] in line)
    assert row.split()[2:5] == ["75.0", "75.0", "0.0"]
    assert "+1 -1" in row


def test_json_has_no_nan_and_keeps_the_numbers(comparison):
    plain = as_plain(comparison, "x", "y", 0)
    again = json.loads(json.dumps(plain, allow_nan=False))
    assert again["pairs"] == 4
    assert again["shares"]["success"]["gained"] == 1
    assert again["numbers"]["visibility"]["missing"] == 1
    assert again["numbers"]["visibility"]["mean_difference"] == pytest.approx(0.0)


def test_the_figure_has_each_pair_on_the_side_where_it_lies(comparison):
    figure = draw_comparison(comparison, "x", "y")
    left, middle, right = figure.axes
    higher, lower, equal = (points.get_offsets() for points in left.collections)
    assert np.asarray(higher).tolist() == [[50.0, 70.0]]
    assert np.asarray(lower).tolist() == [[80.0, 60.0]]
    assert np.asarray(equal).tolist() == [[90.0, 90.0]]
    assert sum(len(np.asarray(points.get_offsets())) for points in middle.collections) == 3
    assert [bar.get_width() for bar in right.patches if isinstance(bar, Rectangle)] == [2, 1, 1, 0]
    assert "[%]" in left.get_xlabel()
    assert "[N]" in middle.get_ylabel()
