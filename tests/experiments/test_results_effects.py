"""What a sweep's points change: differences over the same scenes, and the figures of them."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.container import ErrorbarContainer

from fras_experiments.results.effects import sweep_effects
from fras_experiments.results.figures.effects import MOVED, SAME, draw_effects
from fras_experiments.results.figures.tradeoff import draw_tradeoff
from fras_experiments.results.reading import Results, read_results
from support.campaigns import results_folder

FIELD, OTHER = "planner.criterion", "awareness.force_limit_n"
SEEN = {"weighted": 0.90, "capped": 0.99, "sum": 0.90}
FORCE_N = {"weighted": 0.30, "capped": 0.45, "sum": 0.30}


@pytest.fixture
def results(tmp_path: Path) -> Results:
    """Twelve scenes: `capped` sees nine points more, and reaches the limit in all but one."""
    rows = [
        {
            "seed": s, FIELD: name, "visibility": SEEN[name] + 0.001 * (s % 3),
            "max_force_n": FORCE_N[name] + 0.01 * s, "crossings": int(name == "capped" and s > 0),
        }
        for s in range(12)
        for name in SEEN
    ]  # fmt: skip
    return read_results(results_folder(tmp_path, rows, swept=[FIELD]))


def test_a_point_is_compared_with_the_first_over_the_same_scenes(results: Results):
    base, effects = sweep_effects(results.trials, 0)
    assert base == f"{FIELD} = weighted"
    capped, summed = effects
    assert capped.label == f"{FIELD} = capped"
    assert capped.visibility.n == 12
    assert capped.visibility.mean_difference == pytest.approx(9.0)
    assert capped.force.mean_difference == pytest.approx(0.15)
    assert (capped.crossed.gained, capped.crossed.lost) == (11, 0)
    assert summed.visibility.mean_difference == summed.force.mean_difference == 0.0


def test_only_what_moves_is_in_colour(results: Results):
    figure = draw_effects(results, 0)
    assert figure is not None
    assert "weighted" in figure.get_suptitle()
    for axes in figure.axes:
        drawn = [one for one in axes.containers if isinstance(one, ErrorbarContainer)]
        assert [one.lines[0].get_color() for one in drawn] == [MOVED, SAME]
    assert [tick.get_text() for tick in figure.axes[0].get_yticklabels()] == [
        f"{FIELD} = capped", f"{FIELD} = sum",
    ]  # fmt: skip


def test_a_tradeoff_has_a_mark_for_each_point_where_its_numbers_are(results: Results):
    figure = draw_tradeoff(results, 0)
    assert figure is not None
    left, right = figure.axes
    marks = [one for one in left.containers if isinstance(one, ErrorbarContainer)]
    assert [one.get_label() for one in marks] == list(SEEN)
    assert np.ravel(marks[1].lines[0].get_xydata()) == pytest.approx([100 * 11 / 12, 99.1])
    below = [one for one in right.containers if isinstance(one, ErrorbarContainer)]
    assert [np.ravel(one.lines[0].get_ydata())[0] for one in below] == [100.0, 0.0, 100.0]


def test_without_scenes_in_common_nothing_is_compared(tmp_path: Path):
    apart = [{"seed": s, FIELD: name} for s, name in enumerate(["a", "a", "a", "b", "b", "b"])]
    results = read_results(results_folder(tmp_path / "apart", apart, swept=[FIELD]))
    assert draw_effects(results, 0) is None
    still = read_results(results_folder(tmp_path / "still", [{}, {}]))
    assert draw_effects(still, 0) is None
    assert draw_tradeoff(still, 0) is None


def test_sampled_fields_have_no_base(tmp_path: Path):
    rows = [{"seed": s % 4, OTHER: 0.3 + 0.001 * s} for s in range(60)]
    results = read_results(results_folder(tmp_path, rows, swept=[OTHER]))
    assert sweep_effects(results.trials, 0) == ("", ())


def test_of_one_field_at_a_time_each_is_told_alone(tmp_path: Path):
    points = [("weighted", "0.5"), ("capped", "0.5"), ("weighted", "0.3")]
    rows = [{"seed": s, FIELD: one, OTHER: two} for s in range(4) for one, two in points]
    results = read_results(results_folder(tmp_path, rows, swept=[FIELD, OTHER]))
    base, effects = sweep_effects(results.trials, 0)
    assert base == "base"
    assert [one.label for one in effects] == [f"{FIELD} = capped", f"{OTHER} = 0.3"]
