"""How far a campaign is: done of all, trials a minute, time left, successes so far."""

import time
from collections import Counter
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from fras_experiments.campaign.records import PLANNED, SUCCESS, Record
from fras_experiments.campaign.spec import TrialSpec

STYLES = {SUCCESS: "green", PLANNED: "green", "aborted": "bold red"}


class Pace:
    """Counts what has ended.

    Parameters
    ----------
    total : int
        Trials of the campaign.
    before : mapping of int to Record
        Those that an earlier command has kept; they count as done, and not for the rate.
    clock : callable
        Seconds from anywhere.
    """

    def __init__(
        self,
        total: int,
        before: Mapping[int, Record],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.total = total
        self.done = len(before)
        self._outcomes = Counter(one.result.outcome for one in before.values())
        self._now = 0
        self._clock = clock
        self._began_s = clock()

    def count(self, record: Record) -> None:
        """Count one more."""
        self.done += 1
        self._now += 1
        self._outcomes[record.result.outcome] += 1

    def in_words(self) -> str:
        """Tell rate, time left and success so far."""
        said: list[str] = []
        if self._now:
            a_minute = 60.0 * self._now / max(self._clock() - self._began_s, 1e-9)
            left_s = round(60.0 * (self.total - self.done) / a_minute)
            minutes, seconds = divmod(left_s, 60)
            hours, minutes = divmod(minutes, 60)
            said += [f"{a_minute:.1f} a minute", f"{hours}:{minutes:02d}:{seconds:02d} left"]
        if self.done:
            well = PLANNED if self._outcomes[PLANNED] else SUCCESS
            said.append(f"{self._outcomes[well] / self.done:.0%} {well}")
        return " · ".join(said)


@contextmanager
def shown(console: Console, pace: Pace) -> Generator[Callable[[TrialSpec, Record], None]]:
    """Show a bar at a terminal, and a line a trial elsewhere; yields what to call for each."""
    bar = Progress(
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.description}"),
        console=console,
        disable=not console.is_terminal,
    )
    task = bar.add_task(pace.in_words(), total=pace.total, completed=pace.done)

    def tell(one: TrialSpec, record: Record) -> None:
        pace.count(record)
        bar.update(task, completed=pace.done, description=pace.in_words())
        result = record.result
        if bar.disable or result.outcome == "aborted":
            text = f"trial {one.number}, seed {one.scenario.seed}: {result.outcome}"
            text += f", {result.reason}" if result.outcome not in (SUCCESS, PLANNED) else ""
            text += f" ({pace.done} of {pace.total}; {pace.in_words()})" if bar.disable else ""
            console.print(escape(text), style=STYLES.get(result.outcome, ""), soft_wrap=True)

    with bar:
        yield tell
