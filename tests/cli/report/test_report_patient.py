"""What a report tells of the patient: what it bore in truth, beside what its model said."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest

from fras_cli.report import PatientSummary, read_trial, summarise, to_json, write_report

# The model says more than 0.5 N at ticks 46, 47 and 48.
BORNE_N = {44: 0.52, 45: 0.6, 46: 0.7, 47: 0.8, 48: 0.4}


@pytest.fixture
def log(new_log: Callable[..., Any], story: Any) -> Path:
    made = new_log()
    story.write_beginning(made)
    stiffer = msgspec.structs.replace(story.model(), young_modulus_pa=3900.0)
    made.put("patient/tissue_model", stiffer)
    story.write_ticks(made, 0, 64)
    for tick in range(65):
        state = msgspec.structs.replace(
            story.tissue(tick),
            max_force_n=BORNE_N.get(tick, 0.1),
            tool_force_n={"psm1": (0.0, 0.3, 0.4)} if tick == 20 else {},
        )
        made.put("patient/tissue_state", state)
    made.file.close({"reason": "closed"})
    return made.file.path


def test_truth_and_belief_are_counted_against_each_other(log: Path) -> None:
    trial = read_trial(log)
    summary = summarise(trial)
    assert summary.patient == PatientSummary(
        max_force_n=0.8, believed_max_force_n=0.55, ticks_above_limit=4, missed=2, needless=1
    )
    # The model's own numbers are as without a patient.
    assert (summary.max_force_n, summary.ticks_above_limit) == (0.55, 3)
    assert trial.model is not None
    assert trial.model.young_modulus_pa == 3000.0
    assert json.loads(to_json(summary))["patient"]["missed"] == 2


def test_the_page_says_and_draws_it(log: Path, tmp_path: Path) -> None:
    write_report(log, tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text()
    assert "The patient bore 0.80 N at most, where its model said 0.55 N." in page
    assert "It bore more than the limit for 4 ticks; the model missed 2 of them." in page
    assert "For 1 tick the model said so, and it did not." in page
    assert "Violet: what the patient bears in truth" in page
    assert "#7b3294" in page


def test_by_the_metric_of_the_scenario(log: Path) -> None:
    trial = read_trial(log)
    awareness = msgspec.structs.replace(trial.scenario.awareness, force_metric="tool")
    scenario = msgspec.structs.replace(trial.scenario, awareness=awareness)
    summary = summarise(replace(trial, scenario=scenario))
    assert isinstance(summary.patient, PatientSummary)
    assert (summary.patient.max_force_n, summary.patient.ticks_above_limit) == (0.5, 0)


def test_without_a_patient_nothing_of_it_is_said(log_path: Path, tmp_path: Path) -> None:
    summary = write_report(log_path, tmp_path)
    assert b"patient" not in to_json(summary)
    page = (tmp_path / "report.html").read_text()
    assert "atient" not in page
