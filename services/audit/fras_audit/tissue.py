"""A tissue again, model or patient: every state and checkpoint, from recorded robot states."""

import math
import time

import msgspec

from fras_audit.builds import other_build
from fras_audit.comparison import Tally, Tolerance
from fras_audit.progress import Progress
from fras_audit.recorded import Recorded
from fras_audit.ticks import by_tick
from fras_common.errors import FrasError
from fras_common.messages import RobotState, SimCheckpoint, TissueState
from fras_common.topics import ROBOT_STATE, TissueTopics
from fras_sim.fem import compile_kernels
from fras_sim.trial import Step, TissueTrial

# What another build, processor or linear solver may differ by within ten ticks: three to six times
# what other solvers did (docs/audit.md).
POSITION_M = 2e-4
FORCE_N = 5e-4
SPEED_M_S = 5e-3
ELSEWHERE = Tolerance(
    1e-9,
    {
        "nodes_m": POSITION_M,
        "velocity_m_s": SPEED_M_S,
        "max_node_speed_m_s": SPEED_M_S,
        "nodal_force_n": FORCE_N,
        "max_force_n": FORCE_N,
        "tool_force_n": FORCE_N,
        "grasped_force_n": FORCE_N,
        "patch_force_n": FORCE_N,
        "support_n": FORCE_N,
        "arms": POSITION_M,
        # How it was solved is the solver's own affair; whether it was is not.
        "balance_residual_n": math.inf,
        "solver.iterations": math.inf,
        "solver.residual": math.inf,
        "solver.refactored": math.inf,
        "solver.inverted_elements": math.inf,
    },
)


def audit_tissue(recorded: Recorded, progress: Progress, topics: TissueTopics) -> list[Tally]:
    """Derive a tissue, tick by tick.

    Parameters
    ----------
    recorded : Recorded
    progress : callable
    topics : TissueTopics
        Whose it is.

    Returns
    -------
    list of Tally
        Models, states, checkpoints.
    """
    name = topics.service
    models = Tally(name, "models", len(recorded.of(topics.model)))
    states = Tally(name, "states", len(recorded.of(topics.state)))
    checkpoints = Tally(name, "checkpoints", len(recorded.of(topics.checkpoint)))
    tallies = [models, states, checkpoints]
    reset = recorded.reset(topics.reset)
    if reset is None:
        _stop(tallies, f"nothing derived: the log lacks the reset of {name}, and so its mesh")
        return tallies
    compile_kernels()
    try:
        trial = TissueTrial(recorded.trial, reset.scenario, reset.mesh, time.perf_counter)
    except FrasError as error:
        _stop(tallies, f"nothing derived: no tissue can be made of the reset: {error}")
        return tallies
    if why := _elsewhere(recorded, trial, name):
        _stop(tallies, f"{why}: equal means within the tolerance of docs/audit.md")
        for tally in tallies:
            tally.tolerance = ELSEWHERE
    for model in recorded.of(topics.model):
        models.compare_messages("at rest", model, trial.model())
    _follow(recorded, topics, trial, states, checkpoints, progress)
    return tallies


def _elsewhere(recorded: Recorded, trial: TissueTrial, name: str) -> str:
    solver = recorded.facts(name).get("linear_solver", trial.solver_name)
    if solver != trial.solver_name:
        return f"recorded with linear solver {solver}, derived with {trial.solver_name}"
    return other_build(recorded, name)


def _follow(
    recorded: Recorded,
    topics: TissueTopics,
    trial: TissueTrial,
    states: Tally,
    checkpoints: Tally,
    progress: Progress,
) -> None:
    robots = recorded.of(ROBOT_STATE)
    said = by_tick(recorded.of(topics.state))
    kept = by_tick(recorded.of(topics.checkpoint))
    for number, robot in enumerate(robots, start=1):
        if robot.tick > trial.tick + 1:
            lost = trial.tick + 1
            _stop([states, checkpoints], f"not derived from tick {lost} on: no robot/state of it")
            return
        if (step := _step(trial, robot)) is not None:
            _compare(step, robot, said, states, whole=not recorded.damage)
            _compare_checkpoint(step, kept, checkpoints)
            if states.tolerance is not None and robot.tick in kept:
                # On another build each ten ticks begin as recorded, so that nothing adds up.
                trial.restore(kept[robot.tick][0])
        progress(topics.service, number, len(robots))
    _beyond(trial, said, states)


def _step(trial: TissueTrial, robot: RobotState) -> Step | None:
    """Follow a robot state; None where sim refused it, or answered for its tick before."""
    if robot.tick <= trial.tick:
        return None
    try:
        return trial.follow(robot)
    except FrasError:
        # It refuses again what it refused then: no state of this tick is recorded either.
        return None


def _compare(
    step: Step, robot: RobotState, said: dict[int, list[TissueState]], states: Tally, *, whole: bool
) -> None:
    """Compare what was said of a tick, however often; it is always the same answer."""
    where = f"tick {robot.tick}"
    answers = said.get(robot.tick, [])
    for answer in answers:
        if step.state is None:
            states.surplus(where, f"a state; refused again: {step.problem}", answer.seq)
        else:
            states.compare_messages(where, _untimed(answer), _untimed(step.state))
    if not answers and step.state is not None and whole:
        states.lacks(where, f"a state, its largest force {step.state.max_force_n:.3f} N")


def _compare_checkpoint(step: Step, kept: dict[int, list[SimCheckpoint]], tally: Tally) -> None:
    if step.state is None:
        return
    for checkpoint in kept.get(step.state.tick, []):
        where = f"tick {checkpoint.tick}"
        if step.checkpoint is None:
            tally.surplus(where, "a checkpoint", checkpoint.seq)
        else:
            tally.compare_messages(where, checkpoint, step.checkpoint)


def _beyond(trial: TissueTrial, said: dict[int, list[TissueState]], states: Tally) -> None:
    late = [tick for tick in said if tick > trial.tick]
    if late:
        where = f"{min(late)} to {max(late)}"
        states.notes.append(f"ticks {where} not derived: no robot/state of them in the log")


def _untimed(state: TissueState) -> TissueState:
    """Return a state without the wall-clock time that its solution took."""
    solver = msgspec.structs.replace(state.solver, wall_s=0.0)
    return msgspec.structs.replace(state, solver=solver)


def _stop(tallies: list[Tally], why: str) -> None:
    for tally in tallies:
        tally.notes.append(why)
