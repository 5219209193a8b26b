"""A client that leads the arms of a stack under the keys of CRTK, over its bus."""

import threading
import time
from collections.abc import Callable
from math import dist, inf
from typing import Any

from fras_common.bus import Bus
from fras_common.messages import (
    FaultRecord,
    Header,
    JawState,
    JointState,
    OperatingState,
    Pose,
    ServoJaw,
    StateCommand,
    TipCommand,
    TipState,
)
from fras_common.topics import CRTK, FAULT, ArmTopics, Topic
from support.arms import HOME, KINEMATICS

PATIENCE_S = 30.0
# A jaw that stands may be sent this far at once: 8 rad/s for 0.05 s, with some room.
JAW_STEP_RAD = 0.3
KEYS = {keys.arm: keys for keys in CRTK}


class Leader:
    """Hears both arms, and sends them commands.

    Parameters
    ----------
    bus : Bus
    driver : str
        Service that refuses: `motion`, or `arms`.
    """

    def __init__(self, bus: Bus, driver: str) -> None:
        self._changed = threading.Condition()
        self._last: dict[str, Any] = {}
        self.faults: list[FaultRecord] = []
        topics: list[Topic[Any]] = []
        for keys in CRTK:
            topics += [keys.state_command, keys.servo_jp, keys.move_cp, keys.jaw_servo_jp]
        # Of others before it there may be faults, too, and publishers still have them.
        self._began_ns = time.time_ns()
        self._publishers = {topic.key: bus.publisher(topic) for topic in topics}
        bus.subscribe(FAULT.of(service=driver), self._on_fault)
        for keys in CRTK:
            self._hear(bus, keys.measured_js)
            self._hear(bus, keys.measured_cp)
            self._hear(bus, keys.jaw_measured_js)
            self._hear(bus, keys.operating_state)
        self.until(lambda: len(self._last) == 4 * len(CRTK))

    def until(self, done: Callable[[], object]) -> None:
        """Wait for what the arms say."""
        with self._changed:
            assert self._changed.wait_for(done, PATIENCE_S), (self._last, self.faults)

    def tell(self, topic: Topic[Any], message: Header) -> None:
        """Send a command."""
        self._publishers[topic.key].put(message)

    def state_command(self, arm: str, command: Any) -> None:
        """Ask for a transition."""
        self.tell(KEYS[arm].state_command, StateCommand(command=command))

    def joints(self, arm: str) -> JointState:
        """Joints as last measured."""
        return self._last[KEYS[arm].measured_js.key]

    def state(self, arm: str) -> OperatingState:
        """State as last said."""
        return self._last[KEYS[arm].operating_state.key]

    def off_by_m(self, arm: str, there: Pose) -> float:
        """Distance of the tip from a place."""
        tip: TipState = self._last[KEYS[arm].measured_cp.key]
        return dist(tip.tip_in_world.position_m, there.position_m)

    def reasons(self) -> list[tuple[str, str]]:
        """Key and reason of each refusal."""
        return [(fault.key, fault.values.get("reason", fault.kind)) for fault in self.faults]

    def move(self, arm: str, there: Pose) -> None:
        """Go somewhere along a line, and be there."""
        self.tell(KEYS[arm].move_cp, TipCommand(tip_in_world=there))
        self.until(lambda: self.off_by_m(arm, there) < 1e-5)
        self.until(lambda: not self.state(arm).is_busy)

    def open_jaw(self, arm: str) -> None:
        """Open the jaw in steps that it may take."""
        keys, open_rad = KEYS[arm], HOME[arm].jaw_rad
        while abs(now := self._jaw(keys) - open_rad) > 1e-3:
            wanted = open_rad + max(abs(now) - JAW_STEP_RAD, 0.0) * (1 if now > 0 else -1)
            self.tell(keys.jaw_servo_jp, ServoJaw(jaw_rad=wanted))
            self.until(lambda wanted=wanted: abs(self._jaw(keys) - wanted) < 1e-3)

    def bring_home(self) -> None:
        """Bring both arms to where a trial begins: let go, then up and over."""
        for arm, setpoint in HOME.items():
            if self.state(arm).state != "ENABLED":
                self.state_command(arm, "enable")
                self.until(lambda arm=arm: self.state(arm).state == "ENABLED")
            self.open_jaw(arm)
            home = KINEMATICS[arm].forward(setpoint.joints)
            self.move(
                arm,
                Pose(position_m=home.position_m, quaternion_xyzw=home.quaternion_xyzw),
            )

    def _jaw(self, keys: ArmTopics) -> float:
        said: JawState | None = self._last.get(keys.jaw_measured_js.key)
        return inf if said is None else said.jaw_rad

    def _hear(self, bus: Bus, topic: Topic[Any]) -> None:
        def on_message(message: Header) -> None:
            with self._changed:
                self._last[topic.key] = message
                self._changed.notify_all()

        bus.subscribe(topic, on_message)

    def _on_fault(self, fault: FaultRecord) -> None:
        if fault.stamp_ns < self._began_ns:
            return
        with self._changed:
            self.faults.append(fault)
            self._changed.notify_all()
