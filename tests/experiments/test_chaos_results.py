"""What a campaign found: counted, kept, told."""

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from fras_common.scenario import ScenarioError
from fras_experiments.chaos.command import parse_kinds
from fras_experiments.chaos.faults import KINDS, Fault, Stretch
from fras_experiments.chaos.figure import draw_recovery, save_recovery
from fras_experiments.chaos.injector import Injected
from fras_experiments.chaos.invariants import Breach, Undisturbed
from fras_experiments.chaos.report import print_campaign, print_trial, write_summary
from fras_experiments.chaos.results import (
    Campaign,
    FaultRecord,
    TrialRecord,
    load,
    percentile,
    rows,
    save,
)
from fras_experiments.chaos.trials import NothingToDisturb, course_of, judge
from support.robots import robot
from support.stories import acting


def happened(kind, victim: str, recovery_s: float | None, at_ns: int = 1) -> FaultRecord:
    fault = Fault(kind, victim, "pull/lift", 200, 0.01)
    return FaultRecord(fault=fault, at_ns=at_ns, until_ns=0, recovery_s=recovery_s)


def trial(number: int, *faults: FaultRecord, reason: str = "", breaches=()) -> TrialRecord:
    return TrialRecord(
        number=number,
        faults=faults,
        outcome="aborted" if reason else "success",
        reason=reason or "visible",
        breaches=tuple(breaches),
        ticks=327,
        wall_s=1.0,
        audited=0,
        log=f"trial-{number:03d}/audit.mcap",
    )


@pytest.fixture
def campaign() -> Campaign:
    return Campaign(
        scenario="a",
        seed=1,
        kinds=KINDS,
        asked=5,
        undisturbed_ticks=327,
        undisturbed_force_n=0.2,
        load=(1.0, 2.0),
        cores=2,
        trials=(
            trial(0, happened("kill", "sim", 1.5), happened("router", "router", 2.5)),
            trial(1, happened("kill", "sim", 3.5)),
            trial(2, happened("kill", "sim", None), reason="hold:sim"),
            trial(3, happened("disk", "recorder", None, at_ns=0)),
            trial(4, happened("clock", "sa", None), breaches=[Breach("ends", "no end", 7)]),
        ),
    )


def test_rows_count_by_fault_and_all_kills(campaign: Campaign):
    found = {row.name: row for row in rows(campaign)}
    assert list(found) == ["kill sim", "kill router", "clock sa", "all kills"]
    sim = found["kill sim"]
    assert (sim.happened, sim.success, sim.held, sim.broken, sim.stalled) == (3, 2, 1, 0, 2)
    assert (sim.p50_s, sim.p95_s, sim.max_s) == (1.5, 3.5, 3.5)
    assert found["all kills"].happened == 4
    assert found["all kills"].p50_s == 2.5
    assert found["clock sa"].broken == 1


@pytest.mark.parametrize(
    ("share", "expected"), [(0.0, 1), (0.5, 5), (0.51, 6), (0.95, 10), (1.0, 10)]
)
def test_a_percentile_is_a_value_that_was_measured(share: float, expected: int):
    assert percentile(range(1, 11), share) == expected
    assert percentile([], share) is None


def test_results_are_read_back_as_they_were(campaign: Campaign, tmp_path: Path):
    save(campaign, tmp_path / "chaos.json")
    assert load(tmp_path / "chaos.json") == campaign
    assert [one.name for one in tmp_path.iterdir()] == ["chaos.json"]


def test_summary_and_table_tell_what_did_not_hold(campaign: Campaign, tmp_path: Path):
    write_summary(campaign, tmp_path / "summary.md")
    told = (tmp_path / "summary.md").read_text(encoding="utf-8")
    assert "in 1 something did not hold" in told
    assert "- trial 4: ends: no end (tick 7)" in told
    assert "| kill sim | 3 | 2 | 1 | 0 | 2 | 1.50 | 3.50 | 3.50 |" in told
    assert "load 1.0 when it began and 2.0 when it ended" in told
    screen = Console(file=io.StringIO(), width=100)
    print_campaign(screen, campaign)
    for one in campaign.trials:
        print_trial(screen, one)
    printed = screen.file.getvalue()  # pyright: ignore[reportAttributeAccessIssue]
    assert "all kills" in printed
    assert "BROKEN" in printed
    assert "(not reached)" in printed


def test_the_figure_shows_each_recovery_once(campaign: Campaign, tmp_path: Path):
    (axes,) = draw_recovery(campaign).axes
    times = [
        x for points in axes.collections for x in np.asarray(points.get_offsets())[:, 0].tolist()
    ]
    assert sorted(times) == [1.5, 2.5, 3.5]
    assert [one.get_text() for one in axes.get_yticklabels()] == ["kill router", "kill sim"]
    save_recovery(campaign, tmp_path / "recovery.png")
    assert (tmp_path / "recovery.png").read_bytes().startswith(b"\x89PNG")


def test_the_course_is_what_the_arms_do_stretch_by_stretch():
    phases = ["traverse", "traverse", "close", "close", "close", "done"]
    states = [robot(tick, action=acting(phase)) for tick, phase in enumerate(phases, 1)]
    assert course_of(states) == (Stretch("pull/traverse", 1, 2), Stretch("pull/close", 3, 3))
    with pytest.raises(NothingToDisturb):
        course_of([robot(0)])


def test_a_log_that_is_not_there_is_a_breach(tmp_path: Path):
    injected = [Injected(Fault("kill", "sim", "pull/lift", 3, 0.0))]
    log = tmp_path / "trial-007" / "audit.mcap"
    found = judge(7, log, tmp_path, injected, Undisturbed("success", 0.1), 1.0, audit=True)
    assert [one.invariant for one in found.breaches] == ["intact"]
    assert found.outcome == ""
    assert found.faults[0].at_ns == 0


def test_kinds_are_checked():
    assert parse_kinds("clock, kill") == ("kill", "clock")
    for text in ("", "flood", "kill,kill", "kill,"):
        with pytest.raises(ScenarioError, match="--faults"):
            parse_kinds(text)
