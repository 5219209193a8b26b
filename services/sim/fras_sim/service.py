"""The simulator's shell: one robot state in, one step, one tissue state out."""

import time

from fras_common.codec import content_digest
from fras_common.messages import ResetReply, ResetRequest, RobotState
from fras_common.service import ServiceHost
from fras_common.topics import ROBOT_STATE, SIM_CHECKPOINT, SIM_RESET, TISSUE_MODEL, TISSUE_STATE
from fras_sim.fem import compile_kernels
from fras_sim.trial import TissueTrial


class SimService:
    """Follows the robot tick by tick; logical time, no clock of its own."""

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        self._trial: TissueTrial | None = None
        began_s = time.perf_counter()
        compile_kernels()
        host.log.info("kernels loaded", took_s=round(time.perf_counter() - began_s, 3))
        self._model = host.publisher(TISSUE_MODEL)
        self._state = host.publisher(TISSUE_STATE)
        self._checkpoint = host.publisher(SIM_CHECKPOINT)
        host.subscribe(ROBOT_STATE, self._on_robot)
        host.serve(SIM_RESET, self._reset)

    def _reset(self, request: ResetRequest) -> ResetReply:
        trial = TissueTrial(request.trial, request.scenario, request.mesh, time.perf_counter)
        self._trial = trial
        self._host.facts["linear_solver"] = trial.solver_name
        self._host.log.info("tissue at rest", trial=request.trial, linear_solver=trial.solver_name)
        self._model.put(trial.model())
        self._host.enter_trial(request.trial)
        return ResetReply(digest=content_digest(request.trial, request.scenario, request.mesh))

    def _on_robot(self, robot: RobotState) -> None:
        trial = self._trial
        if trial is None:
            return
        reached = trial.tick
        # A pose that is refused: the host says so on the bus, and the tick is still to come.
        step = trial.follow(robot)
        if step is None:
            self._host.counts["gaps"] += 1
            self._host.log.warning("tick out of order, not stepped", tick=robot.tick, at=reached)
            return
        if step.problem:
            self._host.log.error("state kept", tick=robot.tick, problem=step.problem)
        if step.state is None:
            return
        self._host.tick = robot.tick
        self._state.put(step.state)
        if step.checkpoint is not None:
            self._checkpoint.put(step.checkpoint)

    def wake(self) -> float | None:
        """Nothing is due by time: the robot is the clock."""
        return None

    def close(self) -> None:
        """Nothing to put in order."""
