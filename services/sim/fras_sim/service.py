"""The simulator's shell: one robot state in, one step, one tissue state out."""

import time

import msgspec

from fras_common.codec import content_digest
from fras_common.messages import ResetReply, ResetRequest, RobotState, TissueState
from fras_common.service import ServiceHost
from fras_common.topics import ROBOT_STATE, SIM_CHECKPOINT, SIM_RESET, TISSUE_MODEL, TISSUE_STATE
from fras_sim.adapter import (
    build_simulator,
    checkpoint_message,
    tissue_model,
    tissue_state,
    tools_of,
)
from fras_sim.fem import BadToolInput, FemError, TissueSimulator, compile_kernels


class SimService:
    """Follows the robot tick by tick; logical time, no clock of its own."""

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        self._simulator: TissueSimulator | None = None
        self._last: TissueState | None = None
        began_s = time.perf_counter()
        compile_kernels()
        host.log.info("kernels loaded", took_s=round(time.perf_counter() - began_s, 3))
        self._model = host.publisher(TISSUE_MODEL)
        self._state = host.publisher(TISSUE_STATE)
        self._checkpoint = host.publisher(SIM_CHECKPOINT)
        host.subscribe(ROBOT_STATE, self._on_robot)
        host.serve(SIM_RESET, self._reset)

    def _reset(self, request: ResetRequest) -> ResetReply:
        self._simulator = build_simulator(request.scenario, request.mesh)
        self._last = None
        solver = self._simulator.solver_name
        self._host.facts["linear_solver"] = solver
        self._host.log.info("tissue at rest", trial=request.trial, linear_solver=solver)
        self._model.put(tissue_model(self._simulator, request.scenario, request.trial))
        self._host.enter_trial(request.trial)
        return ResetReply(digest=content_digest(request.trial, request.scenario, request.mesh))

    def _on_robot(self, robot: RobotState) -> None:
        simulator, last = self._simulator, self._last
        if simulator is None:
            return
        reached = last.tick if last is not None else -1
        if last is not None and robot.tick == reached:
            # Asked again for the same tick: the same answer again.
            self._state.put(last)
        elif robot.tick != reached + 1:
            self._host.counts["gaps"] += 1
            self._host.log.warning("tick out of order, not stepped", tick=robot.tick, at=reached)
        else:
            self._advance(simulator, robot)

    def _advance(self, simulator: TissueSimulator, robot: RobotState) -> None:
        began_s = time.perf_counter()
        tools = tools_of(robot)
        try:
            result = simulator.step(tools) if robot.tick > 0 else simulator.measure(tools)
        except BadToolInput:
            # The host says so on the bus; the tissue is as it was, and the tick still to come.
            raise
        except FemError as error:
            self._host.log.error("step failed, state kept", tick=robot.tick, problem=str(error))
            self._keep_state(robot.tick)
            return
        wall_s = time.perf_counter() - began_s
        if not result.solver.converged:
            self._host.log.error(
                "step not converged, state kept",
                tick=robot.tick,
                iterations=result.solver.iterations,
                residual=result.solver.residual,
            )
        self._last = tissue_state(result, robot.tick, robot.trial, wall_s)
        self._host.tick = robot.tick
        self._state.put(self._last)
        if robot.tick > 0 and simulator.checkpoint_due:
            self._checkpoint.put(checkpoint_message(simulator.checkpoint(), robot.trial))

    def _keep_state(self, tick: int) -> None:
        """Answer for `tick` with the state before it, as one that did not converge."""
        if self._last is None:
            return
        report = msgspec.structs.replace(self._last.solver, converged=False)
        self._last = msgspec.structs.replace(self._last, tick=tick, solver=report)
        self._state.put(self._last)

    def wake(self) -> float | None:
        """Nothing is due by time: the robot is the clock."""
        return None

    def close(self) -> None:
        """Nothing to put in order."""
