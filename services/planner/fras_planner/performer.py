"""Performs the effects of an executive on a real bus, one at a time."""

from collections.abc import Callable, Generator
from typing import Any

from fras_common.bus import Publisher
from fras_common.errors import FrasError
from fras_common.messages import ActionResult, Plan, TaskStatus
from fras_common.service import ServiceHost
from fras_planner.effects import Accept, Ask, AwaitResult, Effect, Say

Steps = Generator[Effect, Any, Any]


class Performer:
    """Drives one coroutine of effects; everything happens on the host's loop.

    Parameters
    ----------
    host : ServiceHost
    plans, statuses : Publisher
        Where `Say` goes.
    on_accept : callable
        What `Accept` means.
    on_end : callable
        Called once, when the coroutine has ended, with the error that ended it or None.
    """

    def __init__(
        self,
        host: ServiceHost,
        plans: Publisher[Plan],
        statuses: Publisher[TaskStatus],
        on_accept: Callable[[], None],
        on_end: Callable[[FrasError | None], None],
    ) -> None:
        self._host = host
        self._plans = plans
        self._statuses = statuses
        self._on_accept = on_accept
        self._on_end = on_end
        self._steps: Steps | None = None
        self._turn = 0
        self._results: dict[str, ActionResult] = {}
        self.awaited = ""

    def start(self, steps: Steps) -> None:
        """Begin a coroutine."""
        self._steps = steps
        self._results.clear()
        self.awaited = ""
        self.drive(None)

    def deliver(self, result: ActionResult) -> None:
        """Take the end of an action; it may come before it is waited for."""
        self._results[result.goal_id] = result
        if self.awaited == result.goal_id:
            self.drive(self._take_result())

    def drive(self, outcome: Any) -> None:
        """Send `outcome` in, throw it if it is an error, and go on until something must come."""
        while self._steps is not None:
            self._turn += 1
            self.awaited = ""
            try:
                if isinstance(outcome, FrasError):
                    effect = self._steps.throw(outcome)
                else:
                    effect = self._steps.send(outcome)
            except StopIteration:
                self._end(None)
                return
            except FrasError as error:
                self._end(error)
                return
            match effect:
                case Say(message):
                    outcome = self._publish(message)
                case Accept():
                    outcome = self._on_accept()
                case AwaitResult(goal_id):
                    self.awaited = goal_id
                    if goal_id not in self._results:
                        return
                    outcome = self._take_result()
                case Ask():
                    self._ask(effect)
                    return

    def _ask(self, ask: Ask) -> None:
        turn = self._turn

        def resume(outcome: Any) -> None:
            # An abort may have gone on meanwhile; then this answer comes too late.
            if turn == self._turn:
                self.drive(outcome)

        self._host.bus.ask(
            ask.query,
            ask.request,
            lambda outcome: self._host.post(lambda: resume(outcome)),
            ask.timeout_s,
        )

    def _publish(self, message: Plan | TaskStatus) -> Plan | TaskStatus:
        if isinstance(message, Plan):
            return self._plans.put(message)
        return self._statuses.put(message)

    def _take_result(self) -> ActionResult:
        return self._results.pop(self.awaited)

    def _end(self, error: FrasError | None) -> None:
        self._steps = None
        self._on_end(error)
