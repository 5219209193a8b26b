"""How wrong a model may be: what `fras experiment report` says of trials with a patient."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.container import ErrorbarContainer

from fras_experiments.results.command import write_report
from fras_experiments.results.errors import BadResults
from fras_experiments.results.figures.twin import draw_twin
from fras_experiments.results.model_error import SHIFT, STIFFNESS, model_error
from fras_experiments.results.reading import Results, read_results
from fras_experiments.results.summary import summary_lines
from support.campaigns import results_folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """At each point four scenes: a stiffer patient bears as much more, and one scene is missed."""
    rows = [
        {
            "seed": s, STIFFNESS: factor, SHIFT: shift, "max_force_n": 0.4,
            "patient_max_force_n": 0.4 * factor, "patient_above_ticks": 9, "needless_ticks": 0,
            "missed_ticks": 9 if factor > 1.0 and s == 0 else 0,
        }
        for factor in (1.0, 2.0)
        for shift in (0.0, 0.005)
        for s in range(4)
    ]  # fmt: skip
    return results_folder(tmp_path / "r", rows, swept=[STIFFNESS, SHIFT])


@pytest.fixture
def results(folder: Path) -> Results:
    return read_results(folder)


def test_a_point_has_its_share_and_its_ratio(results: Results):
    text = "\n".join(summary_lines(results, {}, seed=0))
    assert "## Model error" in text
    section = text[text.index("## Model error") :].splitlines()
    label = "| patient.young_modulus_factor = 2.0, patient.disc_shift_m = 0.005 |"
    row = next(line for line in section if line.startswith(label))
    told = [cell.strip() for cell in row.strip("|").split("|")][1:]
    assert told == [
        "4", "1 of 4, 25.0 % [4.6, 69.9]", "4 of 4, 100.0 % [51.0, 100.0]", "2.00 [2.00, 2.00]",
        "2.00", "2.00", "0.800", "0.800",
    ]  # fmt: skip
    every = next(line for line in section if line.startswith("| all |"))
    assert "2 of 16, 12.5 %" in every


def test_a_crossing_that_the_model_told_is_not_unnoticed(tmp_path: Path):
    rows = [
        {"patient_max_force_n": 1.3, "max_force_n": 0.52, "missed_ticks": 25},
        {"patient_max_force_n": 0.6, "max_force_n": 0.49, "missed_ticks": 3},
        {"patient_max_force_n": 0.2, "max_force_n": 0, "missed_ticks": 0},
        {},
    ]
    error = model_error(read_results(results_folder(tmp_path, rows)).trials, 0)
    assert error is not None
    assert (error.missed.count, error.unnoticed.count, error.missed.n) == (2, 1, 3)
    # Nothing was believed, so that there is no ratio.
    assert error.ratio == pytest.approx([2.5, 0.6 / 0.49])


def test_the_figure_has_a_line_for_each_shift(results: Results):
    figure = draw_twin(results, 0)
    assert figure is not None
    left, right = figure.axes
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["attachments 0 mm off", "attachments 5 mm off"]
    lines = [one for one in right.get_lines() if str(one.get_label()).startswith("attach")]
    assert [list(np.asarray(one.get_ydata())) for one in lines] == [[1.0, 2.0]] * 2
    bars = [bar.lines[0] for bar in left.containers if isinstance(bar, ErrorbarContainer)]
    assert [list(np.asarray(one.get_ydata())) for one in bars] == [[0.0, 25.0]] * 2


def test_without_a_patient_nothing_is_said_of_it(tmp_path: Path):
    plain = results_folder(tmp_path, [{}])
    assert "twin" not in {path.stem for path in write_report(plain)}
    assert "Model error" not in (plain / "summary.md").read_text()


def test_what_is_no_number_is_named(tmp_path: Path):
    rows = [{STIFFNESS: "soft", "patient_max_force_n": 0.3, "missed_ticks": 0}]
    bad = read_results(results_folder(tmp_path, rows, swept=[STIFFNESS]))
    with pytest.raises(BadResults, match=r"young_modulus_factor: could not convert .*soft"):
        draw_twin(bad, 0)
