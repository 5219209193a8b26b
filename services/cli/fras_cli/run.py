"""`fras run`: one trial, or many through one stack, each with its log, summary and report."""

import shutil
import signal
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import FrameType

import msgspec
from rich.console import Console
from rich.markup import escape

from fras_cli.confirm import Confirmation
from fras_cli.display import LiveDisplay, print_summary
from fras_cli.layout import USUAL, Layout
from fras_cli.patient import require_ready
from fras_cli.report import Summary, write_report
from fras_cli.stack import UsedStack, use_stack
from fras_cli.trial import StackDied, TrialFollower, TrialView
from fras_cli.viewing import Page, view_beside
from fras_common.bus import NoAnswer
from fras_common.errors import FrasError
from fras_common.scenario import Scenario, to_toml

EXIT_OK, EXIT_NOT_SUCCESS, EXIT_BAD_INPUT, EXIT_STACK, EXIT_INTERRUPTED = 0, 1, 2, 3, 130
LOG = "audit.mcap"
ABORT_REASON = "interrupted at the terminal"
SUPERVISOR_STYLES = {"info": "dim", "warning": "yellow", "error": "bold red"}


STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class FolderInUse(FrasError):
    """The folder for a trial holds the log of another one."""


class Interrupts:
    """Counts SIGINT and SIGTERM instead of dying of them: one ends the trial, two the waiting."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Count one more signal."""
        self.count += 1


def supervisor_lines(console: Console) -> Callable[[str, str], None]:
    """Print what a supervisor has to say, as loud as it is grave."""
    return lambda level, text: console.print(
        escape(f"supervisor: {text}"), style=SUPERVISOR_STYLES[level], soft_wrap=True
    )


@contextmanager
def caught_interrupts() -> Generator[Interrupts]:
    """Catch SIGINT, SIGTERM and the closing of the terminal within the block."""
    interrupts = Interrupts()
    before = {name: signal.signal(name, interrupts) for name in STOPPING}
    try:
        yield interrupts
    finally:
        for name, handler in before.items():
            signal.signal(name, handler)


def default_out(seeds: str) -> Path:
    """Folder of a run: `runs/<stamp>-<seed>`."""
    stamp = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    names = (f"{stamp}-{seeds}{suffix}" for suffix in ("", *(f"-{n}" for n in range(2, 100))))
    return next(path for name in names if not (path := Path("runs") / name).exists())


def without_hold_timeout(scenario: Scenario) -> Scenario:
    """Let a stop last until somebody lifts it: on a stack that stays, somebody is there."""
    run = msgspec.structs.replace(scenario.run, hold_timeout_s=0.0)
    return msgspec.structs.replace(scenario, run=run)


def trial_folders(scenarios: list[Scenario], out: Path) -> list[Path]:
    """Folder of each trial: `out` itself for one, `seed-<n>` in it for several.

    Raises
    ------
    FolderInUse
        If one of them holds a log: a log is never written over.
    """
    single = len(scenarios) == 1
    folders = [out if single else out / f"seed-{scenario.seed}" for scenario in scenarios]
    for folder in folders:
        if (folder / LOG).exists():
            raise FolderInUse(
                f"{folder / LOG} exists: a log is never written over, choose another --out",
                path=folder / LOG,
            )
    return folders


def run_trials(
    scenarios: list[Scenario],
    *,
    out: Path,
    cell: str,
    connect: str | None,
    port: int | None,
    console: Console,
    as_json: bool,
    mesh: bytes = b"",
    layout: Layout = USUAL,
    asks: bool = False,
    page: Page | None = None,
) -> int:
    """Run the scenarios one after the other through one stack.

    Parameters
    ----------
    scenarios : list of Scenario
        Resolved.
    out : Path
        The run's own folder; with several scenarios each gets `seed-<n>` in it.
    cell, connect, port
        Which stack, see `use_stack`.
    console : Console
        For people.
    as_json : bool
        Print the summaries to standard output, one JSON object a trial.
    mesh : bytes
        Content of the mesh file that the scenarios name.
    layout : Layout
        What an own stack consists of.
    asks : bool
        Ask in the terminal about each plan that waits for approval.
    page : Page, optional
        The surgeon's page to open beside.

    Returns
    -------
    int
        0 if every trial was a success, 1 if not, 130 if interrupted.
    """
    folders = trial_folders(scenarios, out)
    has_patient = any(scenario.has_patient for scenario in scenarios)
    outcomes: list[str] = []
    under_way: list[Path] = []
    with (
        _told_of_the_dead(under_way, console),
        caught_interrupts() as interrupts,
        use_stack(
            cell,
            connect,
            port,
            out / "logs",
            cancelled=lambda: interrupts.count > 0,
            tell=lambda words: console.print(words, style="dim"),
            layout=replace(layout, patient=has_patient),
            report=supervisor_lines(console),
        ) as stack,
        view_beside(cell, stack.link.connect, page),
    ):
        if has_patient:
            require_ready(stack.link)
        follower = TrialFollower(stack)
        for scenario, folder in zip(scenarios, folders, strict=True):
            if not stack.own:
                scenario = without_hold_timeout(scenario)
            under_way.append(folder)
            confirmation = Confirmation(console, follower.decide) if asks else None
            _one_trial(follower, scenario, mesh, folder, console, interrupts, confirmation)
            summary = _report(under_way.pop(), console)
            outcomes.append(summary.outcome)
            if as_json:
                print(msgspec.json.encode(summary).decode(), flush=True)
            if interrupts.count:
                break
        if not stack.own:
            _copy_logs(stack, out / "logs")
    if len(scenarios) > 1:
        _print_tally(console, outcomes)
    if interrupts.count:
        return EXIT_INTERRUPTED
    return EXIT_OK if all(one == "success" for one in outcomes) else EXIT_NOT_SUCCESS


@contextmanager
def _told_of_the_dead(under_way: list[Path], console: Console) -> Generator[None]:
    """Report on the trial that a dying stack took with it: what its log holds is readable."""
    try:
        yield
    except StackDied:
        for folder in under_way:
            if (folder / LOG).exists():
                _report(folder, console)
        raise


def _one_trial(
    follower: TrialFollower,
    scenario: Scenario,
    mesh: bytes,
    folder: Path,
    console: Console,
    interrupts: Interrupts,
    confirmation: Confirmation | None = None,
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scenario.toml").write_text(to_toml(scenario), encoding="utf-8")
    if scenario.tissue.mesh_file is not None:
        (folder / scenario.tissue.mesh_file).write_bytes(mesh)
    trial = f"{datetime.now(UTC).strftime('%Y%m%d-%H%M%S')}-{scenario.seed}"
    console.print(f"trial {trial}: scenario {scenario.name}, seed {scenario.seed}")
    follower.start(trial, scenario, folder, mesh)
    with LiveDisplay(console) as display:

        def look(view: TrialView) -> None:
            if confirmation is not None and confirmation.look(view, display.pause):
                return
            display.show(view)

        if not follower.follow(look, stop=lambda: interrupts.count > 0):
            seen = interrupts.count
            try:
                follower.abort(ABORT_REASON)
                follower.follow(display.show, stop=lambda: interrupts.count > seen)
            except NoAnswer as error:
                console.print(f"the trial could not be ended in order: {error}", style="red")


def _report(folder: Path, console: Console) -> Summary:
    console.print("writing the report", style="dim")
    began_s = time.monotonic()
    summary = write_report(folder / LOG, folder)
    places = [
        ("report", str(folder / "report.html")),
        ("audit log", str(folder / LOG)),
        ("written in", f"{time.monotonic() - began_s:.1f} s"),
    ]
    print_summary(console, summary, places)
    return summary


def _copy_logs(stack: UsedStack, target: Path) -> None:
    """Keep the logs of a stack that is not ours with the run."""
    if stack.log_dir is not None and stack.log_dir.is_dir():
        shutil.copytree(stack.log_dir, target, dirs_exist_ok=True)


def _print_tally(console: Console, outcomes: list[str]) -> None:
    counts = {name: outcomes.count(name) for name in dict.fromkeys(outcomes)}
    console.print(
        f"{len(outcomes)} trials: " + ", ".join(f"{count} {name}" for name, count in counts.items())
    )
