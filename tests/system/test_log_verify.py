"""What real trials did, held against the safety specifications from their logs alone."""

import dataclasses
import io
from pathlib import Path
from typing import Any

import msgspec
import pytest
from rich.console import Console

from fras_cli.log_verify import LogIncomplete, executed_history, verify_log
from fras_cli.report import read_trial


@pytest.mark.parametrize("name", ["a", "b", "c"])
def test_what_was_done_is_in_the_log_and_keeps_to_all(trials: Any, name: str) -> None:
    summary, log = trials.kept(name)
    history = executed_history(read_trial(log))
    assert [step[0] for step in history.values()] == summary.actions
    assert summary.violations == []
    assert verify_log(log, None, Console(file=io.StringIO())) == 0


def test_an_action_that_breaks_one_is_told(trials: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same trial, had it grasped with its gripper closed."""
    _, log = trials.kept("a")
    trial = read_trial(log)
    contexts = list(trial.contexts)
    arm = trial.results[1].arm
    fluents = [*contexts[1].fluents, f"closed_gripper({arm})"]
    contexts[1] = msgspec.structs.replace(contexts[1], fluents=fluents)
    forged = dataclasses.replace(trial, contexts=tuple(contexts))
    monkeypatch.setattr("fras_cli.log_verify.read_trial", lambda _: forged)
    told = io.StringIO()
    assert verify_log(log, None, Console(file=told, width=200)) == 1
    text = told.getvalue()
    assert "with its gripper closed" in text
    assert "The planner itself said otherwise: that all were kept" in text
    assert "3 actions verified: specifications broken: 1." in text


def test_a_log_without_what_led_to_an_action_is_named(
    trials: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, log = trials.kept("a")
    cut = dataclasses.replace(read_trial(log), contexts=())
    monkeypatch.setattr("fras_cli.log_verify.read_trial", lambda _: cut)
    with pytest.raises(LogIncomplete, match="what led to action g1"):
        verify_log(log, None, Console(file=io.StringIO()))


def test_a_log_that_is_damaged_or_cut_off_is_not_certified(trials: Any, tmp_path: Path) -> None:
    _, log = trials.kept("a")
    whole = log.read_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 0xFF
    for name, content in {"flipped": bytes(flipped), "cut": whole[: len(whole) // 2]}.items():
        path = tmp_path / f"{name}.mcap"
        path.write_bytes(content)
        told = io.StringIO()
        assert verify_log(path, None, Console(file=told, width=200)) == 1, name
        assert "all specifications kept" not in told.getvalue()
        assert "damaged" in told.getvalue()


def test_an_action_that_no_executive_numbered_is_named(
    trials: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, log = trials.kept("a")
    trial = read_trial(log)
    foreign = msgspec.structs.replace(trial.results[0], goal_id="mine")
    forged = dataclasses.replace(trial, results=(foreign, *trial.results[1:]))
    monkeypatch.setattr("fras_cli.log_verify.read_trial", lambda _: forged)
    with pytest.raises(LogIncomplete, match="what led to action mine"):
        verify_log(log, None, Console(file=io.StringIO()))
