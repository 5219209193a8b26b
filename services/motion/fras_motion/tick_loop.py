"""Logical time: a tick for each verdict while one is wanted; else what is waited for, and how long.

Motion is the only clock of a trial, and this is what goes by the clock on the wall.
"""

import time
from collections.abc import Callable

from fras_common import messages as m
from fras_common.service import Deferred, ServiceHost
from fras_common.topics import ACTION_RESULT, ROBOT_STATE, VERDICT
from fras_motion.adapter import action_result, robot_state, verdict_of
from fras_motion.holds import Holds
from fras_motion.log_watch import LogWatch
from fras_motion.pacing import Pacer
from fras_motion.page_watch import PageWatch
from fras_motion.patience import Patience
from fras_motion.peers import Peers
from fras_motion.states import ActionResult
from fras_motion.trial import MotionTrial

__all__ = ["TickLoop"]

SAY_AGAIN_S = 0.5


class TickLoop:
    """Moves the trial under way tick by tick, and ends its action where waiting has to end.

    Parameters
    ----------
    host : ServiceHost
    holds : Holds
    operating_state : callable
        State of an arm by CRTK, by the arm's name.
    clock : callable
        Returns monotonic seconds.

    Attributes
    ----------
    trial : MotionTrial or None
        The one under way; None if none has begun.
    request : ResetRequest or None
        What began it.
    results : Publisher of ActionResult
    """

    def __init__(
        self,
        host: ServiceHost,
        holds: Holds,
        operating_state: Callable[[str], str],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._host = host
        self._holds = holds
        self._operating_state = operating_state
        self._clock = clock
        self.trial: MotionTrial | None = None
        self.request: m.ResetRequest | None = None
        self._verdict: m.Verdict | None = None
        self._cancels: list[Deferred[m.CancelRequest, m.CancelReply]] = []
        self._pacer = Pacer(dt_s=0.0, pace=0.0)
        self._patience = Patience(peer_timeout_s=0.0, hold_timeout_s=0.0)
        self._said_s = 0.0
        self._peers = Peers(host, self._say_to_returned)
        self._log = LogWatch(host, holds)
        self._page = PageWatch(host, holds)
        self._states = host.publisher(ROBOT_STATE)
        self.results = host.publisher(ACTION_RESULT)
        host.subscribe(VERDICT, self._on_verdict)

    def enter(self, trial: MotionTrial, request: m.ResetRequest) -> None:
        """Begin a trial, or go on with one; what the one before it does ends."""
        if self.trial is not None:
            self._finish(self.trial, self.trial.end("reset"))
        run = request.scenario.run
        self.trial, self.request, self._verdict = trial, request, None
        self._pacer = Pacer(request.scenario.tissue.dt_s, run.pace)
        self._patience = Patience(run.peer_timeout_s, run.hold_timeout_s)
        self._log.begin(request.trial, required=run.require_log)
        self._page.begin(required=run.supervised)
        self._host.enter_trial(request.trial)
        self.say(trial)

    def say(self, trial: MotionTrial) -> None:
        """Say where the arms of a trial are."""
        self._said_s = self._clock()
        self._host.tick = trial.tick
        self._states.put(robot_state(trial.controller.snapshot, trial.name, self._operating_state))

    def cancel(self, trial: MotionTrial, pending: Deferred[m.CancelRequest, m.CancelReply]) -> None:
        """Bring the trial's arms to rest, and answer then."""
        trial.cancel(pending.request.reason)
        self._log.end()
        self._page.end()
        self._cancels.append(pending)

    def wake(self) -> float | None:
        """Do the next tick if it is due; else see whether something has been missing too long."""
        waits_s = (self._log.wake(), self._page.wake(), self._wake_trial())
        return min((wait_s for wait_s in waits_s if wait_s is not None), default=None)

    def _wake_trial(self) -> float | None:
        self._host.facts["holds"] = self._holds.in_words()
        trial, now_s = self.trial, self._clock()
        if trial is not None and trial.impose_holds():
            # No tick may follow that would show it.
            self.say(trial)
        if trial is None or not trial.controller.wants_tick:
            self._end_cancels(trial)
        if trial is None:
            return None
        verdict = verdict_of(self._verdict) if self._verdict is not None else None
        if verdict is not None and trial.may_tick(verdict):
            self._host.waiting_for = ""
            self._patience.rest()
            if (wait_s := self._pacer.wait_s(now_s)) > 0.0:
                return wait_s
            advance = trial.advance(verdict)
            self._pacer.ticked(now_s)
            self.say(trial)
            self._finish(trial, advance.result)
            return self._patience.period_s
        return self._wait(trial, now_s)

    def _wait(self, trial: MotionTrial, now_s: float) -> float | None:
        if trial.goal is None:
            self._patience.rest()
            return None
        missing = self._peers.missing(trial.tick) if trial.controller.wants_tick else ""
        reason = self._patience.exhausted(now_s, missing, self._holds)
        self._host.waiting_for = self._patience.waiting_for
        if reason:
            self._finish(trial, trial.end(reason, "watchdog" if missing else "hold_timeout"))
        elif self._host.waiting_for:
            # No verdict, no tick: the arms stand already.
            self._end_cancels(trial)
        if missing and now_s - self._said_s >= SAY_AGAIN_S:
            # It, or the answer, may be lost with whoever was killed; the answer is the same.
            self.say(trial)
        return self._patience.period_s

    def _say_to_returned(self) -> None:
        """Say where the arms are: who came back may have missed it, and waits, too."""
        if self.trial is not None and self.trial.runs and self.trial.goal is None:
            self.say(self.trial)

    def _on_verdict(self, verdict: m.Verdict) -> None:
        if self.trial is not None:
            if verdict.tick == self.trial.controller.verdict_tick:
                # The arms were said again, with a new hold, and so were judged again.
                return
            self.trial.controller.expect(verdict.tick)
        self._verdict = verdict

    def _end_cancels(self, trial: MotionTrial | None) -> None:
        pending, self._cancels = self._cancels, []
        if pending and trial is not None:
            self._finish(trial, trial.end("cancelled"))
        for one in pending:
            one.reply(m.CancelReply(tick=self._host.tick))

    def _finish(self, trial: MotionTrial, result: ActionResult | None) -> None:
        if result is not None and trial.goal is not None:
            goal, trial.goal = trial.goal, None
            self._host.waiting_for = ""
            self.results.put(action_result(result, goal, trial.name))
