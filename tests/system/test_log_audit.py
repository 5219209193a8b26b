"""Real trials derived again from their logs; and logs that lie, at the place where they do."""

import hashlib
import io
import json
import math
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import pytest
from rich.console import Console

from fras_audit import SERVICES, Report, Tally, audit_log
from fras_audit.decisions import decide_by
from fras_audit.reading import read_recorded
from fras_audit.recorded import reply_of
from fras_cli.audit import UnknownService, audit, other_rules
from fras_cli.failures import exit_status
from fras_cli.trial import TrialView
from fras_common.codec import decode, encode
from fras_common.messages import (
    ActionResult,
    Array,
    Context,
    ContextRequest,
    ExecuteRequest,
    Health,
    HoldRequest,
    JointState,
    Plan,
    ResumeRequest,
    RobotState,
    RpcRecord,
    SimCheckpoint,
    TargetRequest,
    TaskRequest,
    TaskStatus,
    TissueState,
    Verdict,
    WhyNotRequest,
)
from fras_common.topics import (
    EXECUTE,
    HOLD,
    RESUME,
    ROBOT_STATE,
    SA_CONTEXT,
    SA_TARGET,
    TASK,
    TASK_STATUS,
    VERDICT,
    WHY_NOT,
)
from fras_log.scan import Recorded, scan
from fras_sim.fem import TissueSimulator
from support.forging import Change, rewrite

ROOT = Path(__file__).parents[2]
HARD = Path(__file__).parent / "hard.toml"
Look = Callable[[TrialView], None]

NOISY = """\
seed = 25
[motion]
joint_noise_rad = 1e-5
insertion_noise_m = 1e-6
joint_delay_s = 0.03
[tissue]
node_counts = [11, 13, 2]
"""
# What is to be seen does not hang on the mesh: a coarse one is derived sooner.
COARSE = "11,13,2"
# A box over the block that scenario a grasps first: motion refuses it, and another is tried.
BOXED = """\
seed = 2
[planner]
criterion = "weighted"
[[motion.forbidden_boxes]]
lower_m = [0.085, 0.085, -0.01]
upper_m = [0.1, 0.105, 0.02]
"""
IMPATIENT = "seed = 2\n[run]\nhold_timeout_s = 0.5\n"


def audited(log: Path, *only: str) -> Report:
    return audit_log(log, only or SERVICES, lambda service, done, total: None)


def tally_of(report: Report, what: str) -> Tally:
    return next(tally for tally in report.tallies if tally.what == what)


def in_phase(view: TrialView, phase: str) -> bool:
    return (
        view.robot is not None
        and view.robot.action is not None
        and view.robot.action.phase == phase
    )


def once(happens: Callable[[TrialView], bool], do: Callable[[TrialView], None]) -> Look:
    """Do something the first time that something is seen."""
    done: list[int] = []

    def look(view: TrialView) -> None:
        if not done and happens(view):
            done.append(1)
            do(view)

    return look


def each(*looks: Look) -> Look:
    """Disturb one trial in several ways."""

    def look(view: TrialView) -> None:
        for one in looks:
            one(view)

    return look


def hold_and_lift(bus: Any) -> Look:
    """Hold in the middle of a descent, and lift the hold when the arms rest."""
    looks: list[int] = []

    def press(view: TrialView) -> None:
        looks.append(bus.query(HOLD, HoldRequest(holder="cli", reason="test"), 5.0).tick)

    press_once = once(lambda view: in_phase(view, "descend"), press)

    def look(view: TrialView) -> None:
        press_once(view)
        if looks and len(looks) < 3 and view.robot is not None and view.robot.tick > looks[0]:
            tick = view.robot.tick
            looks[1:] = [*(one for one in looks[1:] if one == tick), tick]
            if len(looks) == 3:
                bus.query(RESUME, ResumeRequest(holder="cli", by="cli"), 5.0)

    return look


def abort(bus: Any) -> Look:
    def ask(view: TrialView) -> None:
        assert view.robot is not None
        request = TaskRequest(command="abort", trial=view.robot.trial, reason="enough")
        assert bus.query(TASK, request, 5.0).accepted

    return once(lambda view: in_phase(view, "lift"), ask)


def ask_why_not(bus: Any) -> Look:
    def ask(view: TrialView) -> None:
        for question in ("b(1,1)", "release(psm1)"):
            assert bus.query(WHY_NOT, WhyNotRequest(question=question), 5.0).sentences

    return once(lambda view: in_phase(view, "traverse"), ask)


def visit(bus: Any) -> Look:
    """Ask what the executive asks, too, in the middle of its action."""

    def ask(view: TrialView) -> None:
        assert view.robot is not None
        trial, tick = view.robot.trial, view.robot.tick
        context = ContextRequest(trial=trial, request_id="visitor", min_tick=tick, expected=[])
        assert bus.query(SA_CONTEXT, context, 5.0).tick >= tick
        asked = TargetRequest(trial=trial, action="reach", arm="psm1", block="b(1,1)")
        target = bus.query(SA_TARGET, asked, 5.0).position_m
        goal = {"trial": trial, "goal_id": "visitor", "name": "reach", "arm": "psm1"}
        request = ExecuteRequest(**goal, block="b(1,1)", target_m=target)
        assert bus.query(EXECUTE, request, 5.0).reason == "busy"

    return once(lambda view: in_phase(view, "traverse"), ask)


@pytest.fixture(scope="module")
def logs(trials: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Trials of each kind, and of each way to end or to be disturbed."""
    folder = tmp_path_factory.mktemp("scenarios")
    written = {"noisy": NOISY, "impatient": IMPATIENT, "boxed": BOXED}
    for name, text in written.items():
        (folder / f"{name}.toml").write_text(text)
    bus = trials.stack.link.bus
    press = once(
        lambda view: in_phase(view, "lift"),
        lambda view: bus.query(HOLD, HoldRequest(holder="cli", reason="test"), 5.0),
    )
    disturb = each(ask_why_not(bus), visit(bus), hold_and_lift(bus))
    found = {
        "disturbed": trials.run("a", disturb, mesh=COARSE)[1],
        "crossed": trials.kept("b")[1],
        "released": trials.kept("c")[1],
        "hard": trials.kept(str(HARD))[1],
        "aborted": trials.run("a", abort(bus), mesh=COARSE)[1],
        "refused": trials.run(str(folder / "boxed.toml"), mesh=COARSE)[1],
        "noisy": trials.run(str(folder / "noisy.toml"))[1],
        "given_up": trials.run(str(folder / "impatient.toml"), press, mesh=COARSE)[1],
    }
    bus.query(RESUME, ResumeRequest(holder="cli", by="cli"), 5.0)
    return found


PER_TICK = ("verdicts", "robot states", "states")
KINDS = [
    *("disturbed", "crossed", "released", "hard", "aborted", "refused", "noisy", "given_up"),
]


@pytest.mark.parametrize("name", KINDS)
def test_a_trial_is_derived_again_to_the_last_bit(logs: dict[str, Path], name: str) -> None:
    report = audited(logs[name])
    assert [(tally.what, tally.first) for tally in report.tallies if tally.first] == []
    assert report.passed
    assert all(tally_of(report, what).compared > 100 for what in PER_TICK)
    assert sum(tally.tolerated for tally in report.tallies) == 0
    assert all(not tally.notes for tally in report.tallies)


def test_the_logs_hold_what_they_are_for(logs: dict[str, Path]) -> None:
    recorded = {name: read_recorded(log) for name, log in logs.items()}

    def end(name: str) -> TaskStatus:
        return [one for one in recorded[name].of(TASK_STATUS) if one.phase == "ended"][-1]

    assert [end(name).scenario_kind for name in ("disturbed", "crossed", "released")] == list("ABC")
    assert (end("aborted").outcome, end("aborted").reason) == ("aborted", "enough")
    assert (end("given_up").outcome, end("given_up").reason) == ("aborted", "hold:cli:test")
    disturbed = recorded["disturbed"]
    assert len(disturbed.mirrors(WHY_NOT)) == 2
    assert "busy" in {reply_of(EXECUTE, one).reason for one in disturbed.mirrors(EXECUTE)}
    assert any(one.holds for one in disturbed.of(ROBOT_STATE))
    assert "hard" in {one.level for one in recorded["hard"].of(VERDICT)}
    answers = [reply_of(EXECUTE, one) for one in recorded["refused"].mirrors(EXECUTE)]
    assert not answers[0].accepted
    assert answers[0].values
    assert answers[-1].accepted


# --- logs that lie ------------------------------------------------------------------------


def at_tick(tick: int, change: Change) -> Change:
    return lambda message: change(message) if message.tick == tick else message


def force(verdict: Verdict) -> Verdict:
    return msgspec.structs.replace(verdict, max_force_n=math.nextafter(verdict.max_force_n, 1.0))


def level(verdict: Verdict) -> Verdict:
    return msgspec.structs.replace(verdict, level="soft", ok=False)


def fluent(context: Context) -> Context:
    if context.request_id != "c2":
        return context
    fluents = [one for one in context.fluents if not one.startswith("at(")]
    assert fluents != context.fluents
    return msgspec.structs.replace(context, fluents=fluents)


def action(plan: Plan) -> Plan:
    if plan.request_id != "c1":
        return plan
    first = msgspec.structs.replace(plan.actions[0], text="reach(psm1,b(1,1))")
    return msgspec.structs.replace(plan, actions=[first, *plan.actions[1:]])


def setpoint(state: RobotState) -> RobotState:
    arm = state.arms["psm1"]
    joints = (*arm.setpoint_joints[:2], arm.setpoint_joints[2] + 1e-12, *arm.setpoint_joints[3:])
    moved = msgspec.structs.replace(arm, setpoint_joints=joints)
    return msgspec.structs.replace(state, arms={**state.arms, "psm1": moved})


def held_by_nobody(state: RobotState) -> RobotState:
    """Nobody asked for it: no message of motion's tells this hold."""
    return msgspec.structs.replace(state, holds={"page": "stop"})


def moved(array: Array, row: int, by: float) -> Array:
    values = array.view().copy()
    values[row, 1] += by
    return msgspec.structs.replace(array, data=values.tobytes())


def node(state: TissueState) -> TissueState:
    return msgspec.structs.replace(state, nodes_m=moved(state.nodes_m, 7, 1e-7))


def velocity(checkpoint: SimCheckpoint) -> SimCheckpoint:
    changed = moved(checkpoint.velocity_m_s, 9, 1e-15)
    return msgspec.structs.replace(checkpoint, velocity_m_s=changed)


def outcome(result: ActionResult) -> ActionResult:
    if result.goal_id != "g3":
        return result
    return msgspec.structs.replace(result, outcome="succeeded", reason="")


def replans(status: TaskStatus) -> TaskStatus:
    if status.phase != "ended":
        return status
    return msgspec.structs.replace(status, replans=status.replans + 1)


def refused(mirror: RpcRecord) -> RpcRecord:
    if msgspec.msgpack.decode(mirror.request)["goal_id"] != "g2":
        return mirror
    reply = msgspec.Raw(encode({"accepted": False, "reason": "unreachable"}))
    return msgspec.structs.replace(mirror, reply=reply)


FORGERIES: list[tuple[str, str, Change, str, str, str]] = [
    ("sa/verdict", "sa", at_tick(60, force), "verdicts", "tick 60", "max_force_n"),
    ("sa/verdict", "sa", at_tick(70, level), "verdicts", "tick 70", "level"),
    ("sa/context", "sa", fluent, "contexts", "context c2", "fluents["),
    ("planner/plan", "planner", action, "plans", "plan for c1 at tick 0", "actions[0].text"),
    ("planner/task_status", "planner", replans, "task statuses", "ended", "replans"),
    (
        "robot/state",
        "motion",
        at_tick(50, setpoint),
        "robot states",
        "tick 50",
        "arms.psm1.setpoint_joints[2]",
    ),
    ("motion/action_result", "motion", outcome, "results", "result of g3", "outcome"),
    ("sim/tissue_state", "sim", at_tick(60, node), "states", "tick 60", "nodes_m[7][1]"),
    (
        "sim/checkpoint",
        "sim",
        at_tick(80, velocity),
        "checkpoints",
        "tick 80",
        "velocity_m_s[9][1]",
    ),
]


@pytest.mark.parametrize(("key", "service", "change", "what", "where", "path"), FORGERIES)
def test_a_lie_is_found_where_it_stands(
    logs: dict[str, Path],
    tmp_path: Path,
    key: str,
    service: str,
    change: Change,
    what: str,
    where: str,
    path: str,
) -> None:
    # What the tissue did is derived sooner on a coarse mesh.
    told = logs["noisy" if service == "sim" else "crossed"]
    log = rewrite(told, tmp_path / "forged.mcap", key, change)
    report = audited(log, service)
    assert not report.passed
    differing = {tally.what: tally.differences for tally in report.tallies if tally.differences}
    if key == "planner/plan":
        # What was done by the plan, as the executive told it, contradicts it now.
        assert differing.pop("task statuses") > 1
    assert differing == {what: 1}
    first = tally_of(report, what).first
    assert first is not None
    assert where in first.where
    assert first.path.startswith(path)
    assert first.recorded != first.derived
    assert first.seq >= 0


def test_an_answer_to_a_goal_that_motion_did_not_give(
    logs: dict[str, Path], tmp_path: Path
) -> None:
    log = rewrite(logs["crossed"], tmp_path / "forged.mcap", "rpc/motion/execute", refused)
    report = audited(log, "motion")
    assert not report.passed
    first = tally_of(report, "goals").first
    assert first is not None
    assert (first.path, first.recorded, first.derived) == ("accepted", False, True)
    assert any("answered otherwise" in note for note in tally_of(report, "robot states").notes)


def of_no_block(mirror: RpcRecord) -> RpcRecord:
    asked = decode(TargetRequest, bytes(mirror.request), mirror.key)
    forged = msgspec.structs.replace(asked, action="reach", block="b(99,99)")
    return msgspec.structs.replace(mirror, request=msgspec.Raw(encode(forged)))


def test_a_target_of_a_block_that_there_is_not(logs: dict[str, Path], tmp_path: Path) -> None:
    log = rewrite(logs["disturbed"], tmp_path / "forged.mcap", "rpc/sa/target", of_no_block)
    targets = tally_of(audited(log, "sa"), "targets")
    assert targets.first is not None
    assert "refused again" in str(targets.first)
    assert "b(99,99)" in str(targets.first)


def test_a_hold_that_nobody_asked_for(logs: dict[str, Path], tmp_path: Path) -> None:
    forged = at_tick(55, held_by_nobody)
    log = rewrite(logs["crossed"], tmp_path / "forged.mcap", "robot/state", forged)
    tally = tally_of(audited(log, "motion"), "holds shown")
    assert tally.differences == 1
    assert tally.first is not None
    assert (tally.first.where, tally.first.path) == ("tick 55", "page")


def test_a_state_left_out_is_told_and_what_follows_is_not_derived(
    logs: dict[str, Path], tmp_path: Path
) -> None:
    log = rewrite(
        logs["crossed"], tmp_path / "gap.mcap", "robot/state", at_tick(40, lambda state: None)
    )
    report = audited(log)
    assert not report.passed
    assert report.gaps == {"robot/state": 1}
    assert all(tally.differences == 0 for tally in report.tallies)
    for what in ("verdicts", "robot states", "states"):
        tally = tally_of(report, what)
        assert tally.compared == 40
        assert tally.skipped > 100
        assert any("from tick 40 on" in note for note in tally.notes)


def test_a_verdict_left_out_is_missed(logs: dict[str, Path], tmp_path: Path) -> None:
    log = rewrite(
        logs["crossed"], tmp_path / "gap.mcap", "sa/verdict", at_tick(40, lambda verdict: None)
    )
    report = audited(log, "sa", "motion")
    assert tally_of(report, "verdicts").differences == 1
    first = tally_of(report, "verdicts").first
    assert first is not None
    assert (first.where, first.recorded) == ("tick 40", "nothing")
    assert any("no verdict on tick 40" in note for note in tally_of(report, "robot states").notes)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.7, 0.99])
def test_a_log_that_is_cut_is_audited_as_far_as_it_goes(
    logs: dict[str, Path], tmp_path: Path, share: float
) -> None:
    data = logs["crossed"].read_bytes()
    # Of what is recorded: the rules that are attached stand before it, and are not compressed.
    first = next(one.offset for one in scan(logs["crossed"]) if isinstance(one, Recorded))
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: first + int(share * (len(data) - first))])
    report = audited(cut)
    assert report.damage
    assert not report.passed
    assert all(tally.differences == 0 for tally in report.tallies)
    assert tally_of(report, "states").compared >= 100 * share


def test_an_audit_leaves_the_log_as_it_is(logs: dict[str, Path]) -> None:
    def digest() -> str:
        return hashlib.sha256(logs["disturbed"].read_bytes()).hexdigest()

    before = digest()
    audited(logs["disturbed"], "motion")
    assert digest() == before
    assert not [
        one for one in logs["disturbed"].parent.iterdir() if one.name.startswith("audit.mcap.")
    ]


# --- logs of other machines, other arms, other rules ----------------------------------------


def of_other_build(health: Health) -> Health:
    return msgspec.structs.replace(health, facts={**health.facts, "build": "another machine"})


@pytest.mark.parametrize(("by", "tolerated", "differs"), [(1e-4, 1, 0), (4e-4, 0, 1)])
def test_numbers_of_another_build_may_differ_by_the_tolerance(
    logs: dict[str, Path], tmp_path: Path, by: float, tolerated: int, differs: int
) -> None:
    def shifted(state: TissueState) -> TissueState:
        return msgspec.structs.replace(state, nodes_m=moved(state.nodes_m, 7, by))

    elsewhere = rewrite(logs["noisy"], tmp_path / "1.mcap", "health/sim", of_other_build)
    log = rewrite(elsewhere, tmp_path / "2.mcap", "sim/tissue_state", at_tick(60, shifted))
    tally = tally_of(audited(log, "sim"), "states")
    assert (tally.tolerated, tally.differences) == (tolerated, differs)
    assert any("another build (another machine)" in note for note in tally.notes)


def test_another_linear_solver_stays_within_the_tolerance(
    logs: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "fras_sim.adapter.TissueSimulator", partial(TissueSimulator, solver="scipy")
    )
    report = audited(logs["noisy"], "sim")
    states = tally_of(report, "states")
    assert "linear solver scipy-single, derived with scipy" in states.notes[0]
    assert states.tolerated > 100
    assert [tally.first for tally in report.tallies if tally.first] == []
    assert report.passed


def test_what_other_arms_measured_is_taken_as_recorded(
    logs: dict[str, Path], tmp_path: Path
) -> None:
    def by_other_arms(state: JointState) -> JointState:
        return msgspec.structs.replace(state, source="arms/1")

    def faster(state: RobotState) -> RobotState:
        arm = state.arms["psm1"]
        fast = msgspec.structs.replace(arm, joint_velocities=(0.1,) * 6)
        return msgspec.structs.replace(state, arms={**state.arms, "psm1": fast})

    log = rewrite(logs["crossed"], tmp_path / "1.mcap", "psm1/measured_js", by_other_arms)
    measured = rewrite(log, tmp_path / "2.mcap", "robot/state", at_tick(50, faster))
    report = audited(measured, "motion")
    assert report.passed
    assert any("driven by arms" in note for note in tally_of(report, "robot states").notes)
    sent = rewrite(log, tmp_path / "3.mcap", "robot/state", at_tick(50, setpoint))
    assert tally_of(audited(sent, "motion"), "robot states").differences == 1


def test_other_rules_are_asked_in_the_recorded_situations(
    logs: dict[str, Path], tmp_path: Path
) -> None:
    same = decide_by(read_recorded(logs["crossed"]), ROOT / "asp")
    assert len(same.all) == 3
    assert same.differing == ()
    rules = tmp_path / "rules"
    shutil.copytree(ROOT / "asp", rules)
    shutil.copy(rules / "preferences" / "sum.lp", rules / "preferences" / "weighted.lp")
    other = decide_by(read_recorded(logs["crossed"]), rules)
    assert other.asp_digest != same.asp_digest
    (first, *_) = other.differing
    assert (first.request_id, first.tick, first.reason) == ("c1", 0, "initial")
    assert first.recorded[0].startswith("reach(")
    assert first.other[0].startswith("reach(")
    assert first.recorded != first.other
    assert first.other_why


def test_plans_of_other_rules_are_told(logs: dict[str, Path], tmp_path: Path) -> None:
    def by_other_rules(plan: Plan) -> Plan:
        return msgspec.structs.replace(plan, asp_digest="0123456789abcdef")

    log = rewrite(logs["crossed"], tmp_path / "other.mcap", "planner/plan", by_other_rules)
    report = audited(log, "planner")
    plans = tally_of(report, "plans")
    assert plans.first is not None
    assert plans.first.path == "asp_digest"
    assert any("by other rules (digest 0123456789ab)" in note for note in plans.notes)


# --- as `fras audit` tells it ----------------------------------------------------------------


def told(run: Callable[[Console], int]) -> tuple[int, str]:
    text = io.StringIO()
    status = run(Console(file=text, width=160))
    return status, text.getvalue()


def test_the_command_ends_with_0_where_all_is_equal(logs: dict[str, Path]) -> None:
    status, text = told(
        lambda console: audit(logs["crossed"], "sa,planner", as_json=False, console=console)
    )
    assert status == 0
    assert "all equal" in text
    assert "motion" not in text


def test_the_command_shows_both_values_side_by_side(logs: dict[str, Path], tmp_path: Path) -> None:
    log = rewrite(logs["crossed"], tmp_path / "1.mcap", "sa/verdict", at_tick(70, level))
    status, text = told(lambda console: audit(log, "sa", as_json=False, console=console))
    assert status == 1
    assert "sa, verdicts: first difference in tick 70" in text
    assert text.index("recorded  soft") < text.index("derived   ok")
    assert "1 differ." in text


def test_the_command_as_json(
    logs: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = rewrite(logs["crossed"], tmp_path / "1.mcap", "robot/state", at_tick(50, setpoint))
    status, _ = told(lambda console: audit(log, "motion", as_json=True, console=console))
    found = json.loads(capsys.readouterr().out)
    assert (status, found["passed"]) == (1, False)
    (states,) = [one for one in found["tallies"] if one["what"] == "robot states"]
    assert states["differences"] == 1
    assert states["first_difference"]["field"] == "arms.psm1.setpoint_joints[2]"


def test_the_command_tells_a_log_that_is_cut(logs: dict[str, Path], tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(logs["crossed"].read_bytes()[:-2000])
    status, text = told(lambda console: audit(cut, "planner", as_json=False, console=console))
    assert status == 1
    assert "The log is cut" in text


def test_the_command_refuses_what_is_no_service(logs: dict[str, Path]) -> None:
    with pytest.raises(UnknownService, match="sa, planner, motion, sim") as caught:
        audit(logs["crossed"], "sa,recorder", as_json=False, console=Console(file=io.StringIO()))
    assert exit_status(caught.value) == 2


def test_the_command_tells_what_other_rules_would_have_decided(
    logs: dict[str, Path], tmp_path: Path
) -> None:
    rules = tmp_path / "rules"
    shutil.copytree(ROOT / "asp", rules)
    shutil.copy(rules / "preferences" / "nearest.lp", rules / "preferences" / "weighted.lp")
    status, text = told(
        lambda console: other_rules(logs["crossed"], rules, as_json=False, console=console)
    )
    assert status == 0
    assert "3 decisions asked for again" in text
    (rules / "goal.lp").write_text("goal(")
    status, text = told(
        lambda console: other_rules(logs["crossed"], rules, as_json=False, console=console)
    )
    assert status == 2
    assert "goal.lp" in text
