"""What a person sees in the terminal: a few lines that live while the trial runs, then a table."""

from collections.abc import Iterable

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from fras_cli.report import Percentiles, Summary, patient_in_words, specifications_in_words
from fras_cli.trial import TrialView
from fras_common.messages import Verdict

ACTION_WORDS = {
    "reach": "reaching for",
    "grasp": "grasping",
    "release": "releasing",
    "pull": "lifting",
    "move": "moving the tissue sideways to",
}
PHASE_WORDS = {
    "resetting": "preparing the trial",
    "planning": "planning",
    "ended": "ended, closing the log",
    "idle": "ended",
}
OUTCOME_WORDS = {
    "success": "The region of interest is exposed.",
    "no_plan": "No plan exists for this situation.",
    "aborted": "The trial was aborted.",
    "failed": "The trial failed.",
}
BAR_CELLS = 30


class LiveDisplay:
    """Redraws the view in place on a terminal; elsewhere prints a line when the action changes."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._last_line = ""
        self._live = Live(console=console, refresh_per_second=8, transient=True)

    def __enter__(self) -> "LiveDisplay":
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._console.is_terminal:
            self._live.stop()

    def pause(self) -> None:
        """Draw nothing until the next `show`: something else is written there."""
        if self._console.is_terminal:
            self._live.stop()

    def show(self, view: TrialView) -> None:
        """Draw the view."""
        if self._console.is_terminal:
            self._live.start()
            self._live.update(render(view))
            return
        line = f"stopped by {view.holds} (`fras resume`)" if view.holds else action_line(view)
        if line != self._last_line:
            self._last_line = line
            self._console.print(line, highlight=False)


def action_line(view: TrialView) -> str:
    """Phase and current action in words."""
    task = view.task
    if task is None:
        return "starting the trial"
    if task.phase == "awaiting_approval":
        return f"plan {task.plan} waits for approval (`fras approve`, `fras reject`)"
    if task.phase != "acting":
        return PHASE_WORDS[task.phase]
    name, _, arguments = task.action.partition("(")
    arm, _, block = arguments.removesuffix(")").partition(",")
    step = f"action {task.goal_id.removeprefix('g')}"
    return f"{step}: {arm} {ACTION_WORDS.get(name, name)} {block}".rstrip()


def render(view: TrialView) -> RenderableType:
    """Phase, action, force against its limits, visibility, rate."""
    lines: list[RenderableType] = [Text(action_line(view), style="bold")]
    verdict = view.verdict
    if verdict is not None:
        force = verdict.max_force_n / verdict.limit_n if verdict.limit_n else 0.0
        style = {"ok": "blue", "soft": "yellow", "hard": "bold red", "invalid": "bold red"}
        lines.append(
            Text.assemble(
                "  force      ",
                (bar(force), style[verdict.level]),
                f" {verdict.max_force_n:5.2f} N of {verdict.limit_n:.2f} N",
                crossing_words(verdict),
            )
        )
        lines.append(
            Text.assemble(
                "  visibility ",
                (bar(verdict.visibility), "blue"),
                f" {verdict.visibility:6.1%}{'  visible' if verdict.visible else ''}",
            )
        )
    if view.robot is not None:
        lines.append(
            Text(f"  tick {view.robot.tick}, {view.tick_rate_hz:.0f} a second", style="dim")
        )
    if view.holds:
        lines.append(Text(f"  stopped by {view.holds} (`fras resume`)", style="bold yellow"))
    lines.extend(
        Text(f"  {service} {state}", style="yellow") for service, state in view.waiting.items()
    )
    return Group(*lines)


def crossing_words(verdict: Verdict) -> str:
    """When the force will cross the limit of the action, if that is in sight."""
    if verdict.crossing_tick < 0:
        return ""
    return f", crosses its limit in about {verdict.crossing_tick - verdict.tick} ticks"


def bar(fraction: float) -> str:
    """Draw a fraction as a bar; more than all of it is drawn full."""
    filled = round(min(max(fraction, 0.0), 1.0) * BAR_CELLS)
    return "█" * filled + "·" * (BAR_CELLS - filled)


def print_summary(console: Console, summary: Summary, places: Iterable[tuple[str, str]]) -> None:
    """Print how the trial ended, in plain words, and where everything is."""
    style = "bold green" if summary.outcome == "success" else "bold red"
    console.print(Text(OUTCOME_WORDS[summary.outcome], style=style))
    if summary.outcome != "success":
        detail = f": {summary.detail}" if summary.detail else ""
        console.print(Text(f"Reason: {summary.reason}{detail}"))
    table = Table(show_header=False, box=None, padding=(0, 2))
    rows = [
        ("actions", " → ".join(summary.actions) or "none"),
        ("plans", f"{summary.plans}, of them {summary.replans} re-plans"),
        ("visibility", "unknown" if summary.visibility is None else f"{summary.visibility:.1%}"),
        ("largest force", _force_words(summary)),
        *(("patient", sentence) for sentence in patient_in_words(summary)),
        ("specifications", specifications_in_words(summary)),
        ("time", f"{summary.sim_s:.1f} s simulated in {summary.wall_s:.1f} s"),
        ("a tick", f"{_duration(summary.tick_ms)}; finite elements {_duration(summary.fe_ms)}"),
        ("log", f"{summary.messages} messages, {summary.lost} lost"),
        ("head", summary.head or "none: the log was never closed"),
        *places,
    ]
    for name, value in rows:
        table.add_row(Text(name, style="dim"), Text(value, overflow="fold"))
    console.print(table)


def _force_words(summary: Summary) -> str:
    if summary.max_force_n is None:
        return "unknown"
    return (
        f"{summary.max_force_n:.2f} N, limit {summary.limit_n:.2f} N, "
        f"{summary.ticks_above_limit} ticks above it"
    )


def _duration(value: Percentiles | None) -> str:
    return "unknown" if value is None else f"{value.p50:.1f} ms median, {value.p99:.1f} ms p99"
