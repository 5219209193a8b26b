"""Motion's shell: begins trials, and wakes in turn what moves the arms and what watches over it."""

import time

from fras_common import messages as m
from fras_common.codec import content_digest
from fras_common.scenario import check
from fras_common.service import ServiceHost
from fras_common.topics import MOTION_RESET
from fras_motion.adapter import parameters_of
from fras_motion.arm_access import ArmAccess, remote_arms, simulated_arms
from fras_motion.goal_desk import GoalDesk
from fras_motion.hold_desk import HoldDesk
from fras_motion.restart import Restart
from fras_motion.tick_loop import TickLoop
from fras_motion.trial import MotionTrial

SIMULATED = "simulated"
ARM_ACCESS = {SIMULATED: simulated_arms, "crtk": remote_arms}


class MotionService:
    """Turns accepted actions into ticks, one verdict at a time.

    Parameters
    ----------
    host : ServiceHost
    driver : str
        `simulated`, or `crtk` for arms that another process drives.
    """

    def __init__(self, host: ServiceHost, driver: str = SIMULATED) -> None:
        self._host = host
        hold_desk = HoldDesk(host)
        self._holds = hold_desk.holds
        make_arms = ARM_ACCESS[driver]
        self._arms: ArmAccess = make_arms(host, self._holds)
        self._loop = TickLoop(host, self._holds, self._arms.operating_state)
        self._restart = Restart(host, self._holds, self._arms, self._loop, self._new_trial)
        host.serve(MOTION_RESET, self._reset)
        GoalDesk(host, self._loop, self._restart).open()
        hold_desk.open()

    def _reset(self, request: m.ResetRequest) -> m.ResetReply:
        check(request.scenario)
        self._restart.give_up()
        running = self._loop.trial
        # Asked again because an answer was lost: nothing has moved since.
        if running is None or running.has_moved or request != self._loop.request:
            self._loop.enter(self._new_trial(request), request)
        else:
            self._loop.say(running)
        return m.ResetReply(digest=content_digest(request.trial, request.scenario, request.mesh))

    def _new_trial(self, request: m.ResetRequest) -> MotionTrial:
        parameters = parameters_of(request.scenario)
        drivers = self._arms.drivers(parameters, request.scenario.run.pace)
        return MotionTrial(request.trial, parameters, self._holds, self._host.refusals, drivers)

    def wake(self) -> float | None:
        """Do what is due; return the seconds until the next time."""
        now_s = time.monotonic()
        waits_s = (
            self._loop.wake(),
            self._arms.wake(self._loop.trial, now_s),
            self._restart.wake(now_s),
        )
        return min(wait_s for wait_s in waits_s if wait_s is not None)

    def close(self) -> None:
        """Nothing to put in order: the arms stand at their last setpoint."""
