"""A patient besides its model, in real processes: killed once, derived again, reported."""

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import psutil
import pytest

from fras_audit import SERVICES, audit_log
from fras_audit.reading import read_recorded
from fras_cli.layout import Layout
from fras_cli.options import build_trial
from fras_cli.report import PatientSummary, Summary, read_trial, summarise
from fras_cli.stack import own_stack
from fras_cli.trial import TrialFollower, TrialView
from fras_common.messages import TissueState, Verdict
from fras_common.scenario import patient_scenario
from fras_common.topics import PATIENT, TISSUE_STATE, VERDICT
from fras_log import verify_file
from support.forging import rewrite
from support.logs import messages

MESH = "11,13,2"
KEYS = ("robot/state", "sim/tissue_state", "patient/tissue_state", "sa/verdict")


class Twins:
    """Runs trials with a patient through one stack under its supervisor."""

    def __init__(self, stack: Any, folder: Path) -> None:
        self.follower = TrialFollower(stack)
        self.folder = folder

    def run(
        self, name: str, look: Callable[[TrialView], None], peer_timeout_s: float = 60.0
    ) -> tuple[Summary, Path]:
        scenario = build_trial("twin", pace=0, mesh=MESH).scenario
        # A busy machine may take long to start a process anew.
        run = msgspec.structs.replace(scenario.run, peer_timeout_s=peer_timeout_s)
        folder = self.folder / name
        self.follower.start(name, msgspec.structs.replace(scenario, run=run), folder)
        assert self.follower.follow(look, stop=lambda: False)
        log = folder / "audit.mcap"
        return summarise(read_trial(log)), log


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Twins]:
    folder = tmp_path_factory.mktemp("twins")
    with own_stack("twins", None, folder / "logs", layout=Layout(patient=True)) as stack:
        yield Twins(stack, folder)


def patients() -> list[int]:
    children = psutil.Process().children(recursive=True)
    return [one.pid for one in children if "fras_sim.patient_main" in one.cmdline()]


@pytest.fixture(scope="module")
def undisturbed(twins: Twins) -> tuple[Summary, Path]:
    return twins.run("undisturbed", lambda view: None)


@pytest.fixture(scope="module")
def killed(twins: Twins) -> tuple[Summary, Path]:
    """A trial whose patient is killed in the pull."""
    pids: list[int] = []

    def look(view: TrialView) -> None:
        action = view.robot.action if view.robot is not None else None
        if not pids and action is not None and action.phase == "lift":
            pids.extend(patients())
            os.kill(pids[0], signal.SIGKILL)

    found = twins.run("killed", look)
    assert len(pids) == 1
    return found


def said(log: Path, key: str) -> dict[int, Any]:
    """What was said of each tick, but for who said it when and how long it took."""

    def untold(one: Any) -> Any:
        if isinstance(one, TissueState):
            solver = msgspec.structs.replace(one.solver, wall_s=0.0)
            one = msgspec.structs.replace(one, solver=solver)
        return msgspec.structs.replace(one, stamp_ns=0, seq=0, source="", trial="")

    return {one.tick: untold(one) for one in messages(log, key)}


def test_a_killed_patient_comes_back_and_nothing_is_lost(
    undisturbed: tuple[Summary, Path], killed: tuple[Summary, Path]
) -> None:
    (before, reference), (summary, log) = undisturbed, killed
    assert summary.outcome == before.outcome == "success"
    assert [str(finding) for finding in verify_file(log).findings] == []
    assert len({one.source for one in messages(log, "patient/tissue_state")}) == 2
    for key in KEYS:
        assert set(said(log, key)) == set(range(summary.ticks + 1)), key
    for key in KEYS[1:]:
        assert said(log, key) == said(reference, key), key


def test_the_patient_and_what_sa_made_of_both_are_derived_to_the_last_bit(
    killed: tuple[Summary, Path],
) -> None:
    report = audit_log(killed[1], SERVICES, lambda service, done, total: None)
    assert [(one.service, one.what, one.first) for one in report.tallies if one.first] == []
    assert report.passed
    states = next(one for one in report.tallies if (one.service, one.what) == ("patient", "states"))
    assert states.compared > 100
    assert states.tolerated == 0


def test_one_altered_node_of_the_patient_is_found(
    killed: tuple[Summary, Path], tmp_path: Path
) -> None:
    def altered(state: TissueState) -> TissueState:
        if state.tick != 50:
            return state
        return msgspec.structs.replace(state, max_force_n=state.max_force_n + 1e-12)

    forged = tmp_path / "forged.mcap"
    rewrite(killed[1], forged, "patient/tissue_state", altered)
    report = audit_log(forged, ["patient"], lambda service, done, total: None)
    (first,) = [one.first for one in report.tallies if one.first is not None]
    assert (first.where, first.path) == ("tick 50", "max_force_n")


def test_what_is_seen_is_the_patient_and_what_is_believed_the_model(
    undisturbed: tuple[Summary, Path],
) -> None:
    summary, log = undisturbed
    recorded = read_recorded(log)
    reset = recorded.reset(PATIENT.reset)
    assert reset is not None
    assert reset.scenario == patient_scenario(recorded.scenario)
    verdicts: list[Verdict] = list(recorded.of(VERDICT))
    believed = {one.tick: one.max_force_n for one in recorded.of(TISSUE_STATE)}
    borne = {one.tick: one for one in recorded.of(PATIENT.state)}
    assert all(one.max_force_n == believed[one.tick] for one in verdicts)
    assert all(
        one.grasped == {arm: len(nodes) for arm, nodes in borne[one.tick].grasped.items()}
        for one in verdicts
    )
    assert isinstance(summary.patient, PatientSummary)
    assert summary.patient.max_force_n == max(one.max_force_n for one in borne.values())
    assert summary.patient.max_force_n != summary.max_force_n


def test_a_trial_without_a_patient_runs_through_the_same_stack(
    twins: Twins, undisturbed: tuple[Summary, Path]
) -> None:
    del undisturbed
    folder = twins.folder / "plain"
    twins.follower.start("plain", build_trial("a", pace=0, mesh=MESH).scenario, folder)
    assert twins.follower.follow(lambda view: None, stop=lambda: False)
    summary = summarise(read_trial(folder / "audit.mcap"))
    assert summary.outcome == "success"
    assert not isinstance(summary.patient, PatientSummary)
    assert messages(folder / "audit.mcap", "patient/tissue_state") == []
    assert messages(folder / "audit.mcap", "fault/patient") == []


def test_a_patient_that_stays_away_ends_the_trial_by_name(twins: Twins) -> None:
    pids: list[int] = []
    told: set[str] = set()

    def look(view: TrialView) -> None:
        told.update(view.waiting.values())
        action = view.robot.action if view.robot is not None else None
        if not pids and action is not None and action.phase == "lift":
            pids.extend(patients())
            os.kill(pids[0], signal.SIGSTOP)

    try:
        # Less than the supervisor takes for hung.
        summary, log = twins.run("away", look, peer_timeout_s=3.0)
    finally:
        # The supervisor may have taken it for hung meanwhile.
        for one in patients():
            os.kill(one, signal.SIGCONT)
    assert (summary.outcome, summary.reason) == ("aborted", "hold:patient")
    assert "waiting: patient" in told
    report = audit_log(log, ["sa", "planner", "motion"], lambda service, done, total: None)
    assert [(one.service, one.what, one.first) for one in report.tallies if one.first] == []


def test_a_stack_without_a_patient_is_named_before_anything_moves(
    fras_here: Callable[..., Any], tmp_path: Path
) -> None:
    ended = fras_here("run", "twin", "--compose", "crtk", "--out", "out")
    assert ended.status == 2
    assert "no process.patient" in ended.text
    assert not (tmp_path / "out").exists()
