"""What `fras status` shows: from what was heard to rows; no bus, no clock."""

from collections import deque
from dataclasses import dataclass, field

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fras_common.messages import Health, ProcessReport, SupervisorStatus, TaskStatus
from fras_common.topics import SERVICES

COLUMNS = (
    *("process", "state", "pid", "again", "cpu", "memory"),
    *("tick", "lag", "in/s", "out/s", "queue", "drops", "gaps"),
)
WITHOUT_HEALTH = ("", "", "", "", "", "", "")
# They come and go beside a stack; no table of processes has them.
GUESTS = ("monitor", "replay")
STYLES = {"whole": "green", "incomplete": "yellow", "safe_hold": "bold red"}


@dataclass
class Heard:
    """The latest of everything; the last two reports of each service's health."""

    health: dict[str, deque[Health]] = field(default_factory=dict[str, deque[Health]])
    supervisors: dict[str, SupervisorStatus] = field(default_factory=dict[str, SupervisorStatus])
    task: TaskStatus | None = None

    def on_health(self, health: Health) -> None:
        """Note a report; one of another life begins anew, for counts do."""
        reports = self.health.setdefault(health.service, deque(maxlen=2))
        if reports and reports[-1].source != health.source:
            reports.clear()
        reports.append(health)

    def on_supervisor(self, status: SupervisorStatus) -> None:
        """Note how the supervisor, of a host if there are several, sees the stack."""
        self.supervisors[status.host] = status

    def reports(self) -> dict[str, ProcessReport]:
        """List the processes that supervisors keep."""
        return {one.name: one for status in self.supervisors.values() for one in status.processes}

    def knows_hosts(self) -> bool:
        """Whether the stack is spread over hosts, so that one supervisor does not keep it all."""
        return any(self.supervisors)

    def on_task(self, status: TaskStatus) -> None:
        """Note where the task stands."""
        self.task = status

    def is_full(self) -> bool:
        """Whether there is all that the rows show."""
        guests = [one for one in GUESTS if one in self.health]
        rates = all(len(self.health.get(one, ())) == 2 for one in (*SERVICES, *guests))
        kept = not self.knows_hosts() or self.reports().keys() >= set(SERVICES)
        return rates and bool(self.supervisors) and kept


def rows(heard: Heard, tokens: set[str]) -> list[tuple[str, ...]]:
    """Make a row a process: those of the supervisor's table, else the services of a stack.

    Notes
    -----
    Below them a row for each guest that is there now.
    """
    newest = {name: reports[-1] for name, reports in heard.health.items()}
    front = max((one.tick for one in newest.values()), default=-1)
    reports = heard.reports()
    # Of a host whose supervisor is not heard the services are shown all the same.
    names = [*reports, *(one for one in SERVICES if one not in reports and heard.knows_hosts())]
    guests = [one for one in GUESTS if f"alive/{one}" in tokens and one not in names]
    made: list[tuple[str, ...]] = []
    for name in [*(names or SERVICES), *guests]:
        health = newest.get(name)
        state = _state(name, reports.get(name), health, tokens)
        made.append(
            (name, state, *_process(reports.get(name), health), *_service(heard, name, front))
        )
    return made


def render(title: str, heard: Heard, tokens: set[str]) -> RenderableType:
    """Draw everything."""
    # Without a frame it fits 80 columns.
    table = Table(*COLUMNS, box=None, padding=(0, 1, 0, 0))
    for row in rows(heard, tokens):
        table.add_row(*(Text(cell) for cell in row))
    said = [*remarks(heard), *page_remarks(heard, tokens)]
    return Group(Text(title), table, *(Text(text, style) for text, style in said))


def remarks(heard: Heard) -> list[tuple[str, str]]:
    """Say what stands below the table, each with its style."""
    said: list[tuple[str, str]] = []
    for host, status in heard.supervisors.items():
        if status.verdict != "whole":
            held = "; motion holds the arms" if status.held else ""
            where = f"host {host}, " if host else ""
            words = f"{where}{status.verdict.replace('_', ' ')}: {status.reason}{held}"
            said.append((words, STYLES[status.verdict]))
        said += [
            (f"{one.name} last ended {one.last_exit}", "dim")
            for one in status.processes
            if one.last_exit
        ]
    said += [
        (f"{name} {words}", "dim")
        for name, reports in sorted(heard.health.items())
        if (words := _dropped(reports[-1]))
    ]
    if (motion := heard.health.get("motion")) and (holds := motion[-1].facts.get("holds", "")):
        said.append((f"the arms are stopped by {holds}: lift it with `fras resume`", "bold"))
    if (task := heard.task) is not None:
        words = f"task {task.trial}: {task.phase} {task.action}{task.outcome} {task.reason}"
        said.append((words.rstrip(), ""))
    return said


def page_remarks(heard: Heard, tokens: set[str]) -> list[tuple[str, str]]:
    """Say where the surgeon's page is, if there is one now, and how many have it open."""
    facts = heard.health["monitor"][-1].facts if "monitor" in heard.health else {}
    if "alive/monitor" not in tokens or "address" not in facts:
        return []
    return [(f"the surgeon's page: {facts['address']}, open now: {facts['pages']}", "")]


def _state(name: str, report: ProcessReport | None, health: Health | None, tokens: set[str]) -> str:
    if report is not None:
        if report.state == "waiting":
            return f"starts again in {report.starts_in_s:.1f} s"
        if report.state != "ready" or health is None:
            return report.state.replace("_", " ")
    if health is not None:
        return health.state
    return "ready, no health yet" if f"ready/{name}" in tokens else "absent"


def _process(report: ProcessReport | None, health: Health | None) -> tuple[str, ...]:
    if report is not None:
        used = (f"{report.cpu_percent:.0f} %", f"{report.rss_bytes / 1e6:.0f} MB")
        running = report.pid > 0
        pid = str(report.pid) if running else "-"
        return (pid, str(report.restarts), *(used if running else ("-", "-")))
    if health is not None:
        used = (f"{health.cpu_percent:.0f} %", f"{health.rss_bytes / 1e6:.0f} MB")
        return (health.facts.get("pid", "-"), "-", *used)
    return ("", "", "", "")


def _service(heard: Heard, name: str, front: int) -> tuple[str, ...]:
    reports = heard.health.get(name)
    if not reports:
        return WITHOUT_HEALTH
    one = reports[-1]
    ticks = one.tick >= 0
    return (
        str(one.tick) if ticks else "-",
        str(front - one.tick) if ticks else "-",
        *_rates(reports),
        str(one.queue_depth),
        str(one.malformed + one.refused + one.wrong_trial + one.queue_dropped),
        str(one.gaps),
    )


def _dropped(health: Health) -> str:
    """Tell what a service did not act on, and what it refused or stopped, by name."""
    counts = {
        "malformed": health.malformed,
        "refused": health.refused,
        "of another trial": health.wrong_trial,
        "for lack of room": health.queue_dropped,
    }
    dropped = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
    named = ", ".join(f"{name} {count}" for name, count in health.refusals.items() if count)
    words = [f"dropped {dropped}"] if dropped else []
    return "; ".join([*words, f"refused or stopped: {named}"] if named else words)


def _rates(reports: deque[Health]) -> tuple[str, str]:
    if len(reports) < 2 or (took_s := (reports[1].stamp_ns - reports[0].stamp_ns) * 1e-9) <= 0.0:
        return "-", "-"
    received = (reports[1].received - reports[0].received) / took_s
    published = (reports[1].published - reports[0].published) / took_s
    return f"{received:.0f}", f"{published:.0f}"
