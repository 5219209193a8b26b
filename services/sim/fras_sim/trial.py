"""One trial as the simulator sees it: robot states in, tissue states out, no bus."""

from collections.abc import Callable
from dataclasses import dataclass

import msgspec

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

    def restore(self, checkpoint: SimCheckpoint) -> None:
        """Go on from a checkpoint of this trial, its tick the last one answered.

        Raises
        ------
        BadParameter
            If it belongs to another mesh.
        """
        self._simulator.restore(checkpoint_of(checkpoint))

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
        """
        if self._last is not None and robot.tick == self._last.tick:
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
            return self._keep_state(robot.tick, str(error))
        self._last = tissue_state(result, robot.tick, robot.trial, self._clock() - began_s)
        due = robot.tick > 0 and simulator.checkpoint_due
        checkpoint = checkpoint_message(simulator.checkpoint(), robot.trial) if due else None
        solver = result.solver
        problem = ""
        if not solver.converged:
            problem = f"not converged: {solver.iterations} iterations, {solver.residual:.3g} N left"
        return Step(self._last, checkpoint, problem)

    def _keep_state(self, tick: int, problem: str) -> Step:
        """Answer for `tick` with the state before it, as one that did not converge."""
        if self._last is None:
            return Step(None, problem=problem)
        report = msgspec.structs.replace(self._last.solver, converged=False)
        self._last = msgspec.structs.replace(self._last, tick=tick, solver=report)
        return Step(self._last, problem=problem)
