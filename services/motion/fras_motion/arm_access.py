"""Who drives the arms: this process, for CRTK clients too while no trial runs, or another one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol

from fras_common import messages as m
from fras_common.errors import FrasError
from fras_common.service import ServiceHost
from fras_common.topics import CRTK
from fras_motion.crtk import ArmStatus, CommandRefused, DirectControl, shown, way_back
from fras_motion.crtk.face import FAST_PERIOD_S, PERIOD_S, CrtkFace
from fras_motion.crtk.link import CrtkLink
from fras_motion.drivers import CrtkDriver, Driver
from fras_motion.holds import Holds
from fras_motion.kinematics import BASES_IN_WORLD, HOME_TIPS_M, ArmKinematics
from fras_motion.pacing import Pacer
from fras_motion.parameters import MotionParameters
from fras_motion.robots import home_setpoints, simulated_drivers
from fras_motion.states import Goal
from fras_motion.trial import MotionTrial

__all__ = ["ArmAccess", "PaceTooFast", "remote_arms", "simulated_arms"]

# State commands that stop an arm, and how it stands then: a hold, lifted by what lets it move.
_LEFT_BY = {
    "pause": ArmStatus("PAUSED"),
    "disable": ArmStatus("DISABLED"),
    "unhome": ArmStatus(is_homed=False),
}
_FAULT = "fault"
_ARMS = "arms/"
_IDLE_S = 60.0


class PaceTooFast(FrasError):
    """Arms of another process move in real time.

    Parameters
    ----------
    pace : float
        What was asked for; 0 is as fast as possible.
    """

    pace: float

    def __init__(self, pace: float) -> None:
        super().__init__(
            f"pace {pace:g}: the arms are those of another process and move in real time; "
            "run at a pace above 0, 1 at most",
            pace=pace,
        )


class ArmAccess(Protocol):
    """What the service asks of whoever has the arms."""

    def drivers(self, parameters: MotionParameters, pace: float) -> Mapping[str, Driver]:
        """Make the drivers of a trial.

        Raises
        ------
        PaceTooFast
        """
        ...

    def operating_state(self, arm: str) -> str:
        """State of an arm by CRTK; an enabled one that somebody holds is paused."""
        ...

    def restore(self, holds: Mapping[str, str]) -> None:
        """Take over the states of the arms that stood behind holds of before this process."""
        ...

    def wake(self, trial: MotionTrial | None, now_s: float) -> float:
        """Do what is due; return the seconds until it wants to be called again."""
        ...


class SimulatedArms:
    """Arms of this process: a trial's while it runs, a CRTK client's otherwise."""

    def __init__(self, host: ServiceHost, holds: Holds) -> None:
        self._host = host
        self._holds = holds
        self._trial: MotionTrial | None = None
        self._said: tuple[int, Goal | None, dict[str, str]] | None = None
        self._heeded_holds = 0
        self._period_s = PERIOD_S
        parameters = MotionParameters()
        kinematics = {name: ArmKinematics(base) for name, base in BASES_IN_WORLD.items()}
        home = home_setpoints(kinematics, HOME_TIPS_M, parameters)
        self._direct = DirectControl(
            parameters, kinematics, simulated_drivers(parameters, kinematics), home
        )
        self._pacer = Pacer(parameters.dt_s, 1.0)
        self._face = CrtkFace(host, self._direct, kinematics, self._permit, self._on_state)

    def drivers(self, parameters: MotionParameters, pace: float) -> Mapping[str, Driver]:
        """Make simulated arms with the numbers of the trial."""
        self._period_s = PERIOD_S if 0.0 < pace <= 1.0 else FAST_PERIOD_S
        return simulated_drivers(parameters, BASES_IN_WORLD)

    def operating_state(self, arm: str) -> str:
        """State of an arm by CRTK."""
        return shown(self._direct.status(arm), held=bool(self._holds.current()))

    def restore(self, holds: Mapping[str, str]) -> None:
        """Take over the states that `pause`, `disable` and faults left."""
        for arm in BASES_IN_WORLD:
            if (command := holds.get(_holder(arm))) is not None:
                self._direct.restore(arm, _LEFT_BY.get(command, ArmStatus("FAULT")))

    def wake(self, trial: MotionTrial | None, now_s: float) -> float:
        """Say where the arms are; while no trial runs, follow who leads them."""
        self._heed_lifted_holds()
        if self._trial is not None and not self._trial.runs:
            controller = self._trial.controller
            self._direct.take_over(controller.snapshot.arms, controller.drivers)
        self._trial = trial if trial is not None and trial.runs else None
        if self._trial is not None or not self._direct.moving:
            _, self._heeded_holds, _ = self._holds.look()
        if self._trial is not None:
            return self._say_trial(self._trial, now_s)
        held = self._is_held()
        wait_s = self._face.heartbeat_in_s(now_s)
        if self._direct.moving:
            wait_s = min(wait_s, self._tick(held=held, now_s=now_s))
        arms = self._direct.snapshot(held=held)
        busy = {arm: self._direct.busy(arm) for arm in arms}
        if not self._face.publish(arms, busy, -1, now_s):
            # A trial faster than life may have said so just now.
            wait_s = min(wait_s, self._face.due_in_s(now_s))
        return wait_s

    def _say_trial(self, trial: MotionTrial, now_s: float) -> float:
        """Say where the trial's arms are, for each of its ticks unless it runs faster than life."""
        heartbeat_s = self._face.heartbeat_in_s(now_s)
        moment = (trial.tick, trial.goal, self._holds.current())
        if moment == self._said and heartbeat_s > 0.0:
            return heartbeat_s
        busy = {trial.goal.arm: True} if trial.goal is not None else {}
        arms = {
            name: replace(arm, operating_state=self.operating_state(name))
            for name, arm in trial.controller.snapshot.arms.items()
        }
        if self._face.publish(arms, busy, trial.tick, now_s, self._period_s):
            self._said = moment
            return self._face.heartbeat_in_s(now_s)
        self._said = None
        return self._face.due_in_s(now_s)

    def _tick(self, *, held: bool, now_s: float) -> float:
        if (wait_s := self._pacer.wait_s(now_s)) > 0.0:
            return wait_s
        self._pacer.ticked(now_s)
        _, self._heeded_holds, _ = self._holds.look()
        for refusal in self._direct.tick(held=held):
            self._holds.hold(_holder(refusal.arm), _FAULT)
            self._host.report_fault(f"{refusal.arm}/{refusal.command}", refusal)
        return self._pacer.wait_s(now_s)

    def _is_held(self) -> bool:
        """Whether somebody holds the arms, or did since the last tick."""
        holds, made, _ = self._holds.look()
        return bool(holds) or made > self._heeded_holds

    def _heed_lifted_holds(self) -> None:
        """Let an arm move again whose hold a person lifted: none moves in another state."""
        held = self._holds.current()
        for arm in BASES_IN_WORLD:
            if _holder(arm) not in held:
                for command in way_back(self._direct.status(arm)):
                    self._direct.state_command(arm, command)

    def _permit(self, arm: str, command: str, source: str) -> None:
        del source
        if self._trial is not None:
            text = f"trial {self._trial.name!r} leads the arms; wait for its end or abort it"
            raise CommandRefused(arm, command, "trial_runs", text, trial=self._trial.name)
        # An arm that its own state stops says so itself.
        holds = self._holds.in_words() if self._direct.status(arm).may_move else ""
        if holds:
            text = f"the arms are held ({holds}); `fras resume` lifts a hold"
            raise CommandRefused(arm, command, "held", text)

    def _on_state(self, arm: str, command: str) -> None:
        if command in ("home", "unhome") and self._trial is not None:
            text = f"trial {self._trial.name!r} leads the arms"
            raise CommandRefused(arm, "state_command", "trial_runs", text, trial=self._trial.name)
        status = self._direct.state_command(arm, command)
        holder = _holder(arm)
        if not status.may_move:
            self._holds.hold(holder, command if command in _LEFT_BY else "unhome")
        elif holder in self._holds.current():
            self._holds.resume(holder, by=holder)
        self._host.log.info("state", arm=arm, state=status.state, homed=status.is_homed)


class RemoteArms:
    """Arms of another process, under the keys of CRTK; it decides who else may lead them.

    A stop must stop them, whoever does: while somebody holds them and no trial leads them, which
    brings them to rest itself, they are paused.
    """

    def __init__(self, host: ServiceHost, holds: Holds) -> None:
        self._holds = holds
        self._link = CrtkLink(host)
        self._states: dict[str, str] = {}
        self._told = {keys.arm: host.publisher(keys.state_command) for keys in CRTK}
        # Told to pause since they last said to be enabled; told so and to be resumed by us.
        self._pausing: set[str] = set()
        self._paused: set[str] = set()
        for keys in CRTK:
            # Nothing moves an arm that has not said yet that it may be moved.
            holds.hold(f"{_ARMS}{keys.arm}", "not heard of")
            host.subscribe(keys.operating_state, self._watch(keys.arm))

    def drivers(self, parameters: MotionParameters, pace: float) -> Mapping[str, Driver]:
        """Make drivers that reach the arms over the bus."""
        del parameters
        if not 0.0 < pace <= 1.0:
            raise PaceTooFast(pace)
        return {name: CrtkDriver(name, self._link) for name in BASES_IN_WORLD}

    def operating_state(self, arm: str) -> str:
        """State of an arm as its process says; DISABLED before it said any."""
        status = ArmStatus(self._states.get(arm, "DISABLED"))
        return shown(status, held=bool(self._holds.current()))

    def restore(self, holds: Mapping[str, str]) -> None:
        """Nothing to take over: the other process says its states anew."""
        del holds

    def wake(self, trial: MotionTrial | None, now_s: float) -> float:
        """Pause and resume the arms; where they are, the other process says."""
        del now_s
        held = any(not holder.startswith(_ARMS) for holder in self._holds.current())
        led = trial is not None and trial.runs
        for arm, state in self._states.items():
            if held and not led and state == "ENABLED" and arm not in self._pausing:
                self._pausing.add(arm)
                self._paused.add(arm)
                self._told[arm].put(m.StateCommand(command="pause"))
            elif not held and arm in self._paused:
                self._paused.discard(arm)
                self._told[arm].put(m.StateCommand(command="resume"))
        return _IDLE_S

    def _watch(self, arm: str) -> Callable[[m.OperatingState], None]:
        holder = f"{_ARMS}{arm}"

        def on_state(state: m.OperatingState) -> None:
            self._states[arm] = state.state
            if state.state == "ENABLED":
                self._pausing.discard(arm)
            if not ArmStatus(state.state, state.is_homed).may_move:
                self._holds.hold(holder, "not homed" if not state.is_homed else state.state.lower())
            elif holder in self._holds.current():
                self._holds.resume(holder, by=holder)

        return on_state


def _holder(arm: str) -> str:
    """Owner of the hold that stands for an arm's own state."""
    return f"crtk/{arm}"


def simulated_arms(host: ServiceHost, holds: Holds) -> ArmAccess:
    """Arms of this process."""
    return SimulatedArms(host, holds)


def remote_arms(host: ServiceHost, holds: Holds) -> ArmAccess:
    """Arms of another process."""
    return RemoteArms(host, holds)
