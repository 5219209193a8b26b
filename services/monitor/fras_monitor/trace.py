"""Force and visibility over the last half minute of a trial, with every peak kept."""

from dataclasses import dataclass
from typing import Final

from fras_common.messages import Verdict

TICKS_A_SAMPLE: Final = 2
SAMPLES: Final = 600


@dataclass(frozen=True)
class Sample:
    """The largest force and the last visibility of a few ticks from `tick` on."""

    tick: int
    force_n: float
    visibility: float


@dataclass(frozen=True)
class Trace:
    """A bounded course of one trial; another one begins it anew."""

    trial: str = ""
    samples: tuple[Sample, ...] = ()

    def extended(self, verdict: Verdict) -> "Trace":
        """Append a verdict; one that lies before the end, as a replay seeks, cuts what follows."""
        new = Sample(verdict.tick, verdict.max_force_n, verdict.visibility)
        if verdict.trial != self.trial:
            return Trace(verdict.trial, (new,))
        before = self.samples
        if before and verdict.tick < before[-1].tick:
            before = tuple(one for one in before if one.tick < verdict.tick)
        if before and verdict.tick - before[-1].tick < TICKS_A_SAMPLE:
            last = before[-1]
            merged = Sample(last.tick, max(last.force_n, new.force_n), new.visibility)
            return Trace(self.trial, (*before[:-1], merged))
        return Trace(self.trial, (*before, new)[-SAMPLES:])
