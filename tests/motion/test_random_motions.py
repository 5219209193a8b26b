"""Random motions and stops, by kinematics that motion does not share."""

import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from benchmarks import psm_reference as psm
from benchmarks.motion_jobs import Motion, Recorder, strayed, used_limits
from benchmarks.motion_stops import Stop, measure_stops, summary
from benchmarks.motion_table import ROUNDING

from fras_cli.bench import run_benchmark
from fras_motion.controller import MotionController
from fras_motion.parameters import MotionParameters
from fras_motion.safety import GATES, GateRefused
from support import campaign

IDEAL = MotionParameters(driver_time_constant_s=0.0)
EXACT = 1e-6


@pytest.fixture(scope="module")
def motions() -> list[Motion]:
    recorder = Recorder(seed=1)
    return [recorder.motion() for _ in range(campaign.length(1000, 200))]


def test_no_limit_is_exceeded_in_random_motions(motions):
    assert {motion.goal.arm for motion in motions} == {"psm1", "psm2"}
    counts = Counter(motion.goal.name for motion in motions)
    assert set(counts) == {"reach", "grasp", "pull", "move", "release"}
    assert min(counts.values()) > len(motions) / 10
    used = [used_limits(motion, IDEAL) for motion in motions]
    largest = {name: max(row[name] for row in used) for name in used[0]}
    assert max(largest.values()) <= 1.0 + ROUNDING
    # They are no timid motions: what binds is used fully, and the joints are told apart.
    assert largest["tip speed"] == pytest.approx(1.0)
    assert largest["tip acceleration"] == pytest.approx(1.0)
    assert largest["joint acceleration"] > 0.9


def test_tips_keep_to_their_lines_and_tools_point_down(motions):
    strays = np.array([strayed(motion, IDEAL) for motion in motions])
    assert strays.max() <= EXACT


@pytest.mark.parametrize(
    ("axis", "most", "names"),
    [(0, 0.07, {"reach", "grasp", "pull", "move", "release"}), (2, 0.06, {"reach", "grasp"})],
)
def test_what_a_gate_refuses_is_drawn_again_or_left_out(axis, most, names):
    def fence(step, bounds):
        del bounds
        if step.tip_after.position_m[axis] > most:
            raise GateRefused("fence", "xyz"[axis], step.tip_after.position_m[axis], 0.0, most)

    recorder = Recorder(seed=2)
    recorder.controller = MotionController(IDEAL, gates={**GATES, "fence": fence})
    motions = [recorder.motion() for _ in range(20)]
    assert recorder.refused > 0
    assert names <= {motion.goal.name for motion in motions}
    for motion in motions:
        tips, _ = psm.forward(motion.joints, psm.BASES[motion.goal.arm])
        assert tips[:, axis].max() <= most + EXACT


def pull_of(motions: list[Motion]) -> Motion:
    return next(motion for motion in motions if motion.goal.name == "pull")


@pytest.mark.parametrize(
    ("limit", "joint", "shift"),
    [
        ("joint position", 1, 1.0),
        ("joint speed", 0, 0.05),
        ("joint acceleration", 2, 1e-4),
        ("tip jerk", 2, 4e-5),
    ],
)
def test_a_setpoint_beyond_a_limit_is_seen(motions, limit, joint, shift):
    motion = pull_of(motions)
    joints = motion.joints.copy()
    joints[len(joints) // 2, joint] += shift
    assert used_limits(replace(motion, joints=joints), IDEAL)[limit] > 1.0 + ROUNDING


def test_a_jaw_beyond_its_range_is_seen(motions):
    motion = pull_of(motions)
    used = used_limits(replace(motion, jaw_rad=motion.jaw_rad - 0.5), IDEAL)
    assert used["jaw position"] > 1.0


@pytest.mark.parametrize(("joint", "column"), [(0, 0), (3, 1)])
def test_a_tip_beside_its_line_or_turned_is_seen(motions, joint, column):
    motion = pull_of(motions)
    joints = motion.joints.copy()
    joints[len(joints) // 2, joint] += 2e-5
    assert strayed(replace(motion, joints=joints), IDEAL)[column] > EXACT


def test_a_motion_that_ends_elsewhere_is_seen(motions):
    motion = pull_of(motions)
    short = replace(motion, joints=motion.joints[:-20], phases=motion.phases[:-20])
    assert strayed(short, IDEAL)[2] > EXACT
    higher = replace(motion, grasp_height_m=motion.grasp_height_m + 2e-6)
    assert strayed(higher, IDEAL)[2] > EXACT


def test_stops_at_random_ticks_travel_what_they_need_and_rest_within_two_ticks():
    figures = measure_stops(60, 3, lambda done: None)
    assert figures["stops"] == 60
    assert figures["most_ticks"] <= 2
    for kind in ("tip", "jaw"):
        assert figures[kind]["stops"] > 0
        assert 0.0 < figures[kind]["largest_share"] <= 1.0 + ROUNDING
    assert figures["tip"]["steady_share"] == pytest.approx([1.0, 1.0])


def test_a_stop_that_travels_further_is_seen():
    shortest = 0.05**2 / (2 * IDEAL.stop_deceleration_m_s2)
    late = Stop(jaw=False, ticks=3, travelled=1.1 * shortest, speed=0.05, steady=True)
    figures = summary([late], IDEAL)
    assert figures["most_ticks"] == 3
    assert figures["tip"]["largest_share"] == pytest.approx(1.1)


def test_the_reference_tells_small_turns():
    angle = 1e-9
    c, s = np.cos(angle), np.sin(angle)
    turned = np.array([[[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]])
    assert psm.turns_rad(turned, np.eye(3)) == pytest.approx([angle], rel=1e-6)


def test_the_benchmark_writes_its_figures(tmp_path, capfd):
    small = ["--motions", "60", "--ticks", "50", "--stops", "5", "--pace", "20", "--out"]
    assert run_benchmark("motion", [*small, str(tmp_path)]) == 0
    told = capfd.readouterr().out
    report = json.loads((tmp_path / "motion.json").read_text())
    assert (tmp_path / "reachability.png").read_bytes().startswith(b"\x89PNG")
    for row in report["targets"]:
        assert f"{'met' if row['met'] else 'MISSED':8}" in told
        assert row["what"] in told
    # A target that the setting cannot reach is missed, and says so.
    assert {"what": "at least 1,000 random motions", "value": "60", "met": False} in report[
        "targets"
    ]
    assert report["ik"]["ticks"] == 50
    assert report["ik"]["ours"]["off_m"] <= EXACT
    assert report["ik"]["peer"]["off_m"] <= EXACT
    for arm in ("psm1", "psm2"):
        reach = report["reachability"][arm]
        assert 0.1 < reach["whole_tissue"]["margin"] <= reach["half_it_serves"]["margin"]


@pytest.mark.parametrize("option", [["--motions", "0"], ["--pace", "0"], ["--stops", "-1"]])
def test_senseless_options_are_refused(option, capfd):
    assert run_benchmark("motion", option) == 2
    assert option[0] in capfd.readouterr().err
