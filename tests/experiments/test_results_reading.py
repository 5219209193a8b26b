"""Results folders, whole and damaged."""

from pathlib import Path

import numpy as np
import pytest

from fras_experiments.results.cells import parse_cells
from fras_experiments.results.errors import BadResults
from fras_experiments.results.pulls import Series, endurance, on_grid, pulls_of
from fras_experiments.results.reading import read_results
from support.campaigns import lifted, results_folder


def test_a_folder_is_read_as_it_was_written(tmp_path: Path):
    rows = [
        {"seed": 7, "planner.ignore_ap": "false", "visibility": 0.9, "complete": "false"},
        {"seed": 7, "planner.ignore_ap": "true", "outcome": "failed", "visibility": ""},
    ]
    times = {"trial": 1, "worker": 3, "wall_s": 2.5, "cpu_s": 4, "plan_first_s": 0.002}
    results = read_results(
        results_folder(
            tmp_path, rows, swept=["planner.ignore_ap"], series={0: lifted(6.0)}, timing=[times],
            fixed='awareness.blocks = 9',
        )
    )  # fmt: skip
    trials = results.trials
    assert trials.campaign == "made-up"
    assert trials.seed.tolist() == [7, 7]
    assert trials.swept["planner.ignore_ap"].tolist() == ["false", "true"]
    assert trials.success.tolist() == [True, False]
    assert trials.complete.tolist() == [False, True]
    assert trials.visibility[0] == 0.9
    assert np.isnan(trials.visibility[1])
    assert results.timing is not None
    assert np.isnan(results.timing.of(trials, "wall_s")[0])
    assert results.timing.of(trials, "wall_s")[1] == 2.5
    assert results.settings("planner.ignore_ap", "false").tolist() == ["false", "true"]
    assert results.settings("awareness.blocks", "7").tolist() == ["9", "9"]
    assert results.settings("awareness.no_limit", "false").tolist() == ["false", "false"]
    assert [(pull.trial, pull.number) for pull in results.pulls] == [("0", 0)]


def test_the_base_scenario_says_what_the_campaign_does_not(tmp_path: Path):
    folder = results_folder(tmp_path, [{}])
    (folder / "base.toml").write_text("awareness.no_limit = true\ntissue.size_m = [1, 2, 3]\n")
    results = read_results(folder)
    assert not results.stopped.any()
    assert results.fixed("tissue.size_m") == [1, 2, 3]


def test_trials_whose_stack_or_worker_died_are_apart(tmp_path: Path):
    rows = [
        {},
        {"outcome": "aborted", "reason": "stack: sim died", "visibility": "", "scenario_kind": ""},
        {"outcome": "aborted", "reason": "worker: lost", "visibility": "", "scenario_kind": ""},
        {"outcome": "aborted", "reason": "hold:solver"},
    ]
    results = read_results(results_folder(tmp_path, rows))
    assert results.trials.trial.tolist() == ["0", "3"]
    assert results.lost.trial.tolist() == ["1", "2"]


def damaged(folder: Path, name: str, old: str, new: str) -> Path:
    path = folder / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    rows = [{"visibility": 0.25}, {"visibility": 0.75, "grasp_block": "b(2,2)"}]
    times = [{"trial": 0, "worker": 0, "wall_s": 1.25}]
    return results_folder(tmp_path / "r", rows, series={0: lifted(6.0)}, timing=times)


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        ("trials.csv", "visibility,", "sight,", r"trials\.csv, line 1: no column visibility"),
        ("trials.csv", "plans,", "replans,", r"line 1: no column plans"),
        ("trials.csv", "log", "ticks", r"line 1: column ticks stands there twice"),
        (
            "trials.csv",
            "0.75",
            "NaN",
            r"trials\.csv, line 3, column visibility: 'NaN' is not a",
        ),
        ("trials.csv", "0.75", "inf", r"line 3, column visibility: 'inf'"),
        ("trials.csv", "0.75", "high", r"line 3, column visibility: 'high' is not a"),
        ("trials.csv", "0.75", "1.75", r"line 3, column visibility: '1\.75' is not a share"),
        ("trials.csv", "0.75", "-0.1", r"line 3, column visibility: '-0\.1' is not a share"),
        ("trials.csv", "0.75,", "", r"trials\.csv, line 3: 28 cells, where the header has 29"),
        (
            "trials.csv",
            "made-up,1,",
            "other,1,",
            r"line 3, column campaign: 'other' beside",
        ),
        ("trials.csv", "made-up,1,", "made-up,0,", r"lines 2 and 3, column trial: '0' twice"),
        (
            "trials.csv",
            "made-up,1,",
            "made-up,../1,",
            r"line 3, column trial: '\.\./1' is not",
        ),
        ("trials.csv", "default,1,", "default,one,", r"line 3, column seed: 'one' is not a whole"),
        (
            "trials.csv",
            "default,1,",
            f"default,{2**70},",
            r"line 3, column seed: '\d+' is not",
        ),
        ("trials.csv", "visible,A,true", "visible,D,true", r"line 2, column scenario_kind: 'D'"),
        (
            "trials.csv",
            "visible,A,true",
            "visible,A,maybe",
            r"column complete: 'maybe' is not",
        ),
        ("trials.csv", '"b(2,2)"', '"b(2,2', r"trials\.csv, line \d+: no CSV"),
        ("timing.csv", "1.25", "soon", r"timing\.csv, line 2, column wall_s: 'soon'"),
        (
            "timing.csv",
            "1.25",
            "-1",
            r"timing\.csv, line 2, column wall_s: '-1' is not zero",
        ),
        ("timing.csv", "\n0,", "\n9,", r"timing\.csv, line 2, column trial: '9' is not a trial of"),
        ("series/0.csv", "105,", "100,", r"0\.csv, line 3, column tick: '100' is not after 100"),
        (
            "series/0.csv",
            "105,0.002",
            "105,",
            r"0\.csv, line 3, column height_m: '' is not",
        ),
        ("campaign.toml", "[campaign]", "[campaign", r"campaign\.toml: no TOML"),
    ],
)
def test_a_fault_is_named_with_its_place(folder: Path, name: str, old: str, new: str, told: str):
    with pytest.raises(BadResults, match=told):
        read_results(damaged(folder, name, old, new))


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "line 1: empty"),
        (b"\n", "line 1: empty"),
        (b"\xff\xfe\x00", "no UTF-8 text at byte 0"),
        (b"a,b\n", "no column campaign"),
    ],
)
def test_an_empty_or_foreign_table_is_named(folder: Path, content: bytes, told: str):
    (folder / "trials.csv").write_bytes(content)
    with pytest.raises(BadResults, match=told):
        read_results(folder)


def test_a_header_alone_and_a_folder_of_something_else_are_named(folder: Path):
    header = (folder / "trials.csv").read_text().splitlines()[0]
    (folder / "trials.csv").write_text(header + "\n")
    with pytest.raises(BadResults, match="no trial has ended yet"):
        read_results(folder)
    (folder / "trials.csv").unlink()
    with pytest.raises(BadResults, match=r"trials\.csv: no such file"):
        read_results(folder)
    (folder / "campaign.toml").unlink()
    with pytest.raises(BadResults, match="is no folder that `fras experiment` wrote"):
        read_results(folder)
    with pytest.raises(BadResults, match="no such folder"):
        read_results(folder / "none")


def test_a_byte_order_mark_spaces_and_blank_lines_do_not_matter():
    cells = parse_cells("a , b\n 1 ,x\n\n2,\n", Path("t.csv"), ["a", "b"])
    assert cells.names == ("a", "b")
    assert cells.numbers("a").tolist() == [1.0, 2.0]
    assert cells.texts("b").tolist() == ["x", ""]
    assert cells.lines == (2, 4)


def series_of(points) -> Series:
    tick, height, force, seen = (np.array(column) for column in zip(*points, strict=True))
    return Series(tick, height, force, seen)


def test_a_series_is_cut_at_its_gaps_and_at_the_greatest_height():
    down = [(230, 0.04, 0.1, 1.0), (235, 0.03, 0.1, 1.0)]
    points = lifted(6.0) + down + lifted(3.0, begin=1000)
    first, second = pulls_of("4", series_of(points))
    assert (first.number, second.number) == (0, 1)
    assert first.height_m[-1] == pytest.approx(0.05)
    assert second.force_n[-1] == pytest.approx(0.15)
    assert pulls_of("4", Series(*(np.array([]) for _ in range(4)))) == ()


def test_a_crossing_lies_where_the_force_passes_the_limit():
    pulls = pulls_of("0", series_of(lifted(20.0, limit_n=None)))
    ends = endurance(pulls, 0.5, 1, stopped=False)
    assert ends.crossed.tolist() == [True]
    assert ends.height_m[0] == pytest.approx(0.025)


def test_a_pull_that_was_stopped_between_two_samples_crossed():
    pulls = pulls_of("0", series_of(lifted(20.0) + lifted(6.0, begin=1000)))
    ends = endurance(pulls, 0.5, 1, stopped=True)
    assert ends.crossed.tolist() == [True, False]
    assert ends.height_m.tolist() == pytest.approx([0.024, 0.05])
    assert endurance(pulls, 0.5, 0, stopped=True).crossed.tolist() == [False, False]
    # Where nothing stops a pull, one without a sample above the limit did not cross it.
    assert endurance(pulls, 0.5, 1, stopped=False).crossed.tolist() == [False, False]
    assert endurance(pulls, 0.5, 5, stopped=True).crossed.tolist() == [True, True]
    assert endurance((), 0.5, 1, stopped=True).height_m.size == 0


def test_forces_on_a_grid_are_interpolated_and_never_extrapolated():
    pulls = pulls_of("0", series_of(lifted(20.0)))
    force = on_grid(pulls, np.array([0.0, 0.001, 0.024, 0.03]))
    assert force[0, :3] == pytest.approx([0.0, 0.02, 0.48])
    assert np.isnan(force[0, 3])
    assert on_grid((), np.array([0.0, 0.1])).shape == (0, 2)
