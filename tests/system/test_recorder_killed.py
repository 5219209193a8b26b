"""The recorder killed, or its disk full, in mid-trial: nothing is damaged, little is lost."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import psutil
import pytest

from fras_audit import SERVICES, audit_log
from fras_cli.log_info import read_info
from fras_cli.options import build_trial
from fras_cli.report import write_report
from fras_cli.stack import UsedStack
from fras_cli.trial import TrialView
from fras_log import recover_file, verify_file
from fras_log.parts import parts_of
from support.logs import messages

MESH = "11,13,2"
NUMBERED = (
    "planner/task_status",
    "planner/plan",
    "robot/state",
    "sim/tissue_state",
    "sim/checkpoint",
    "sa/verdict",
)

# As a disk that is full: no file grows beyond this size [bytes].
FULL = 300_000
HELD_S = 1.0


def recorder_of(stack: UsedStack) -> psutil.Process:
    """Find the recorder's process."""
    mine = {"fras_recorder", stack.link.connect}
    children = psutil.Process().children()
    living = [one for one in children if one.status() != psutil.STATUS_ZOMBIE]
    (recorder,) = [one for one in living if mine <= set(one.cmdline())]
    return recorder


def numbers(path: Path, key: str) -> list[int]:
    return [one.seq for one in messages(path, key)]


@pytest.fixture
def full_disk(trials: Any) -> Iterator[None]:
    """Let the recorder write no further than a full disk would."""
    recorder = recorder_of(trials.stack)
    usual = recorder.rlimit(psutil.RLIMIT_FSIZE)
    recorder.rlimit(psutil.RLIMIT_FSIZE, (FULL, usual[1]))
    yield
    recorder.rlimit(psutil.RLIMIT_FSIZE, usual)


@pytest.mark.usefixtures("full_disk")
def test_a_full_disk_stops_the_trial_and_damages_nothing(trials: Any) -> None:
    scenario = build_trial("a", pace=1, mesh=MESH).scenario
    run = msgspec.structs.replace(scenario.run, hold_timeout_s=HELD_S)
    path = trials.start(msgspec.structs.replace(scenario, run=run)) / "audit.mcap"
    views: list[TrialView] = []
    trials.follower.follow(views.append, stop=lambda: False)
    task = views[-1].task
    assert task is not None
    assert task.outcome == "aborted"
    assert "hold:recorder" in task.reason
    assert "File too large" in task.reason
    # What came at the end had room in a file of its own: the planner asks for it before the close.
    found = verify_file(path)
    assert found.findings == []
    assert found.unfinished == ["audit.mcap"]
    assert found.chained == found.messages > 100
    recovery = recover_file(path, path.with_name("recovered.mcap"), 1)
    assert (recovery.messages, recovery.damage) == (found.messages, ())
    assert verify_file(path.with_name("recovered.mcap")).intact
    # The arms did not move on for long after what is in the log.
    assert views[-1].robot is not None
    assert views[-1].robot.tick < recovery.last_tick + 60


def test_a_recorder_killed_in_mid_trial_costs_nothing(trials: Any) -> None:
    """Twice in one trial; on the stack whose disk was full before."""
    trial = build_trial("a", pace=1, mesh=MESH)
    path = trials.start(trial.scenario) / "audit.mcap"
    moments = ["grasp", "pull"]

    def look(view: TrialView) -> None:
        # What holds the arms after the first time is that there is no recorder yet.
        robot = view.robot
        if robot is None or robot.action is None or robot.holds:
            return
        if moments and robot.action.name == moments[0]:
            del moments[0]
            recorder_of(trials.stack).kill()

    trials.follower.follow(look, stop=lambda: False)
    assert moments == []
    names = ["audit.mcap", "audit.2.mcap", "audit.3.mcap"]
    assert [one.name for one in parts_of(path)] == names
    files = [(one.file, one.reason) for one in read_info(path).files]
    assert files == list(zip(names, ["", "", "closed"], strict=True))
    summary = write_report(path, path.parent)
    assert (summary.outcome, summary.lost) == ("success", 0)
    found = verify_file(path)
    assert [str(one) for one in found.findings] == []
    assert found.closed
    for key in NUMBERED:
        seqs = numbers(path, key)
        assert seqs == list(range(seqs[0], seqs[0] + len(seqs))), key
    # A state that is said again, with a hold more or less, is judged again.
    ticks = [one.tick for one in messages(path, "sa/verdict")]
    assert sorted(set(ticks)) == list(range(max(ticks) + 1))
    held = [one.holds for one in messages(path, "robot/state")]
    assert any("recorder" in holds for holds in held)
    assert held[-1] == {}
    report = audit_log(path, SERVICES, lambda service, done, total: None)
    assert report.passed, report.plain()
