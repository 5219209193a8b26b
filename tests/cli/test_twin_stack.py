"""A trial with a patient, and a stack with or without one: named before anything starts."""

from pathlib import Path
from typing import Any, cast

import pytest

from fras_cli.layout import USUAL, Layout
from fras_cli.link import Link
from fras_cli.patient import NoPatient, require_ready
from fras_supervisor import find_table, load_table
from fras_supervisor.producers import service_of


def test_the_twin_table_is_the_usual_one_and_the_patient() -> None:
    usual, twin = (load_table(find_table(name)).processes for name in ("local", "twin"))
    assert set(twin) == {*usual, "patient"}
    assert service_of(twin["patient"].command) == "patient"
    assert twin["recorder"].outlives == ("sim", "patient", "sa", "motion", "planner")
    assert {twin[name] == usual[name] for name in usual if name != "recorder"} == {True}


@pytest.mark.parametrize("keys", [None, Path("/keys")])
def test_a_trial_with_a_patient_gets_the_twin_table_by_itself(keys: Path | None) -> None:
    layout = Layout(keys=keys, patient=True)
    assert layout.table() == Layout("twin", keys=keys).table()
    assert "patient" not in Layout(keys=keys).table().processes


def test_it_is_no_other_layout_for_a_stack_that_runs() -> None:
    assert Layout(patient=True) == USUAL
    assert Layout(patient=True).in_words() == ""


def test_a_table_without_a_patient_is_refused_by_name() -> None:
    with pytest.raises(NoPatient, match=r"crtk\.toml no process\.patient: leave out --compose"):
        Layout("crtk", patient=True).table()


class _Ready:
    cell, connect = "theatre", "tcp/127.0.0.1:7447"

    def __init__(self, *services: str) -> None:
        self._services = services

    def wait_ready(self, service: str, timeout_s: float) -> bool:
        del timeout_s
        return service in self._services


def test_so_is_a_stack_that_runs_without_one() -> None:
    def link(*services: str) -> Link:
        return cast("Any", _Ready(*services))

    with pytest.raises(NoPatient, match=r"'theatre'.*--compose twin"):
        require_ready(link("sim"))
    require_ready(link("sim", "patient"))
