"""The way to arms that another process drives: setpoints out, measurements in."""

from __future__ import annotations

import threading
from functools import partial

from fras_common import messages as m
from fras_common.service import ServiceHost
from fras_common.topics import CRTK
from fras_motion.drivers import Measured, Setpoint

__all__ = ["CrtkLink"]

ANSWER_TIMEOUT_S = 2.0


class CrtkLink:
    """`fras_motion.drivers.ArmsLink` over the bus.

    Measurements are taken on the threads of the bus, because the loop waits for them.

    Parameters
    ----------
    host : ServiceHost
    answer_timeout_s : float
        How long an arm may be silent.
    """

    def __init__(self, host: ServiceHost, answer_timeout_s: float = ANSWER_TIMEOUT_S) -> None:
        self._answer_timeout_s = answer_timeout_s
        self._changed = threading.Condition()
        self._jaws: dict[str, float] = {}
        self._joints: dict[str, m.JointState] = {}
        self._servo_jp = {keys.arm: host.publisher(keys.servo_jp) for keys in CRTK}
        self._servo_jaw = {keys.arm: host.publisher(keys.jaw_servo_jp) for keys in CRTK}
        host.require("arms")
        for keys in CRTK:
            host.bus.subscribe(keys.jaw_measured_js, partial(self._on_jaw, keys.arm))
            host.bus.subscribe(keys.measured_js, partial(self._on_joints, keys.arm))

    def listen(self, arm: str) -> None:
        """Forget what an arm has said until now."""
        with self._changed:
            self._joints.pop(arm, None)

    def send(self, arm: str, setpoint: Setpoint) -> None:
        """Send `jaw/servo_jp` and `servo_jp`, then listen anew."""
        self._servo_jaw[arm].put(m.ServoJaw(jaw_rad=setpoint.jaw_rad))
        self._servo_jp[arm].put(m.ServoJoints(joints=setpoint.joints))
        self.listen(arm)

    def measured(self, arm: str) -> Measured | None:
        """Wait for the first that an arm has measured since; None if nothing comes in time."""
        with self._changed:
            if not self._changed.wait_for(lambda: arm in self._joints, self._answer_timeout_s):
                return None
            state = self._joints[arm]
            return Measured(state.joints, state.joint_velocities, self._jaws[arm])

    def _on_jaw(self, arm: str, state: m.JawState) -> None:
        with self._changed:
            self._jaws[arm] = state.jaw_rad

    def _on_joints(self, arm: str, state: m.JointState) -> None:
        with self._changed:
            if arm in self._jaws:
                self._joints.setdefault(arm, state)
                self._changed.notify_all()
