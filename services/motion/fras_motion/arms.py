"""Simulated arms as a process of their own, under the keys of CRTK: what a dVRK bridge would be."""

from __future__ import annotations

import time

from fras_common.messages import TaskStatus
from fras_common.service import ServiceHost
from fras_common.topics import TASK_STATUS
from fras_motion.crtk import CommandRefused, DirectControl
from fras_motion.crtk.face import CrtkFace
from fras_motion.kinematics import BASES_IN_WORLD, HOME_TIPS_M, ArmKinematics
from fras_motion.pacing import Pacer
from fras_motion.parameters import MotionParameters
from fras_motion.robots import home_setpoints, simulated_drivers

__all__ = ["ArmsService"]

# A robot's own limits, not those of a trial.
ROBOT = MotionParameters(
    dt_s=0.01,
    free_speed_m_s=0.2,
    stop_deceleration_m_s2=10.0,
    jaw_speed_rad_s=8.0,
    jaw_stop_deceleration_rad_s2=400.0,
)

# How motion's messages begin to say whose they are; the router's access control sees to it.
MOTION = "motion/"
# Phases of a task in which no trial moves the arms.
OVER = ("ended", "idle")


class ArmsService:
    """Follows servo commands and says a hundred times a second where the arms are.

    While the planner says that a trial runs, only motion leads them.
    """

    def __init__(self, host: ServiceHost) -> None:
        self._host = host
        kinematics = {name: ArmKinematics(base) for name, base in BASES_IN_WORLD.items()}
        self._direct = DirectControl(
            ROBOT,
            kinematics,
            simulated_drivers(ROBOT, kinematics),
            home_setpoints(kinematics, HOME_TIPS_M, ROBOT),
            late_s=ROBOT.dt_s,
        )
        self._pacer = Pacer(ROBOT.dt_s, 1.0)
        self._face = CrtkFace(host, self._direct, kinematics, self._permit, self._on_state)
        self._trial = ""
        host.subscribe(TASK_STATUS, self._on_task)

    def _on_task(self, status: TaskStatus) -> None:
        self._trial = "" if status.phase in OVER else status.trial

    def _permit(self, arm: str, command: str, source: str) -> None:
        if not self._trial or source.startswith(MOTION):
            return
        # Without its executive a trial is over, though nobody could say so.
        if self._host.present("alive/planner"):
            text = f"trial {self._trial!r} leads the arms; wait for its end or abort it"
            raise CommandRefused(arm, command, "trial_runs", text, trial=self._trial)

    def _on_state(self, arm: str, command: str) -> None:
        status = self._direct.state_command(arm, command)
        self._host.log.info("state", arm=arm, state=status.state, homed=status.is_homed)

    def wake(self) -> float:
        """Tick if it is time to."""
        now_s = time.monotonic()
        if (wait_s := self._pacer.wait_s(now_s)) > 0.0:
            return wait_s
        self._pacer.ticked(now_s)
        for refusal in self._direct.tick(held=False):
            self._host.report_fault(f"{refusal.arm}/{refusal.command}", refusal)
        arms = self._direct.snapshot(held=False)
        busy = {name: self._direct.busy(name) for name in arms}
        self._face.publish(arms, busy, -1, now_s)
        return self._pacer.wait_s(now_s)

    def close(self) -> None:
        """Nothing to put in order: the arms stand at their last setpoint."""
