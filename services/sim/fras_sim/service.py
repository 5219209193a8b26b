"""The simulator's shell: one robot state in, one step, one tissue state out."""

import time

from fras_common.codec import content_digest
from fras_common.messages import ResetReply, ResetRequest, RobotState
from fras_common.scenario import check
from fras_common.service import ServiceHost
from fras_common.service.gate import TrialGate
from fras_common.service.recall import Recall
from fras_common.topics import PATIENT, ROBOT_STATE, TWIN, TissueTopics
from fras_sim.fem import compile_kernels
from fras_sim.resumption import TakenUp, new_trial, take_up
from fras_sim.trial import Step, TissueTrial


class SimService:
    """Follows the robot tick by tick; logical time, no clock of its own.

    Parameters
    ----------
    host : ServiceHost
    topics : TissueTopics
        Where it speaks: as the model of the tissue, or as the patient.
    """

    def __init__(self, host: ServiceHost, topics: TissueTopics = TWIN) -> None:
        self._host = host
        self._topics = topics
        self._trial: TissueTrial | None = None
        self._request: ResetRequest | None = None
        began_s = time.perf_counter()
        compile_kernels()
        host.log.info("kernels loaded", took_s=round(time.perf_counter() - began_s, 3))
        self._model = host.publisher(topics.model)
        self._state = host.publisher(topics.state)
        self._checkpoint = host.publisher(topics.checkpoint)
        host.subscribe(ROBOT_STATE, self._on_robot)
        host.serve(topics.reset, self._reset)
        self._recall = Recall(host, take_up(topics), self._take_up)

    def _reset(self, request: ResetRequest) -> ResetReply:
        check(request.scenario)
        self._recall.give_up()
        # Asked again because an answer was lost: nothing has happened since that would be undone.
        if self._trial is None or self._trial.tick > 0 or request != self._request:
            self._begin(request, new_trial(request))
            self._host.enter_trial(request.trial)
        return ResetReply(digest=content_digest(request.trial, request.scenario, request.mesh))

    def _begin(self, request: ResetRequest, trial: TissueTrial) -> None:
        self._trial, self._request = trial, request
        self._host.facts["linear_solver"] = trial.solver_name
        self._host.log.info("tissue at rest", trial=request.trial, linear_solver=trial.solver_name)
        self._model.put(trial.model())

    def _take_up(self, taken: TakenUp | None) -> None:
        if taken is None:
            return
        self._begin(taken.asked.request, taken.trial)
        # This process speaks for what the one before it was told.
        self._host.publish_mirror(self._topics.reset, taken.asked.record)
        for step in taken.steps:
            self._publish(step)
        name, tick = taken.asked.request.trial, taken.trial.tick
        self._host.log.warning("trial taken up", trial=name, tick=tick)
        self._host.enter_trial(name)
        self._host.tick = taken.trial.tick

    def _on_robot(self, robot: RobotState) -> None:
        trial = self._trial
        if trial is None:
            return
        reached = trial.tick
        if robot.tick < reached:
            # Said again, and long answered.
            return
        # A pose that is refused: the host says so on the bus, and the tick is still to come.
        step = trial.follow(robot)
        if step is None:
            self._host.counts["gaps"] += 1
            self._host.tell(
                f"out of order {robot.source}",
                "warning",
                "tick out of order, not stepped",
                tick=robot.tick,
                at=reached,
            )
            return
        if step.problem:
            self._host.log.error("state kept", tick=robot.tick, problem=step.problem)
        self._publish(step)

    def _publish(self, step: Step) -> None:
        if step.state is None:
            return
        self._host.tick = step.state.tick
        self._state.put(step.state)
        if step.checkpoint is not None:
            self._checkpoint.put(step.checkpoint)

    def wake(self) -> float | None:
        """Ask what is to be taken up; else nothing is due by time: the robot is the clock."""
        return self._recall.wake(time.monotonic())

    def close(self) -> None:
        """Nothing to put in order."""


def patient_service(host: ServiceHost) -> SimService:
    """Make the simulator that plays the patient.

    A trial may have none: what is said of it is then nobody's fault, and only counted.
    """
    host.gate = TrialGate()
    return SimService(host, PATIENT)
