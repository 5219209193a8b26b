"""The numbers of `summary.json`, against those that the log was made from."""

import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest
from rich.console import Console

from fras_cli.display import print_summary
from fras_cli.report import read_trial, summarise, to_json
from fras_cli.report.summary import CUT_SHORT

FIELDS = {
    "outcome", "reason", "seed", "scenario_kind", "visibility", "max_force_n", "limit_n",
    "ticks_above_limit", "plans", "replans", "actions", "violations", "ticks", "sim_s",
    "wall_s", "startup_s", "tick_ms", "fe_ms", "messages", "lost", "log", "head", "complete",
    "versions",
}  # fmt: skip


def test_numbers_of_a_whole_trial(log_path: Path) -> None:
    summary = summarise(read_trial(log_path))
    assert summary.outcome == "success"
    assert summary.reason == "the region of interest is visible"
    assert (summary.seed, summary.scenario_kind) == (7, "B")
    assert (summary.plans, summary.replans) == (3, 1)
    assert summary.visibility == 0.85
    assert (summary.max_force_n, summary.limit_n, summary.ticks_above_limit) == (0.55, 0.5, 3)
    assert [text.partition("(")[0] for text in summary.actions] == [
        "reach",
        "grasp",
        "pull",
        "move",
    ]
    assert (summary.ticks, summary.sim_s) == (64, 6.4)
    # 65 ticks of 4 ms, three plannings of 50 ms.
    assert summary.wall_s == pytest.approx(65 * 0.004 + 3 * 0.05)
    # Asked for 1.5 s before the log began, 4 ms before tick 0.
    assert summary.startup_s == pytest.approx(1.504)
    assert summary.complete
    assert summary.lost == 0
    assert summary.versions == {"fras": "0.1.0", "python": "3.11.7", "host": "theatre-1"}
    assert summary.log == str(log_path)


def test_tick_time_leaves_out_planning_between_actions(log_path: Path) -> None:
    tick_ms = summarise(read_trial(log_path)).tick_ms
    assert tick_ms is not None
    assert (tick_ms.p50, tick_ms.p99) == (4.0, 4.0)


def test_tick_time_leaves_out_holds(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    story.write_ticks(log, 0, 30)
    log.put("robot/state", msgspec.structs.replace(story.robot(30), holds={"surgeon": "look"}))
    log.now_ns += 5 * 10**9
    story.write_ticks(log, 31, 40)
    log.file.close({})
    tick_ms = summarise(read_trial(log.file.path)).tick_ms
    assert tick_ms is not None
    assert tick_ms.p99 == 4.0


def test_fe_time_is_the_solver_s_percentiles(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    for tick in range(101):
        state = story.tissue(tick)
        solver = msgspec.structs.replace(state.solver, wall_s=tick / 1000)
        log.put("sim/tissue_state", msgspec.structs.replace(state, solver=solver))
    log.file.close({})
    fe_ms = summarise(read_trial(log.file.path)).fe_ms
    assert fe_ms is not None
    # Tick 0 solves nothing and does not count.
    assert (fe_ms.p50, fe_ms.p99) == pytest.approx((50.5, 99.01))


def test_a_log_that_ends_before_its_trial_is_aborted(
    new_log: Callable[..., Any], story: Any
) -> None:
    log = new_log()
    story.write_beginning(log)
    story.write_ticks(log, 0, 10)
    log.file.flush()
    summary = summarise(read_trial(log.file.path))
    assert (summary.outcome, summary.reason) == ("aborted", CUT_SHORT)
    assert not summary.complete
    assert summary.ticks == 10
    log.file.close({})


def test_an_empty_log_says_null_not_zero(new_log: Callable[..., Any]) -> None:
    log = new_log()
    log.file.close({})
    summary = json.loads(to_json(summarise(read_trial(log.file.path))))
    unknown = {name for name, value in summary.items() if value is None}
    assert unknown == {
        "scenario_kind", "visibility", "max_force_n", "startup_s", "tick_ms", "fe_ms", "violations",
    }  # fmt: skip
    assert summary["outcome"] == "aborted"


def test_a_request_without_a_start_time_leaves_startup_open(
    new_log: Callable[..., Any], story: Any
) -> None:
    log = new_log()
    story.write_ticks(log, 0, 1)
    log.file.close({})
    assert summarise(read_trial(log.file.path)).startup_s is None


def test_a_force_that_is_no_number_is_left_out(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    story.write_ticks(log, 0, 1)
    broken = msgspec.structs.replace(story.verdict(2), max_force_n=float("nan"), level="invalid")
    log.put("sa/verdict", broken)
    log.file.close({})
    assert summarise(read_trial(log.file.path)).max_force_n == 0.0


def test_json_has_exactly_the_fields_promised(log_path: Path) -> None:
    summary = json.loads(to_json(summarise(read_trial(log_path))))
    assert set(summary) == FIELDS
    assert set(summary["tick_ms"]) == set(summary["fe_ms"]) == {"p50", "p99"}


def test_what_awareness_could_not_measure_is_null(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    story.write_ticks(log, 0, 1)
    blind = msgspec.structs.replace(
        story.verdict(2), max_force_n=-1.0, visibility=-1.0, level="invalid"
    )
    log.put("sa/verdict", blind)
    log.file.close({})
    summary = summarise(read_trial(log.file.path))
    assert summary.visibility is None
    assert summary.max_force_n is not None
    assert summary.max_force_n >= 0


def test_an_arm_that_failed_is_told_in_its_own_words(log_path: Path) -> None:
    trial = read_trial(log_path)
    said = "psm2 does not say where it is: does the process that drives it run?"
    ended = {"outcome": "aborted", "reason": "hold:arms"}
    failed = msgspec.structs.replace(trial.results[-1], **ended, text=said)
    statuses = tuple(
        msgspec.structs.replace(one, **ended) if one.outcome else one for one in trial.statuses
    )
    other = replace(trial, results=(failed,), statuses=statuses)
    summary = summarise(other)
    assert summary.detail == said
    out = io.StringIO()
    print_summary(Console(file=out, width=200), summary, [])
    assert f"Reason: hold:arms: {said}" in out.getvalue()
    assert b'"detail"' not in to_json(summarise(trial))
