"""One trial as the simulator sees it: robot states in, tissue states out, no bus."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import msgspec

from fras_common.errors import FrasError
from fras_common.messages import RobotState, SimCheckpoint, TissueModel, TissueState
from fras_common.scenario import Scenario
from fras_sim.adapter import (
    build_simulator,
    checkpoint_message,
    checkpoint_of,
    tissue_model,
    tissue_state,
    tools_of,
)
from fras_sim.fem import BadToolInput, FemError


class ContradictoryTick(FrasError):
    """A tick was said again with the arms elsewhere: what was answered does not belong to it."""


@dataclass(frozen=True)
class Step:
    """What a robot state led to.

    Parameters
    ----------
    state : TissueState or None
        To publish; None where not even the first could be computed.
    checkpoint : SimCheckpoint or None
        To publish behind it.
    problem : str
        Why the tissue stays as it was; empty if it moved on.
    """

    state: TissueState | None
    checkpoint: SimCheckpoint | None = None
    problem: str = ""


class TissueTrial:
    """The tissue of one trial.

    Parameters
    ----------
    trial : str
        Its name.
    scenario : Scenario
        Resolved.
    mesh : bytes
        Content of the mesh file that it names.
    clock : callable
        Returns seconds, for `wall_s` only.

    Raises
    ------
    UnresolvedScenario, MeshMismatch, ScenarioError, MeshFileError, BadMesh
        See `build_simulator`.
    """

    def __init__(
        self, trial: str, scenario: Scenario, mesh: bytes, clock: Callable[[], float]
    ) -> None:
        self._simulator = build_simulator(scenario, mesh)
        self._trial = trial
        self._scenario = scenario
        self._clock = clock
        self._last: TissueState | None = None
        self._followed: RobotState | None = None

    @property
    def solver_name(self) -> str:
        """Name of the linear solver in use."""
        return self._simulator.solver_name

    @property
    def tick(self) -> int:
        """The last tick answered; -1 before the first."""
        return self._last.tick if self._last is not None else -1

    def model(self) -> TissueModel:
        """Describe the tissue at rest."""
        return tissue_model(self._simulator, self._scenario, self._trial)

    def restore(self, checkpoint: SimCheckpoint, said: TissueState | None = None) -> None:
        """Go on from a checkpoint of this trial.

        Parameters
        ----------
        checkpoint : SimCheckpoint
        said : TissueState, optional
            What was answered at its tick; without it that is the last one answered here.

        Raises
        ------
        BadParameter
            If it belongs to another mesh.
        """
        self._simulator.restore(checkpoint_of(checkpoint))
        if said is not None:
            self._last, self._followed = said, None

    def resume(
        self,
        checkpoints: Sequence[SimCheckpoint],
        said: Sequence[TissueState],
        robots: Sequence[RobotState],
    ) -> list[Step]:
        """Come to where the simulator before this one was, from what both sides have said.

        Parameters
        ----------
        checkpoints : sequence of SimCheckpoint
            The last ones.
        said : sequence of TissueState
            The last answers.
        robots : sequence of RobotState
            From the tick after one of the checkpoints on, or from tick 0 on.

        Returns
        -------
        list of Step
            To publish: what nobody is known to have heard, and the last answer in any case.

        Notes
        -----
        At a checkpoint's tick every run drops the factor and the memory of the solver, so the ticks
        after it come out the same to the last bit. A tick that was answered gets that answer again.
        """
        answers = {state.tick: state for state in said}
        arms: dict[int, RobotState] = {}
        for robot in robots:
            arms.setdefault(robot.tick, robot)
        last = max(arms, default=-1)
        # Not one of the last tick: its answer would have to be taken on trust.
        usable = [one for one in checkpoints if one.tick in answers and one.tick < last]
        if usable:
            start = max(usable, key=lambda one: one.tick)
            self.restore(start, answers[start.tick])
        steps: list[Step] = []
        while (robot := arms.get(self.tick + 1)) is not None:
            try:
                step = self.follow(robot)
            except BadToolInput:
                # It was refused then, too: the tick is still to come.
                break
            if step is None or step.state is None:
                break
            if robot.tick in answers:
                self._last = answers[robot.tick]
                step = Step(self._last, step.checkpoint)
            if robot.tick not in answers or robot.tick == last:
                steps.append(step)
        return steps

    def follow(self, robot: RobotState) -> Step | None:
        """Move on to the robot's tick; the same tick again gets the same answer again.

        Returns
        -------
        Step or None
            None for a tick that is not the next one: a gap is never guessed.

        Raises
        ------
        BadToolInput
            The tissue is as it was, and the tick still to come.
        ContradictoryTick
            The tick was answered, for arms that were elsewhere.
        """
        if self._last is not None and robot.tick == self._last.tick:
            self._require_same(robot)
            return Step(self._last)
        if robot.tick != self.tick + 1:
            return None
        began_s = self._clock()
        tools = tools_of(robot)
        simulator = self._simulator
        try:
            result = simulator.step(tools) if robot.tick > 0 else simulator.measure(tools)
        except BadToolInput:
            raise
        except FemError as error:
            self._followed = robot
            return self._keep_state(robot.tick, str(error))
        self._followed = robot
        self._last = tissue_state(result, robot.tick, robot.trial, self._clock() - began_s)
        due = robot.tick > 0 and simulator.checkpoint_due
        checkpoint = checkpoint_message(simulator.checkpoint(), robot.trial) if due else None
        solver = result.solver
        problem = ""
        if not solver.converged:
            problem = f"not converged: {solver.iterations} iterations, {solver.residual:.3g} N left"
        return Step(self._last, checkpoint, problem)

    def _require_same(self, robot: RobotState) -> None:
        followed = self._followed
        if followed is None:
            return
        for arm, state in followed.arms.items():
            again = robot.arms.get(arm)
            if again is None or (again.tip_in_world, again.jaw_rad) != (
                state.tip_in_world,
                state.jaw_rad,
            ):
                raise ContradictoryTick(
                    f"tick {robot.tick} was answered with {arm} elsewhere: whoever says it again "
                    "has lost what it said; end the trial",
                    tick=robot.tick,
                    arm=arm,
                )

    def _keep_state(self, tick: int, problem: str) -> Step:
        """Answer for `tick` with the state before it, as one that did not converge."""
        if self._last is None:
            return Step(None, problem=problem)
        report = msgspec.structs.replace(self._last.solver, converged=False)
        self._last = msgspec.structs.replace(self._last, tick=tick, solver=report)
        return Step(self._last, problem=problem)
