"""The recorder killed, or its disk full, in mid-trial: nothing is damaged, little is lost."""

import subprocess
from collections.abc import Callable, Iterator
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
# What takes not even the first words of a log's next file.
TINY = 4_000
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


class Disk:
    """Lets the recorder write no further than a full disk would."""

    def __init__(self, recorder: psutil.Process) -> None:
        self._recorder = recorder
        self._usual = recorder.rlimit(psutil.RLIMIT_FSIZE)

    def fill(self, size: int) -> None:
        self._recorder.rlimit(psutil.RLIMIT_FSIZE, (size, self._usual[1]))

    def empty(self) -> None:
        self._recorder.rlimit(psutil.RLIMIT_FSIZE, self._usual)


@pytest.fixture
def disk(trials: Any) -> Iterator[Disk]:
    disk = Disk(recorder_of(trials.stack))
    yield disk
    disk.empty()


def complete(path: Path) -> None:
    """The log has its end, and nothing is missing in it."""
    found = verify_file(path)
    assert [str(one) for one in found.findings] == []
    assert found.closed
    summary = write_report(path, path.parent)
    assert (summary.complete, summary.lost) == (True, 0)
    for key in NUMBERED:
        seqs = numbers(path, key)
        assert seqs == list(range(seqs[0], seqs[0] + len(seqs))), key


def until(trials: Any, fits: Callable[[TrialView], object]) -> TrialView:
    """Follow a trial until something is seen, or to its end."""
    views: list[TrialView] = []
    trials.follower.follow(views.append, stop=lambda: bool(fits(views[-1])))
    return views[-1]


def test_a_disk_that_is_full_as_a_trial_ends_gets_the_end_when_there_is_room(
    trials: Any, disk: Disk
) -> None:
    path = trials.start(build_trial("a", pace=1, mesh=MESH).scenario) / "audit.mcap"
    until(trials, lambda view: view.robot is not None and view.robot.tick > 50)
    recorder = recorder_of(trials.stack)
    recorder.suspend()
    disk.fill(TINY)
    trials.follower.abort("seen enough")
    until(trials, lambda view: view.task is not None and view.task.phase == "ended")
    recorder.resume()
    waits = until(trials, lambda view: "recorder" in view.waiting.get("planner", ""))
    assert waits.task is not None
    assert waits.task.phase == "ended"
    disk.empty()
    end = until(trials, lambda view: False)
    assert end.task is not None
    assert (end.task.outcome, end.task.reason) == ("aborted", "seen enough")
    complete(path)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Make a file system with little room."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=4m", "fras", str(folder)]
    try:
        mounted = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        pytest.skip(f"no file system can be mounted here: {error}")
    if mounted.returncode:
        pytest.skip(f"no file system can be mounted here: {mounted.stderr.strip()}")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def write_without_end(path: Path) -> None:
    with path.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))


def test_a_file_system_without_room_stops_the_trial_and_the_log_gets_its_end_later(
    trials: Any, small_disk: Path
) -> None:
    scenario = build_trial("a", pace=1, mesh=MESH).scenario
    path = trials.start(scenario, into=small_disk) / "audit.mcap"
    until(trials, lambda view: view.robot is not None and view.robot.tick > 50)
    filler = small_disk / "filler"
    with pytest.raises(OSError, match="No space left"):
        write_without_end(filler)
    until(trials, lambda view: "recorder" in view.waiting.get("planner", ""))
    filler.unlink()
    end = until(trials, lambda view: False)
    assert end.task is not None
    assert end.task.outcome == "aborted"
    assert end.task.reason.startswith("hold:recorder")
    assert "No space left" in end.task.reason
    complete(path)


def test_a_full_disk_stops_the_trial_and_damages_nothing(trials: Any, disk: Disk) -> None:
    disk.fill(FULL)
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
