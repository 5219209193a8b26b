"""The arms in a process of their own, under the keys of CRTK; and clients that lead them."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from math import dist
from pathlib import Path
from typing import Any

import msgspec
import psutil
import pytest

from fras_audit import SERVICES, audit_log
from fras_cli.layout import Layout
from fras_cli.options import build_trial
from fras_cli.report import Summary, read_trial, summarise
from fras_cli.stack import UsedStack, own_stack
from fras_cli.trial import TrialFollower, TrialView
from fras_common.messages import HoldRequest, Pose, ResumeRequest, RobotState, ServoJoints
from fras_common.topics import CRTK, HOLD, RESUME
from support.arms import KINEMATICS, off
from support.leader import Leader
from support.logs import assert_same_trial, messages

MESH = "11,13,2"
AT_ONCE_S = 0.5
# Commands that a busy router drops on their way to the recorder.
MAY_BE_LOST = 3


class ArmsStack:
    """A stack whose arms are a process of their own, and one who leads them between trials."""

    def __init__(self, stack: UsedStack, folder: Path) -> None:
        # That the arms have gone is what the trial shall say, not the command line.
        self._follower = TrialFollower(replace(stack, watch=lambda: ""))
        self._folder = folder
        self._count = 0
        self.bus = stack.link.bus
        self.leader = Leader(self.bus, "arms")
        mine = {"fras_motion.arms_main", stack.link.connect}
        children = psutil.Process().children()
        (self.arms,) = [one for one in children if mine <= set(one.cmdline())]

    def start(self, peer_timeout_s: float = 10.0) -> None:
        """Bring the arms home, and begin a trial in real time."""
        self.leader.bring_home()
        self.leader.faults.clear()
        self._count += 1
        trial = build_trial("a", pace=1, mesh=MESH)
        run = msgspec.structs.replace(trial.scenario.run, peer_timeout_s=peer_timeout_s)
        scenario = msgspec.structs.replace(trial.scenario, run=run)
        self._follower.start(f"trial-{self._count}", scenario, self._out)

    def follow(self, until: Any = lambda view: False) -> TrialView:
        """Follow the trial to its end, or until something is seen."""
        views: list[TrialView] = []
        self._follower.follow(views.append, stop=lambda: bool(until(views[-1])))
        return views[-1]

    def abort(self) -> None:
        """End the trial."""
        self._follower.abort("seen enough")
        self.follow()

    def report(self) -> tuple[Summary, Path]:
        """Read the log of the last trial."""
        log = self._out / "audit.mcap"
        return summarise(read_trial(log)), log

    @property
    def _out(self) -> Path:
        return self._folder / f"trial-{self._count}"


@pytest.fixture(scope="module")
def with_arms(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ArmsStack]:
    folder = tmp_path_factory.mktemp("crtk")
    with own_stack("crtk-tests", None, folder / "logs", layout=Layout("crtk")) as stack:
        yield ArmsStack(stack, folder)


def moves(view: TrialView) -> bool:
    """Whether an arm is under way in mid-action."""
    robot = view.robot
    return robot is not None and robot.tick > 20 and robot.action is not None


def result_of(log: Path) -> tuple[str, str]:
    last = messages(log, "motion/action_result")[-1]
    return last.outcome, last.reason


def test_arms_that_freeze_end_the_trial_and_a_stop_is_still_answered(with_arms: ArmsStack) -> None:
    with_arms.start(peer_timeout_s=3.0)
    with_arms.follow(moves)
    os.kill(with_arms.arms.pid, signal.SIGSTOP)
    try:
        for number in range(10):
            since_s = time.monotonic()
            request = HoldRequest(holder="cli", reason=f"stop {number}")
            assert with_arms.bus.query(HOLD, request, 5.0).holds["cli"] == f"stop {number}"
            assert time.monotonic() - since_s < AT_ONCE_S
        with_arms.follow()
    finally:
        os.kill(with_arms.arms.pid, signal.SIGCONT)
        with_arms.bus.query(RESUME, ResumeRequest(holder="cli", by="cli"), 5.0)
    summary, log = with_arms.report()
    assert (summary.outcome, summary.reason) == ("aborted", "hold:arms")
    assert summary.complete
    assert result_of(log) == ("aborted", "hold:arms")


def test_an_arm_that_somebody_disables_stops_and_motion_holds(with_arms: ArmsStack) -> None:
    with_arms.start()
    view = with_arms.follow(moves)
    assert view.robot is not None
    assert view.robot.action is not None
    arm = view.robot.action.arm
    with_arms.leader.state_command(arm, "disable")
    ticks: list[int] = []

    def stands_held(view: TrialView) -> bool:
        robot = view.robot
        if robot is not None and robot.action is not None and robot.action.phase == "held":
            ticks.append(robot.tick)
        return len(ticks) >= 3

    held = with_arms.follow(stands_held).robot
    assert held is not None
    assert held.holds == {f"arms/{arm}": "disabled"}
    assert held.arms[arm].operating_state == "DISABLED"
    assert len(set(ticks)) == 1  # logical time stands still
    leader = with_arms.leader
    leader.until(lambda: max(map(abs, leader.joints(arm).joint_velocities)) < 1e-6)
    stands = leader.joints(arm)
    leader.until(lambda: leader.joints(arm).seq > stands.seq + 20)
    assert leader.joints(arm).joints == pytest.approx(stands.joints, abs=1e-9)
    with_arms.abort()
    summary, _ = with_arms.report()
    assert (summary.outcome, summary.reason) == ("aborted", "seen enough")


def test_a_trial_with_arms_of_another_process_succeeds(with_arms: ArmsStack) -> None:
    with_arms.start()
    with_arms.follow()
    summary, log = with_arms.report()
    assert summary.outcome == "success"
    assert summary.complete
    assert with_arms.leader.faults == []
    for keys in CRTK:
        for topic in keys.all:
            said = {message.source.partition("/")[0] for message in messages(log, topic.key)}
            if topic.producer == "arms":
                assert said == {"arms"}, topic.key
        for topic in (keys.servo_jp, keys.jaw_servo_jp):
            assert {m.source.partition("/")[0] for m in messages(log, topic.key)} == {"motion"}
    states: list[RobotState] = messages(log, "robot/state")
    # One a tick, none at tick 0. They are numbered, as what is never kept may be missing in a log.
    told = [message.seq for message in messages(log, CRTK[0].servo_jp.key)]
    ticks = len({state.tick for state in states})
    assert told == sorted(set(told))
    assert ticks - 1 - MAY_BE_LOST <= len(told) <= told[-1] - told[0] + 1 <= ticks - 1
    # What those arms measured is taken as recorded, all else derived again.
    report = audit_log(log, SERVICES, lambda service, done, total: None)
    assert [tally.first for tally in report.tallies if tally.first] == []
    assert report.passed


def test_arms_that_die_end_the_trial_and_the_log_is_readable(with_arms: ArmsStack) -> None:
    """The last one with these arms: those that come after them are others."""
    with_arms.start()
    with_arms.follow(moves)
    with_arms.arms.kill()
    with_arms.follow()
    summary, log = with_arms.report()
    assert (summary.outcome, summary.reason) == ("aborted", "hold:arms")
    assert summary.complete
    assert result_of(log) == ("aborted", "hold:arms")
    assert len(messages(log, "robot/state")) > 20


def test_a_client_leads_a_simulated_arm_between_trials_and_not_in_one(
    trials: Any, quiet: Path
) -> None:
    leader = Leader(trials.stack.link.bus, "motion")
    start = leader.joints("psm1")
    there = Pose(position_m=(0.04, 0.02, 0.05), quaternion_xyzw=KINEMATICS["psm1"].tool_down_xyzw)
    assert leader.off_by_m("psm1", there) > 0.005
    leader.move("psm1", there)
    assert dist(leader.joints("psm1").joints, start.joints) > 0.01
    assert leader.faults == []

    def meddle(view: TrialView) -> None:
        if view.task is not None and view.task.phase == "acting" and view.robot is not None:
            joints: Any = off(view.robot.arms["psm1"].joints, 0, 0.001)
            leader.tell(CRTK[0].servo_jp, ServoJoints(joints=joints))

    disturbed = trials.run("a", meddle, mesh=MESH)[1]
    refusals = messages(disturbed, "fault/motion")
    assert len(refusals) > 3
    assert {(fault.key, fault.values["reason"]) for fault in refusals} == {
        ("psm1/servo_jp", "trial_runs")
    }
    assert set(leader.reasons()) == {("psm1/servo_jp", "trial_runs")}
    assert_same_trial(quiet, disturbed)


def test_the_client_of_the_reference_page_leads_an_arm_with_zenoh_and_msgpack_alone(
    trials: Any, tmp_path: Path
) -> None:
    page = (Path(__file__).parents[2] / "docs" / "reference" / "crtk.md").read_text()
    link = trials.stack.link
    for written, here in (
        ("tcp/127.0.0.1:7447", link.connect),
        ("fras/local", f"fras/{link.cell}"),
    ):
        assert written in page
        page = page.replace(written, here)
    (tmp_path / "lead.py").write_text(page.split("```python\n")[1].split("```")[0])

    def lead(*place: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, str(tmp_path / "lead.py"), *place]
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)

    assert lead("0.05", "0.03", "0.055").stdout == "psm1 is at [0.05, 0.03, 0.055]\n"
    refused = lead("0.05", "0.03", "0.9")
    assert refused.returncode == 1
    assert "psm1/move_cp refused (unreachable)" in refused.stderr


def test_a_trial_with_late_and_noisy_arms_succeeds_and_is_the_same_each_time(
    trials: Any, tmp_path: Path
) -> None:
    scenario = tmp_path / "noisy.toml"
    scenario.write_text(
        "seed = 2\n[motion]\njoint_delay_s = 0.03\njoint_noise_rad = 0.0001\n"
        "insertion_noise_m = 0.00002\n"
    )
    (first, one), (second, other) = (trials.run(str(scenario), mesh=MESH) for _ in range(2))
    assert (first.outcome, second.outcome) == ("success", "success")
    assert_same_trial(one, other)
    states: list[RobotState] = messages(one, "robot/state")
    errors = [
        abs(state.arms["psm1"].joints[0] - state.arms["psm1"].setpoint_joints[0])
        for state in states
    ]
    assert 1e-5 < sorted(errors)[len(errors) // 2] < 1e-3
