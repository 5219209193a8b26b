"""A trial's numbers, from what its log holds."""

from dataclasses import replace

from fras_cli.report import Trial
from fras_cli.report.trial import PatientTick, RobotTick
from fras_common.messages import Context, Plan, PlannedAction, Pose, TaskStatus
from fras_common.scenario import Scenario, resolve
from fras_experiments.campaign.measure import measure, planning_in, series_of
from fras_experiments.campaign.records import Timing
from support.verdicts import verdict

SCENARIO = resolve(Scenario(seed=3))
UNTIMED = Timing(worker="0", wall_s=1.0, cpu_s=2.0)
DOWN = (1.0, 0.0, 0.0, 0.0)


def state(tick: int, action: str = "pull", phase: str = "lift", goal: str = "g1", z: float = 0.0):
    pose = Pose(position_m=(0.05, 0.03, z), quaternion_xyzw=DOWN)
    return RobotTick(
        tick=tick, stamp_ns=0, tips_in_world={"psm1": pose}, goal_id=goal, action=action,
        arm="psm1", phase=phase, held=False,
    )  # fmt: skip


def trial(robot, forces, actions=(), plans=(), contexts=()) -> Trial:
    ending = TaskStatus(
        phase="ended", action="", goal_id="", tried=[], plans=1, replans=0, scenario_kind="A",
        actions=list(actions), outcome="success", reason="visible", violations=[],
    )  # fmt: skip
    return Trial(
        path="audit.mcap", complete=True, damage="", metadata={}, scenario=SCENARIO, model=None,
        robot=tuple(robot), tissue=(),
        verdicts=tuple(
            verdict(tick, "t", max_force_n=force_n) for tick, force_n in enumerate(forces)
        ),
        views=None, contexts=tuple(contexts), plans=tuple(plans), statuses=(ending,), results=(),
        started_ns=0, first_ns=0, last_ns=0, messages=0, lost=0, malformed=0, services={},
        warnings=(),
    )  # fmt: skip


def test_crossings_are_counted_in_pulls_alone():
    actions = ["grasp"] * 2 + ["pull"] * 6 + ["move"] * 2 + ["pull"] * 3
    robot = [
        state(tick, action, goal=f"g{('grasp', 'pull', 'move').index(action)}-{tick // 9}")
        for tick, action in enumerate(actions)
    ]
    forces = [0.9, 0.9, 0.4, 0.51, 0.5, 0.6, 0.6, 0.1, 0.9, 0.9, 0.7, 0.7, 0.7]
    result = measure(trial(robot, forces))
    assert (result.crossings, result.longest_above_ticks) == (3, 3)
    assert (result.max_force_n, result.soft_limit_n, result.hard_limit_n) == (0.9, 0.5, 1.0)


def test_heights_are_above_where_the_lift_began():
    robot = [state(tick, z=0.01 + 0.001 * tick) for tick in range(12)]
    robot += [state(12, phase="interrupted", z=0.1)]
    robot += [state(tick, goal="g2", z=0.02 + 0.002 * (tick - 13)) for tick in range(13, 17)]
    told = trial(robot, [0.1] * 17)
    assert [one.tick for one in series_of(told)] == [0, 5, 10, 15]
    assert [round(one.height_m, 6) for one in series_of(told)] == [0.0, 0.005, 0.01, 0.004]
    assert round(measure(told).lift_m or 0.0, 6) == 0.006


def test_a_trial_without_pull_or_grasp_says_so():
    result = measure(trial([], []))
    assert (result.crossings, result.lift_m, result.grasp_block) == (0, None, None)
    assert series_of(trial([], [])) == ()
    assert planning_in(trial([], []), UNTIMED) == UNTIMED
    assert result.patient_max_force_n is None
    assert result.missed_ticks is None


def test_the_last_grasp_is_told_with_its_place():
    context = Context(
        request_id="c0", fluents=[], evidence={}, names=["b(1,1)", "b(1,2)"],
        blocks_m=[(0.1, 0.2, 0.005), (0.3, 0.4, 0.005)], roi_m=(0.0, 0.0, 0.0),
        fixed_points_m=[], monitored=[],
    )  # fmt: skip
    moved = Context(
        request_id="c1", fluents=[], evidence={}, names=["b(1,2)"], blocks_m=[(9.0, 9.0, 9.0)],
        roi_m=(0.0, 0.0, 0.0), fixed_points_m=[], monitored=[],
    )  # fmt: skip
    actions = [
        "reach(psm1,b(1,1))",
        "grasp(psm1,b(1,1))",
        "grasp(psm2,b(1,2))",
        "pull(psm2,b(1,2))",
    ]
    result = measure(trial([], [], actions=actions, contexts=[context, moved]))
    assert (result.grasp_block, result.grasp_x_m, result.grasp_y_m) == ("b(1,2)", 0.3, 0.4)
    assert result.actions == 4
    scene = SCENARIO.scene
    assert scene is not None
    assert (result.roi_x_m, result.roi_y_m) == scene.roi_m[:2]


def plan(request: str, ground_s: float, stamp_ns: int, *actions: str) -> Plan:
    steps = [
        PlannedAction(t=t, text=f"{name}(psm1)", name=name, args=["psm1"], expected=[])
        for t, name in enumerate(actions)
    ]
    return Plan(
        request_id=request, reason="initial", criterion="weighted", goal="visible",
        asp_digest="", ignore_ap=False, tried=[], actions=steps, target="", arm="", history=[],
        cost=[], models=1, ground_s=ground_s, solve_s=0.5, explanation=[], no_plan=None,
        stamp_ns=stamp_ns,
    )  # fmt: skip


def asked(request: str, stamp_ns: int) -> Context:
    return Context(
        request_id=request, fluents=[], evidence={}, names=[], blocks_m=[], roi_m=(0.0, 0.0, 0.0),
        fixed_points_m=[], monitored=[], stamp_ns=stamp_ns,
    )  # fmt: skip


def test_planning_is_told_by_the_first_and_the_median():
    plans = [plan(f"c{n}", ground_s, 0) for n, ground_s in enumerate((0.5, 0.1, 0.2))]
    timing = planning_in(trial([], [], plans=plans), UNTIMED)
    assert (timing.plan_first_s, timing.plan_median_s) == (1.0, 0.7)
    # Of a log that lacks the contexts, nobody knows how long a plan took on its way.
    assert timing.plan_service_s is None
    assert timing.wall_s == UNTIMED.wall_s


def test_planning_through_the_service_is_from_context_to_plan():
    contexts = [asked(f"c{n}", 1_000_000_000 * n) for n in range(1, 6)]
    ms = 1_000_000
    plans = [
        plan("c1", 0.1, 1_000_000_000 + 7 * ms, "reach", "grasp", "pull"),
        plan("c2", 0.1, 2_000_000_000 + 8 * ms),  # no plan was found: nothing was planned anew
        plan("c3", 0.1, 3_000_000_000 + 9 * ms, "release", "reach", "grasp", "pull"),
        plan("c4", 0.1, 4_000_000_000 + 5 * ms, "move"),
        plan("c5", 0.1, 5_000_000_000 + 6 * ms, "move"),
    ]
    timing = planning_in(trial([], [], plans=plans, contexts=contexts), UNTIMED)
    assert (timing.plan_service_s, timing.replan_move_s, timing.replan_release_s) == (
        0.007, 0.005, 0.009,
    )  # fmt: skip
    plans[2:] = [plan("c3", 0.1, 3_000_000_000, "reach", "grasp", "pull")]
    timing = planning_in(trial([], [], plans=plans, contexts=contexts), UNTIMED)
    assert (timing.replan_move_s, timing.replan_release_s) == (None, None)


def test_what_the_patient_bore_is_told_beside_what_was_believed():
    borne = [PatientTick(tick, force, force) for tick, force in enumerate((0.2, 0.7, 0.9, 0.4))]
    told = replace(trial([], [0.1, 0.4, 0.6, 0.55]), patient=tuple(borne))
    result = measure(told)
    assert (result.patient_max_force_n, result.max_force_n) == (0.9, 0.6)
    assert (result.patient_above_ticks, result.missed_ticks, result.needless_ticks) == (2, 1, 1)
