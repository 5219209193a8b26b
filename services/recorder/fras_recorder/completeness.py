"""When is a trial's log complete? Keys have no order among each other, so a close must wait."""

from dataclasses import dataclass, field

from fras_common.topics import PATIENT, ROBOT_STATE, TWIN, VERDICT

PER_TICK = (ROBOT_STATE.key, TWIN.state.key, VERDICT.key)
WITH_PATIENT = (*PER_TICK, PATIENT.state.key)
STATUS = "planner/task_status"


@dataclass
class Completeness:
    """Latest tick of each per-tick key and latest status of one trial.

    Parameters
    ----------
    trial : str
    per_tick : tuple of str
        Keys that have a message of each tick.
    """

    trial: str
    ticks: dict[str, int] = field(default_factory=dict[str, int])
    status_seq: int = -1
    per_tick: tuple[str, ...] = PER_TICK

    def note(self, key: str, trial: str, tick: int, seq: int) -> None:
        """Take a sample into account."""
        if trial != self.trial:
            return
        if key in self.per_tick:
            self.ticks[key] = max(tick, self.ticks.get(key, -1))
        elif key == STATUS:
            self.status_seq = max(seq, self.status_seq)

    def reached(self, last_tick: int, status_seq: int) -> bool:
        """Whether every per-tick key came up to `last_tick`, and the status up to `status_seq`."""
        ticks_in = all(self.ticks.get(key, -1) >= last_tick for key in self.per_tick)
        return ticks_in and self.status_seq >= status_seq
