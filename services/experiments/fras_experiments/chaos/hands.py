"""What each fault does to a process, a link, a disk or a clock, and how it is taken back."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from resource import RLIM_INFINITY

import psutil

from fras_common.errors import FrasError
from fras_experiments.chaos.clocked import set_clock
from fras_experiments.chaos.faults import Fault
from fras_experiments.chaos.link import SlowLink
from fras_log.parts import parts_of

Undo = Callable[[], None]


class NotThere(FrasError):
    """The victim does not live now: it is being started again. Attributes: ``victim``."""


@dataclass(frozen=True)
class Hands:
    """Disturbs one stack.

    Attributes
    ----------
    marks : mapping of str to tuple of str
        By process, words that no other command line of this machine has together.
    links : mapping of str to SlowLink
        By process, its way to the router.
    clocks : mapping of str to Path
        By process, the file of its clock.
    """

    marks: Mapping[str, tuple[str, ...]]
    links: Mapping[str, SlowLink]
    clocks: Mapping[str, Path]

    def process(self, name: str) -> psutil.Process:
        """Find a process of the stack.

        Raises
        ------
        NotThere
        """
        wanted = set(self.marks[name])
        for child in psutil.Process().children():
            try:
                if wanted <= set(child.cmdline()) and child.status() != psutil.STATUS_ZOMBIE:
                    return child
            except psutil.NoSuchProcess:
                continue
        raise NotThere(f"{name} does not run now", victim=name)

    def do(self, fault: Fault, log: Path) -> Undo:
        """Let a fault happen; return what takes it back.

        Parameters
        ----------
        fault : Fault
        log : Path
            First file of the trial's log.

        Raises
        ------
        NotThere
        """
        try:
            return self._do(fault, log)
        except psutil.NoSuchProcess as error:
            raise NotThere(f"{fault.victim} has just ended", victim=fault.victim) from error

    def _do(self, fault: Fault, log: Path) -> Undo:
        match fault.kind:
            case "kill" | "router":
                self.process(fault.victim).kill()
                return _nothing
            case "pause":
                return _paused(self.process(fault.victim))
            case "disk":
                return _full(self.process(fault.victim), _size(log) + int(fault.amount))
            case "delay":
                link = self.links[fault.victim]
                link.delay_s = fault.amount
                return lambda: setattr(link, "delay_s", 0.0)
            case "clock":
                clock = self.clocks[fault.victim]
                set_clock(clock, int(fault.amount * 1e9))
                return lambda: set_clock(clock, 0)


def _nothing() -> None:
    """Nothing is taken back: the supervisor starts it again."""


def _paused(process: psutil.Process) -> Undo:
    process.suspend()

    def go_on() -> None:
        # The watchdog may have ended it; psutil asks whether it is the same process still.
        if process.is_running():
            process.resume()

    return go_on


def _size(log: Path) -> int:
    last = parts_of(log)[-1]
    return last.stat().st_size if last.exists() else 0


def _full(process: psutil.Process, size: int) -> Undo:
    """Let no file of a process grow beyond a size [bytes], as a disk without room would."""
    _, hard = process.rlimit(psutil.RLIMIT_FSIZE)
    process.rlimit(psutil.RLIMIT_FSIZE, (size, hard))

    def mend() -> None:
        if process.is_running():
            process.rlimit(psutil.RLIMIT_FSIZE, (RLIM_INFINITY if hard < 0 else hard, hard))

    return mend
