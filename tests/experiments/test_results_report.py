"""`summary.md` and the figures: what is written is what the trials say."""

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.patches import Rectangle
from PIL import Image
from typer.testing import CliRunner

from fras_cli.app import app
from fras_common.files import write_whole
from fras_experiments.results import paper
from fras_experiments.results.beside_paper import beside_paper
from fras_experiments.results.command import write_report
from fras_experiments.results.errors import BadResults
from fras_experiments.results.figures import FIGURES
from fras_experiments.results.figures.distributions import draw_distributions
from fras_experiments.results.figures.force import bands, draw_force
from fras_experiments.results.figures.grasps import counted, draw_grasps
from fras_experiments.results.figures.limit import draw_limit, survivals
from fras_experiments.results.figures.planning import draw_planning
from fras_experiments.results.groups import by_kind, by_point
from fras_experiments.results.limits import pull_ends
from fras_experiments.results.planning import paper_growth, planning_of
from fras_experiments.results.reading import Results, read_results
from fras_experiments.results.summary import summary_lines
from support.campaigns import drawn_campaign, lifted, results_folder

MOST_BYTES = 200_000
RUNNER = CliRunner()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return drawn_campaign(tmp_path_factory.mktemp("drawn") / "a")


@pytest.fixture(scope="module")
def results(folder: Path) -> Results:
    return read_results(folder)


@pytest.fixture(scope="module")
def sized(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Planning times t = 0.4 ms N^2, three trials a size."""
    rows = [{"seed": s, "awareness.blocks": n} for n in (5, 7, 10) for s in range(3)]
    times = [
        {"trial": i, "worker": 0, "plan_first_s": 4e-4 * row["awareness.blocks"] ** 2}
        for i, row in enumerate(rows)
    ]
    where = tmp_path_factory.mktemp("sized")
    return read_results(results_folder(where, rows, swept=["awareness.blocks"], timing=times))


def told(results: Results) -> str:
    return "\n".join(summary_lines(results, {}, seed=0))


def row_of(text: str, label: str) -> list[str]:
    line = next(line for line in text.splitlines() if line.startswith(f"| {label} |"))
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_every_figure_is_written_and_small_enough(folder: Path):
    written = write_report(folder)
    assert {path.stem for path in written} == {*FIGURES, "summary"} - {"twin"}
    for path in written:
        assert 1_000 < path.stat().st_size < MOST_BYTES, path
    with Image.open(folder / "figures/force.png") as image:
        assert image.width >= 1000
    summary = (folder / "summary.md").read_text()
    for name in set(FIGURES) - {"twin"}:
        assert f"](figures/{name}.png)" in summary
    assert not [name for name in os.listdir(folder / "figures") if name.endswith(".new")]


def test_the_same_results_give_the_same_bytes(folder: Path):
    first = {path: path.read_bytes() for path in write_report(folder)}
    assert {path: path.read_bytes() for path in write_report(folder)} == first


def test_vector_figures_are_small_enough_and_the_same_again(folder: Path):
    names = ["limit", "force"]
    first = {path: path.read_bytes() for path in write_report(folder, names=names, kind="svg")}
    assert all(len(content) < MOST_BYTES for content in first.values())
    again = write_report(folder, names=names, kind="svg")
    assert {path: path.read_bytes() for path in again} == first


def test_a_summary_has_the_trials_numbers(results: Results):
    text, trials = told(results), results.trials
    for group in by_kind(trials):
        row, part = row_of(text, group.label), trials.where(group.chosen)
        assert row[1] == str(len(part))
        assert row[2].startswith(f"{int(part.success.sum())} of {len(part)}")
        assert row[3].startswith(f"{100 * part.visibility.mean():.2f} [")
        assert row[7] == f"{part.max_force_n.std(ddof=1):.3f}"
        assert row[9] == f"{part.max_force_n.max():.3f}"
        assert row[10].startswith(f"{int(part.crossed.sum())} of {len(part)}")
    heeded = trials.where(trials.swept["planner.ignore_ap"] == "false")
    assert row_of(text, "planner.ignore_ap = false")[1] == str(len(heeded))


def test_the_paper_stands_beside_it_and_a_difference_is_called_one(results: Results):
    rows = {row[0]: row for row in beside_paper(results, seed=0)}
    visible = rows["visibility at the end [%], A, B and C"]
    assert visible[1] == "96.89 ± 6.37 (n = 200)"
    assert visible[4] == "**ours is lower**"
    moved = rows["moved after a crossing (B), attachments heeded [%]"]
    assert moved[1].startswith("36 of 100")
    assert moved[2].startswith("37 of 100")
    assert "not told apart" in moved[4]
    released = rows["released and grasped anew (C), attachments ignored [%]"]
    assert released[4] == "**ours is higher**"
    assert not [name for name in rows if "without limit" in name]


def test_forces_without_limit_are_compared_only_where_there_was_none(tmp_path: Path):
    rows = [{"max_force_n": force} for force in (0.4, 1.4, 4.0)]
    free = read_results(results_folder(tmp_path, rows, fixed="awareness.no_limit = true"))
    found = {row[0]: row for row in beside_paper(free, seed=0)}
    assert set(found) == {"largest force without limit [N]", "peak of it [N]"}
    assert found["peak of it [N]"][1:3] == ("8.50", "4.00")


def test_the_papers_table_grows_as_it_says():
    assert paper.plan_s(7) == pytest.approx((1.50 + 1.48 + 1.41 + 1.42) / 4)
    assert paper.plan_s(11) is None
    assert paper_growth().exponent == pytest.approx(np.log(10.19 / 0.24) / np.log(2), abs=0.1)


def test_failed_and_lost_trials_are_told(tmp_path: Path):
    rows = [
        {},
        {"outcome": "no_plan", "reason": "no candidate", "scenario_kind": "", "visibility": ""},
        {"outcome": "aborted", "reason": "stack: sim died", "visibility": "", "complete": "false"},
    ]
    text = told(read_results(results_folder(tmp_path, rows)))
    assert "2 trials of scenario `default`, 2 seeds in 0..1." in text
    assert "- 1 × no_plan: no candidate" in text
    assert "**1 more trials are left out of all that follows**" in text
    assert "1 trials have no visibility" in text
    assert row_of(text, "no plan")[1] == "1"


def test_a_campaign_without_a_result_of_its_scenes_is_told(tmp_path: Path):
    rows = [{"outcome": "aborted", "reason": "worker: lost", "scenario_kind": ""}]
    folder = results_folder(tmp_path, rows)
    assert [path.name for path in write_report(folder)] == ["summary.md"]
    assert "No trial is a result of its scene" in (folder / "summary.md").read_text()


def test_points_of_a_sweep_are_told_as_they_were_designed(tmp_path: Path):
    cross = [{"a.x": x, "b.y": y} for x in (1, 2) for y in (1, 2)]
    trials = read_results(results_folder(tmp_path / "f", cross, swept=["a.x", "b.y"])).trials
    assert [group.label for group in by_point(trials)][3] == "a.x = 2, b.y = 2"
    single = [{"a.x": 1, "b.y": 1}, {"a.x": 2, "b.y": 1}, {"a.x": 1, "b.y": 3}]
    trials = read_results(results_folder(tmp_path / "o", single, swept=["a.x", "b.y"])).trials
    assert [group.label for group in by_point(trials)] == ["base", "a.x = 2", "b.y = 3"]
    # A case changes two fields, always together.
    cases = [{"a": 1, "b": 1, "c": 1}, {"a": 2, "b": 1, "c": 1}, {"a": 1, "b": 2, "c": 3}]
    trials = read_results(results_folder(tmp_path / "c", cases, swept=["a", "b", "c"])).trials
    assert [group.label for group in by_point(trials)] == ["base", "a = 2", "b = 2, c = 3"]
    drawn = [{"a.x": i / 100, "b.y": "lex" if i % 2 else "sum"} for i in range(80)]
    trials = read_results(results_folder(tmp_path / "s", drawn, swept=["a.x", "b.y"])).trials
    groups = by_point(trials)
    assert [int(group.chosen.sum()) for group in groups] == [20, 20, 20, 20, 40, 40]
    assert by_point(trials.where(trials.trial == "0")) == ()


def test_distributions_show_each_trial_once(results: Results):
    figure = draw_distributions(results, 0)
    assert figure is not None
    left, right = figure.axes
    trials = results.trials
    for place, kind in enumerate(("A", "B", "C")):
        mine = trials.where(trials.kind == kind)
        assert np.asarray(left.collections[2 * place].get_offsets())[:, 1] == pytest.approx(
            100 * mine.visibility
        )
        assert np.asarray(right.collections[2 * place].get_offsets())[:, 1] == pytest.approx(
            mine.max_force_n
        )
    labels = [label.get_text() for label in left.get_xticklabels()]
    assert labels[0] == f"A\nn = {(trials.kind == 'A').sum()}"
    assert "[%]" in left.get_ylabel()
    assert "[N]" in right.get_ylabel()


def test_forces_are_drawn_pull_by_pull(results: Results):
    figure = draw_force(results, 0)
    assert figure is not None
    assert [axes.get_title("left")[0] for axes in figure.axes] == ["A", "B", "C"]
    kinds = dict(zip(results.trials.trial, results.trials.kind, strict=True))
    for axes in figure.axes:
        kind = axes.get_title("left")[0]
        (lines,) = (one for one in axes.collections[:1] if isinstance(one, LineCollection))
        drawn = lines.get_segments()
        mine = [pull for pull in results.pulls if kinds[pull.trial] == kind]
        for one in axes.collections[1:]:
            drawn += one.get_segments() if isinstance(one, LineCollection) else []
        assert len(drawn) == len(mine)
        assert sum(len(line) for line in drawn) == sum(pull.height_m.size for pull in mine)
        assert "[mm]" in axes.get_xlabel()


def test_a_stopped_pull_counts_as_at_the_limit_above(tmp_path: Path):
    series = {0: lifted(20.0), 1: lifted(30.0), 2: lifted(6.0)}
    rows = [{"crossings": 1}, {"crossings": 1}, {}]
    ends = pull_ends(read_results(results_folder(tmp_path, rows, series=series)))
    height_m, low, middle, high = bands(ends)
    at = {round(1e3 * height): i for i, height in enumerate(height_m)}
    assert middle[at[10]] == pytest.approx(0.2)
    # Two of three are at the limit, and one goes on below it.
    assert np.isnan(middle[at[40]])
    assert high[at[40]] == 0.5
    assert low[at[40]] == pytest.approx((0.24 + 0.5) / 2)


def test_the_last_pull_crossed_where_the_tip_stopped(tmp_path: Path):
    series = {0: lifted(20.0) + lifted(30.0, begin=1000), 1: lifted(20.0, limit_n=None)}
    rows = [{"crossings": 2, "lift_m": 0.0172}, {"crossings": 1, "lift_m": 0.0254}]
    first, last, sampled = pull_ends(read_results(results_folder(tmp_path, rows, series=series)))
    assert [first.height_m, last.height_m] == pytest.approx([0.024, 0.0172])
    assert sampled.height_m == pytest.approx(0.025)


def test_grasps_are_drawn_where_they_lie(results: Results):
    figure = draw_grasps(results, 0)
    assert figure is not None
    left, right = figure.axes
    trials = results.trials
    seen = np.concatenate([np.asarray(one.get_offsets()) for one in right.collections])
    x_mm = 1e3 * (trials.grasp_x_m - trials.roi_x_m)
    assert sorted(seen[:, 0]) == pytest.approx(sorted(x_mm))
    marks = [one for one in left.collections[1:] if isinstance(one, PathCollection)]
    sizes = sum(float(one.get_sizes()[0]) for one in marks)
    assert sizes == pytest.approx(14.0 * len(trials))
    outline = left.patches[0]
    assert isinstance(outline, Rectangle)
    assert list(outline.get_bbox().extents) == pytest.approx([0, 0, 100, 120])
    assert counted(np.array([1.0, 1.01, 2.0]), np.zeros(3)) == {(1.0, 0.0): 2, (2.0, 0.0): 1}


def test_survival_is_drawn_as_it_was_estimated(results: Results):
    curves = survivals(results)
    ignored, _ = curves["first pulls, attachments ignored"]
    trials = results.trials
    chosen = trials.swept["planner.ignore_ap"] == "true"
    assert (ignored.events, ignored.n) == (int(trials.crossed[chosen].sum()), 100)
    figure = draw_limit(results, 0)
    assert figure is not None
    lines = {str(line.get_label()): line for line in figure.axes[0].get_lines()}
    line = lines[f"first pulls, attachments ignored: {ignored.events} of 100 crossed"]
    assert np.asarray(line.get_ydata())[1:] == pytest.approx(100 * ignored.share)
    assert np.asarray(line.get_ydata())[-1] == pytest.approx(100 - ignored.events)


def test_planning_is_drawn_with_its_law(sized: Results):
    planning = planning_of(sized, seed=0)
    assert planning is not None
    assert planning.growth is not None
    assert planning.growth.exponent == pytest.approx(2.0)
    figure = draw_planning(sized, 0)
    assert figure is not None
    lines = {str(line.get_label()): line for line in figure.axes[0].get_lines()}
    assert np.asarray(lines["ours, median"].get_ydata()) == pytest.approx([10.0, 19.6, 40.0])
    assert any(label.startswith("ours: t ∝ N^2.00 [2.00, 2.00]") for label in lines)
    text = told(sized)
    assert row_of(text, "7")[5:] == ["1452", "74"]
    assert "The paper's Table I: t ∝ N^5.39" in text


def test_what_a_campaign_lacks_is_not_drawn_and_an_old_figure_goes(tmp_path: Path):
    folder = results_folder(tmp_path, [{"grasp_x_m": "", "grasp_y_m": "", "grasp_block": ""}])
    old = folder / "figures/force.png"
    write_whole(old, b"of another campaign")
    written = write_report(folder)
    assert {path.stem for path in written} == {"distributions", "summary"}
    assert not old.exists()


def test_what_can_not_be_written_leaves_what_was_there(tmp_path: Path, monkeypatch):
    path = tmp_path / "summary.md"
    write_whole(path, b"before")

    def full(self: Path, content: bytes) -> int:
        raise OSError(28, "No space left on device", str(self))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        write_whole(path, b"after")
    assert path.read_text() == "before"
    assert os.listdir(tmp_path) == ["summary.md"]


def test_names_and_formats_that_do_not_exist_are_refused(folder: Path):
    with pytest.raises(BadResults, match="no figure 'pie': there are distributions"):
        write_report(folder, names=["pie"])
    with pytest.raises(BadResults, match="no format 'gif': there are png"):
        write_report(folder, kind="gif")


def test_the_commands_write_print_and_refuse(folder: Path, tmp_path: Path):
    one = RUNNER.invoke(app, ["experiment", "report", str(folder), "--figure", "limit"])
    assert (one.exit_code, one.stdout.strip()) == (0, str(folder / "figures/limit.png"))
    where = ["--where-a", "planner.ignore_ap=false", "--where-b", "planner.ignore_ap=true"]
    both = ["experiment", "compare", str(folder), str(folder), *where]
    picture = tmp_path / "c.png"
    table = RUNNER.invoke(app, [*both, "--out", str(picture)])
    assert table.exit_code == 0
    assert "100 pairs" in table.stdout
    assert Image.open(io.BytesIO(picture.read_bytes())).width > 800
    assert picture.stat().st_size < MOST_BYTES
    assert RUNNER.invoke(app, [*both, "--json"]).stdout.startswith("{")
    for asked, why in (
        ([*both, "--where", "planner.ignore_ap"], "is no FIELD=VALUE"),
        ([*both, "--out", str(tmp_path / "c.gif")], "no format 'gif'"),
        (["experiment", "report", str(tmp_path)], "is no folder that `fras experiment` wrote"),
        (["experiment", "compare", str(tmp_path / "none"), str(folder)], "no such folder"),
    ):
        refused = RUNNER.invoke(app, asked)
        assert refused.exit_code == 2
        assert why in refused.stderr


def test_the_help_loads_neither_scipy_nor_matplotlib():
    code = (
        "import sys\nfrom typer.testing import CliRunner\nfrom fras_cli.app import app\n"
        "done = CliRunner().invoke(app, ['experiment', '--help'])\n"
        "assert 'compare' in done.stdout, done.stdout\n"
        "print(*sorted({'scipy', 'matplotlib', 'numpy', 'PIL'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == ""


def test_a_campaigns_name_stands_beside_the_commands():
    for words, said in (
        (["--list"], "retraction"),
        (["run", "--list"], "retraction"),
        (["no-such"], "no-such"),
        (["report", "no-such"], "no-such"),
        (["--help"], "compare"),
        (["run", "--help"], "--scheduler"),
    ):
        done = RUNNER.invoke(app, ["experiment", *words])
        assert said in done.output + str(done.exception), words


def test_one_campaign_in_two_folders_is_told_apart_by_them(tmp_path: Path) -> None:
    usual, edge = (results_folder(tmp_path / name, [{"seed": 1}, {"seed": 2}]) for name in "ab")
    done = RUNNER.invoke(app, ["experiment", "compare", str(usual), str(edge), "--json"])
    assert done.exit_code == 0
    told = json.loads(done.stdout)
    assert (told["a"], told["b"]) == (f"made-up in {usual}", f"made-up in {edge}")
