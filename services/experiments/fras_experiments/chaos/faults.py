"""What may happen to a stack in mid-trial."""

from dataclasses import dataclass
from typing import Final, Literal, get_args

Kind = Literal["kill", "pause", "router", "delay", "disk", "clock"]
KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

VICTIMS: Final = ("sim", "sa", "planner", "motion", "recorder")
WATCHDOG_S: Final = 5.0
"""As in `compose/local.toml`: a longer silence is a failure, and the process is killed."""


@dataclass(frozen=True)
class Stretch:
    """Ticks of a trial in which an arm did one thing.

    Attributes
    ----------
    name : str
        Action and phase, `pull/lift`.
    first, ticks : int
        The first tick, and how many there are.
    """

    name: str
    first: int
    ticks: int


@dataclass(frozen=True)
class Fault:
    """One thing that happens.

    Attributes
    ----------
    kind : str
        `kill`: SIGKILL; `pause`: SIGSTOP, later SIGCONT; `router`: SIGKILL of the router;
        `delay`: a slow link to the router; `disk`: no file of the recorder may grow further;
        `clock`: the wall clock jumps.
    victim : str
        Process of the table.
    phase : str
        What the arm does at that tick where nothing happens before.
    tick : int
        It happens when this tick, or a later one, is heard.
    after_s : float [s]
        So long after that.
    lasts_s : float [s]
        Until it is taken back; 0: until the trial has ended (`disk`: until the recorder has said
        that it can't write), or for ever where it can't be.
    amount : float
        `delay`: seconds a chunk is held back, each way; `clock`: seconds it jumps;
        `disk`: bytes that still fit.
    """

    kind: Kind
    victim: str
    phase: str
    tick: int
    after_s: float
    lasts_s: float = 0.0
    amount: float = 0.0

    def in_words(self) -> str:
        """Tell it in a few words."""
        told = {
            "kill": f"kill {self.victim}",
            "router": "kill router",
            "pause": f"pause {self.victim} {self.lasts_s:.1f} s",
            "delay": f"delay {self.victim} {self.amount * 1e3:.0f} ms for {self.lasts_s:.1f} s",
            "disk": f"disk full in {self.amount / 1e3:.0f} kB",
            "clock": f"clock of {self.victim} {self.amount:+.0f} s",
        }
        return f"{told[self.kind]} at tick {self.tick} ({self.phase})"
