"""Performs the effects of an executive on a real bus, one at a time."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Any

from fras_common.bus import NoAnswer, Publisher
from fras_common.errors import FrasError
from fras_common.messages import ActionResult, Plan, TaskStatus
from fras_common.service import ServiceHost
from fras_planner.effects import Accept, Ask, AwaitDecision, AwaitResult, Effect, Pause, Say

Steps = Generator[Effect, Any, Any]

# One action is under way at a time; what nobody awaits is kept no longer than that.
RESULTS = 16
AGAIN_S = 0.25
TOLD_AFTER_S = 0.5


@dataclass
class _Unanswered:
    """A question whose server is away.

    Attributes
    ----------
    since_s : float
        When it was found to be; nothing before it was asked again is lost.
    again_s : float
        When to ask again.
    """

    ask: Ask
    since_s: float
    again_s: float


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
    clock : callable
        Returns monotonic seconds: for how long a service that was asked may be away.
    """

    def __init__(
        self,
        host: ServiceHost,
        plans: Publisher[Plan],
        statuses: Publisher[TaskStatus],
        on_accept: Callable[[], None],
        on_end: Callable[[FrasError | None], None],
        clock: Callable[[], float],
    ) -> None:
        self._host = host
        self._plans = plans
        self._statuses = statuses
        self._on_accept = on_accept
        self._on_end = on_end
        self._clock = clock
        self._patience_s = 0.0
        self._unanswered: _Unanswered | None = None
        self._pause: Pause | None = None
        self._pause_by_s = 0.0
        self._steps: Steps | None = None
        self._turn = 0
        self._results: dict[str, ActionResult] = {}
        self.awaited = ""

    def start(
        self, steps: Steps, patience_s: float = 0.0, result: ActionResult | None = None
    ) -> None:
        """Begin a coroutine.

        Parameters
        ----------
        steps : Steps
        patience_s : float
            For how long a service may be away before a question to it fails.
        result : ActionResult, optional
            One that has come already; what was delivered since `forget_results` is known, too.
        """
        self._steps = steps
        self._patience_s = patience_s
        if result is not None:
            self._results.setdefault(result.goal_id, result)
        self.awaited = ""
        self.drive(None)

    def forget_results(self) -> None:
        """Know of no action that has ended: a trial begins, none of whose goals is under way."""
        self._results.clear()

    @property
    def missing(self) -> str:
        """The service that is away though it was asked; empty if none is."""
        if self._pause is not None:
            return self._pause.waiting_for
        away = self._unanswered
        if away is None or self._clock() - away.since_s < TOLD_AFTER_S:
            return ""
        return away.ask.query.server

    def wake(self) -> float | None:
        """Ask again what is due, go on after a pause; return the seconds until then, or None."""
        if self._pause is not None:
            left_s = self._pause_by_s - self._clock()
            if left_s <= 0.0:
                self.drive(None)
                return None
            return left_s
        away = self._unanswered
        if away is None:
            return None
        now_s = self._clock()
        if now_s < away.again_s:
            return away.again_s - now_s
        away.again_s = now_s + away.ask.timeout_s + AGAIN_S
        self._ask(away.ask)
        return None

    def deliver(self, result: ActionResult) -> None:
        """Take the end of an action; it may come before it is waited for."""
        self._results[result.goal_id] = result
        while len(self._results) > RESULTS:
            del self._results[next(iter(self._results))]
        # Nothing is awaited as "": a result may be called so.
        if self.awaited and self.awaited == result.goal_id:
            self.drive(self._take_result())

    def drive(self, outcome: Any) -> None:
        """Send `outcome` in, throw it if it is an error, and go on until something must come."""
        while self._steps is not None:
            self._turn += 1
            self.awaited = ""
            self._unanswered = None
            self._pause = None
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
                case AwaitDecision():
                    return
                case Pause(seconds_s):
                    self._pause, self._pause_by_s = effect, self._clock() + seconds_s
                    return
                case Ask():
                    self._ask(effect)
                    return

    def _ask(self, ask: Ask) -> None:
        turn, asked_s = self._turn, self._clock()

        def resume(outcome: Any) -> None:
            # An abort may have gone on meanwhile; then this answer comes too late.
            if turn == self._turn and not self._may_wait(ask, outcome, asked_s):
                self.drive(outcome)

        self._host.bus.ask(
            ask.query,
            ask.request,
            lambda outcome: self._host.post(lambda: resume(outcome)),
            ask.timeout_s,
        )

    def _may_wait(self, ask: Ask, outcome: Any, asked_s: float) -> bool:
        """Whether a question is to be asked again: who serves it is away, and not for too long."""
        now_s = self._clock()
        # One that is there and does not answer had all the time that it was given.
        is_away = isinstance(outcome, NoAnswer) and now_s - asked_s < ask.timeout_s
        if not (is_away and ask.is_patient):
            return False
        since_s = self._unanswered.since_s if self._unanswered is not None else asked_s
        if now_s - since_s >= self._patience_s:
            return False
        self._unanswered = _Unanswered(ask, since_s, now_s + AGAIN_S)
        return True

    def _publish(self, message: Plan | TaskStatus) -> Plan | TaskStatus:
        if isinstance(message, Plan):
            return self._plans.put(message)
        return self._statuses.put(message)

    def _take_result(self) -> ActionResult:
        return self._results.pop(self.awaited)

    def _end(self, error: FrasError | None) -> None:
        self._steps = None
        self._on_end(error)
