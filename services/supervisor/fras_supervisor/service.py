"""The supervisor's shell: turns the stack, says how it stands, and takes orders."""

import time
from collections.abc import Callable
from typing import Final

from fras_common.messages import Health, RestartReply, RestartRequest, SupervisorStatus
from fras_common.service import ServiceHost
from fras_common.topics import HEALTH, SUPERVISOR_RESTART, SUPERVISOR_STATUS
from fras_supervisor.hold import SafeHold
from fras_supervisor.member import Event
from fras_supervisor.policy import verdict
from fras_supervisor.runner import Stack, Status
from fras_supervisor.usage import Usage
from fras_supervisor.watchdog import RECONNECT_S, Watchdog

TURN_S: Final = 0.05
REPORT_S: Final = 1.0

Tell = Callable[[str, str], None]
"""Called with how grave it is (`info`, `warning`, `error`) and the words."""


class SupervisorService:
    """Keeps a stack that has started.

    Parameters
    ----------
    host : ServiceHost
    stack : Stack
    tell : callable
        Gets what there is to say to whoever sits at the terminal.
    """

    def __init__(self, host: ServiceHost, stack: Stack, tell: Tell) -> None:
        self._host = host
        self._stack = stack
        self._tell = tell
        self._processes = stack.table.processes
        self._router = next(
            (one.name for one in self._processes.values() if one.readiness == "listening"), ""
        )
        self._watchdog = Watchdog()
        self._usage = Usage()
        self._hold = SafeHold(host, lambda text: self._say("error", "motion", text))
        self._report_at_s = 0.0
        self._pids: dict[str, int] = {}
        self._motion_lives = 0
        self._motion_seen = False
        self._status = host.publisher(SUPERVISOR_STATUS)
        host.serve(SUPERVISOR_RESTART, self._restart)
        host.subscribe(HEALTH, self._on_health)
        self.latest: tuple[Status, ...] = stack.status()

    def wake(self) -> float:
        """Do what is due, twenty times a second."""
        now_s = time.monotonic()
        self._note(self._stack.turn())
        self._watch(now_s)
        self.latest = self._stack.status()
        self._hold.want(self._given_up())
        self._hold.wake(self._motion_life())
        if now_s >= self._report_at_s:
            self._limit_memory()
            self._report(now_s)
        return TURN_S

    def close(self) -> None:
        """Say a last time how the stack stood."""
        self._report(time.monotonic())

    def _on_health(self, health: Health) -> None:
        self._watchdog.heard(health.service, health.loop_lag_s, time.monotonic())

    def _restart(self, request: RestartRequest) -> RestartReply:
        before = {one.name: one for one in self._stack.status()}
        self._note([self._stack.restart(request.name)], by=request.by)
        one = before[request.name]
        return RestartReply(name=one.name, state=one.state, restarts=one.restarts)

    def _watch(self, now_s: float) -> None:
        ready = {one.name: one.pid for one in self._stack.status() if one.state == "ready"}
        for name, pid in ready.items():
            if pid is not None and self._pids.get(name) != pid and name != self._router:
                self._pids[name] = pid
                self._watchdog.watch(name, self._processes[name].patience, now_s)
        for name in [one for one in self._pids if one not in ready]:
            del self._pids[name]
            self._watchdog.forget(name)
        if self._router and self._router not in ready:
            # Nobody can be heard without it, nor at once when it is back.
            self._watchdog.forgive(now_s + RECONNECT_S)
        for stuck in self._watchdog.look(now_s):
            name = stuck.name or self._router
            if name and self._processes[name].watchdog_s > 0.0:
                self._note([self._stack.kill(name, stuck.reason)])

    def _limit_memory(self) -> None:
        self._usage.measure({one.name: one.pid for one in self.latest if one.up_s and one.pid})
        for name, process in self._processes.items():
            used_mb = self._usage.rss_bytes(name) / 1e6
            if 0 < process.memory_limit_mb < used_mb:
                limit = f"memory_limit_mb = {process.memory_limit_mb}"
                self._note([self._stack.kill(name, f"uses {used_mb:.0f} MB, above {limit}")])
                self._usage.forget(name)

    def _motion_life(self) -> int | None:
        """Tell one life of motion from another: by its process, or by its token elsewhere."""
        if "motion" not in self._stack.table.elsewhere:
            return next((one.pid for one in self.latest if _is_ready(one, "motion")), None)
        seen = self._host.present("alive/motion")
        self._motion_lives += seen and not self._motion_seen
        self._motion_seen = seen
        return self._motion_lives if seen else None

    def _given_up(self) -> str:
        lost = [f"{one.name} {one.reason}" for one in self.latest if one.state == "given_up"]
        return "; ".join(lost)

    def _note(self, events: list[Event | None] | list[Event], by: str = "") -> None:
        for event in events:
            if event is not None:
                self._say(event.level, event.name, event.text, **({"by": by} if by else {}))
                self._report_at_s = 0.0

    def _say(self, level: str, name: str, text: str, **fields: str) -> None:
        getattr(self._host.log, level)(text, process=name, **fields)
        self._tell(level, f"{name} {text}")

    def _report(self, now_s: float) -> None:
        self._report_at_s = now_s + REPORT_S
        judged = verdict(one.state for one in self.latest)
        absent = ", ".join(
            f"{one.name} is {one.state}" for one in self.latest if not _is_ready(one)
        )
        self._status.put(
            SupervisorStatus(
                verdict=judged,
                reason=self._given_up() or absent,
                held=self._hold.stands,
                host=self._stack.table.here,
                log_dir=str(self._stack.log_dir.resolve()),
                processes=[self._usage.report(one) for one in self.latest],
            )
        )


def _is_ready(one: Status, name: str = "") -> bool:
    return one.state == "ready" and (not name or one.name == name)
