"""When is a trial's log complete? Keys have no order among each other, so a close must wait."""

from dataclasses import dataclass, field

PER_TICK = ("robot/state", "sim/tissue_state", "sa/verdict")
STATUS = "planner/task_status"


@dataclass
class Completeness:
    """Latest tick of each per-tick key and latest status of one trial.

    Parameters
    ----------
    trial : str
    """

    trial: str
    ticks: dict[str, int] = field(default_factory=dict[str, int])
    status_seq: int = -1

    def note(self, key: str, trial: str, tick: int, seq: int) -> None:
        """Take a sample into account."""
        if trial != self.trial:
            return
        if key in PER_TICK:
            self.ticks[key] = max(tick, self.ticks.get(key, -1))
        elif key == STATUS:
            self.status_seq = max(seq, self.status_seq)

    def reached(self, last_tick: int, status_seq: int) -> bool:
        """Whether every per-tick key came up to `last_tick`, and the status up to `status_seq`."""
        ticks_in = all(self.ticks.get(key, -1) >= last_tick for key in PER_TICK)
        return ticks_in and self.status_seq >= status_seq
