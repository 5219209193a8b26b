"""Planning times by N and f beside Table I, and re-planning."""

from pathlib import Path

import numpy as np
import pytest

from fras_experiments.results import paper
from fras_experiments.results.command import write_report
from fras_experiments.results.errors import BadResults
from fras_experiments.results.figures.planning import draw_planning
from fras_experiments.results.planning import BLOCKS, FRACTION, planning_of
from fras_experiments.results.reading import Results, read_results
from fras_experiments.results.summary import summary_lines
from support.campaigns import results_folder

IGNORE = "planner.ignore_ap"


def told(results: Results) -> str:
    return "\n".join(summary_lines(results, {}, seed=0))


def cells(text: str, begin: str) -> list[str]:
    line = next(line for line in text.splitlines() if line.startswith(begin))
    return [cell.strip() for cell in line.strip("|").split("|")]


@pytest.fixture
def planned(tmp_path: Path) -> Path:
    """Through the service t = f N^2 ms, of which clingo has half."""
    nothing = {"grasp_block": "", "grasp_x_m": "", "grasp_y_m": "", "lift_m": ""}
    points = [(n, f, s) for n in (5, 7, 10) for f in (0.1, 0.5) for s in range(2)]
    rows = [
        {**nothing, "seed": s, BLOCKS: n, FRACTION: f, "outcome": "planned", "reason": ""}
        for n, f, s in points
    ]
    times = [
        {
            "trial": i, "worker": 0,
            "plan_first_s": 0.5e-3 * f * n**2, "plan_service_s": 1e-3 * f * n**2,
        }
        for i, (n, f, _) in enumerate(points)
    ]  # fmt: skip
    return results_folder(tmp_path / "r", rows, swept=[BLOCKS, FRACTION], timing=times)


def test_first_plans_stand_beside_table_one(planned: Path):
    results = read_results(planned)
    text = told(results)
    assert cells(text, "| 7 | 4 |")[5:] == ["7.35", "1452", "99"]
    assert cells(text, "| 7 | 50 |") == [
        *("7", "50", "2", "24.50 [24.50, 24.50]", "24.50 ± 0.00", "24.50", "1410 ± 20", "58"),
    ]
    assert "- f = 10 %: t ∝ N^2.00" in text
    assert "the paper's t ∝ N^5.39" in text
    assert "nothing is retracted" in text
    assert "12 × planned" in text
    # Nothing was pulled: neither visibility nor scenario kinds are told.
    assert "By scenario kind" not in text
    assert "Beside the paper" not in text
    assert {path.stem for path in write_report(planned)} == {"planning", "summary"}


def test_the_figure_has_a_line_for_each_f(planned: Path):
    figure = draw_planning(read_results(planned), 0)
    assert figure is not None
    (axes,) = figure.axes
    lines = {str(line.get_label()).partition(":")[0]: line for line in axes.get_lines()}
    assert np.asarray(lines["f = 50 %"].get_ydata()) == pytest.approx([12.5, 24.5, 50.0])
    assert np.asarray(lines["paper's means"].get_ydata())[-1] == pytest.approx(10_750.0)


def test_planning_anew_is_told_by_scenario(tmp_path: Path):
    rows = [
        {
            "seed": s,
            BLOCKS: n,
            IGNORE: ignoring,
            "scenario_kind": "C" if ignoring == "true" else "B",
        }
        for n in (5, 10)
        for ignoring in ("false", "true")
        for s in range(2)
    ]
    times = [
        {
            "trial": i, "worker": 0, "plan_first_s": 0.002, "plan_service_s": 0.004,
            # A trial may do both.
            "replan_move_s": 0.003, "replan_release_s": 0.008,
        }
        for i in range(len(rows))
    ]  # fmt: skip
    folder = results_folder(
        tmp_path, rows, swept=[BLOCKS, IGNORE], timing=times, fixed=f"{FRACTION} = 0.5"
    )
    results = read_results(folder)
    planning = planning_of(results, seed=0)
    assert planning is not None
    for found, expected_s in ((planning.move, 0.003), (planning.release, 0.008)):
        (cell,) = found
        assert cell.fraction == 0.5
        assert {n: list(times) for n, times in cell.times_s.items()} == {
            5: [expected_s] * 4,
            10: [expected_s] * 4,
        }
    text = told(results)
    assert "| 10 | 50 | 4 | 3.00 [3.00, 3.00] | 3.00 ± 0.00 | 3.00 | 4950 ± 1050 | 1650 |" in text
    assert "| 10 | 50 | 4 | 8.00 [8.00, 8.00] | 8.00 ± 0.00 | 8.00 | 16000 ± 1430 | 2000 |" in text
    figure = draw_planning(results, 0)
    assert figure is not None
    assert len(figure.axes) == 2


def test_a_table_of_before_has_grounding_and_solving_alone(tmp_path: Path):
    times = [{"trial": 0, "worker": 0, "plan_first_s": 0.002}]
    folder = results_folder(tmp_path, [{}], timing=times)
    for name, columns in (("timing.csv", 3), ("trials.csv", 5)):
        # As it was before there were these columns, which are the last but the log's.
        lines = (folder / name).read_text().splitlines()
        last = 0 if name == "timing.csv" else 1
        cut = [line.split(",") for line in lines]
        kept = [",".join(one[: len(one) - columns + last] + one[len(one) - last :]) for one in cut]
        (folder / name).write_text("\n".join(kept) + "\n")
    planning = planning_of(read_results(folder), seed=0)
    assert planning is not None
    assert not planning.through_service
    assert list(planning.first_s[7]) == [0.002]
    assert "grounding and solving alone" in told(read_results(folder))


def test_a_fraction_that_is_no_number_is_named(tmp_path: Path):
    times = [{"trial": 0, "worker": 0, "plan_first_s": 0.002}]
    folder = results_folder(tmp_path, [{FRACTION: "half"}], swept=[FRACTION], timing=times)
    with pytest.raises(BadResults, match=r"attached_fraction: could not convert .*half"):
        planning_of(read_results(folder), seed=0)


def test_table_one_is_found_by_its_cell():
    found = paper.plan_at(9, 0.3)
    assert found is not None
    assert (found.mean, found.sd, found.n) == (5.70, 0.15, 25)
    assert paper.plan_at(9, 0.4) is None
    assert paper.plan_at(11, 0.3) is None
