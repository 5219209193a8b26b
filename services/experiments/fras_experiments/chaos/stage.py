"""One worker's stack, kept by its supervisor, and what it takes to disturb it."""

from collections.abc import Callable, Generator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from fras_cli.layout import Layout
from fras_cli.options import TrialInput
from fras_cli.stack import UsedStack, own_stack
from fras_cli.trial import TrialFollower
from fras_experiments.chaos.clocked import set_clock
from fras_experiments.chaos.faults import VICTIMS, Fault, Kind
from fras_experiments.chaos.hands import Hands
from fras_experiments.chaos.injector import Injected, Injector
from fras_experiments.chaos.link import HOST, SlowLink
from fras_experiments.chaos.table import disturbed
from fras_experiments.following import follow_to_end, lay_out
from fras_supervisor import find_table, free_port

READY_S = 120.0
ABORT = "chaos: the trial takes too long"


@dataclass(frozen=True)
class Stage:
    """A stack on which trials are run and disturbed."""

    stack: UsedStack
    follower: TrialFollower
    injector: Injector

    def ready(self) -> bool:
        """Wait until every service is there again; false if not in time."""
        return self.stack.link.wait_complete(READY_S)

    def run(
        self,
        trial: str,
        given: TrialInput,
        folder: Path,
        faults: Sequence[Fault],
        until: Callable[[], bool],
    ) -> tuple[Path, tuple[Injected, ...]]:
        """Run a trial to its end, disturbed; return its log and what happened.

        Parameters
        ----------
        until : callable
            True ends the trial early.

        Raises
        ------
        StackDied
            A process was given up, or has ended.
        TrialRefused, NoAnswer
        """
        log = lay_out(folder, given)
        self.injector.begin(trial, log, faults)
        try:
            follow_to_end(self.follower, trial, given, folder, lambda _: ABORT if until() else "")
        finally:
            injected = self.injector.end()
        return log, injected


@contextmanager
def staged(cell: str, kinds: Sequence[Kind], folder: Path) -> Generator[Stage]:
    """Keep a stack that the given kinds of faults can disturb.

    Parameters
    ----------
    folder : Path
        For its table, its clocks and its logs.
    """
    folder.mkdir(parents=True, exist_ok=True)
    router = free_port()
    connect = f"tcp/{HOST}:{router}"
    with ExitStack() as inside:
        links: dict[str, SlowLink] = {}
        clocks: dict[str, Path] = {}
        if "delay" in kinds:
            links = {name: inside.enter_context(SlowLink(router, free_port())) for name in VICTIMS}
        if "clock" in kinds:
            clocks = {name: folder / f"clock-{name}" for name in VICTIMS}
            for clock in clocks.values():
                set_clock(clock, 0)
        ways = {name: f"tcp/{HOST}:{link.port}" for name, link in links.items()}
        table = folder / "table.toml"
        text = find_table("local").read_text(encoding="utf-8")
        table.write_text(disturbed(text, ways, clocks), encoding="utf-8")
        marks = {name: (f"fras_{name}", ways.get(name, connect)) for name in VICTIMS}
        marks["router"] = ("fras_common.router", connect)
        stack = inside.enter_context(
            own_stack(cell, connect, folder / "logs", layout=Layout(str(table)))
        )
        injector = Injector(stack.link.bus, Hands(marks, links, clocks))
        yield Stage(stack, TrialFollower(stack), inside.enter_context(injector))
