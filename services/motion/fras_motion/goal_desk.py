"""What the executive asks of motion: goals, refused by name or begun, and an end of them."""

from fras_common import messages as m
from fras_common.errors import FrasError
from fras_common.service import Deferred, ServiceHost
from fras_common.topics import CANCEL, EXECUTE
from fras_motion.adapter import goal_of
from fras_motion.errors import Refused
from fras_motion.refusals import refusal
from fras_motion.restart import Restart
from fras_motion.tick_loop import TickLoop
from fras_motion.trial import MotionTrial

__all__ = ["GoalDesk"]


class GoalDesk:
    """Serves `motion/execute` and `motion/cancel`.

    Parameters
    ----------
    host : ServiceHost
    loop : TickLoop
        Moves the trial that is asked of.
    restart : Restart
        Keeps what is asked before it is known which trial is under way.
    """

    def __init__(self, host: ServiceHost, loop: TickLoop, restart: Restart) -> None:
        self._host = host
        self._loop = loop
        self._restart = restart
        self._accepted: tuple[MotionTrial, m.ExecuteRequest] | None = None

    def open(self) -> None:
        """Take requests from now on."""
        self._host.serve_deferred(EXECUTE, self._begin_execute)
        self._host.serve_deferred(CANCEL, self._begin_cancel)

    def _begin_execute(self, pending: Deferred[m.ExecuteRequest, m.ExecuteReply]) -> None:
        if self._restart.keep(lambda: self._begin_execute(pending)):
            return
        try:
            reply = self._execute(pending.request)
        except FrasError as error:
            pending.fail(error)
        else:
            pending.reply(reply)

    def _execute(self, request: m.ExecuteRequest) -> m.ExecuteReply:
        trial = self._loop.trial
        try:
            if trial is None:
                raise Refused("another_trial", f"{request.trial!r}; none has begun: reset first")
            if (trial, request) == self._accepted:
                # Asked again because the answer was lost: it runs, or has ended.
                return m.ExecuteReply(accepted=True, reason="")
            trial.execute(request.trial, goal_of(request))
        except Refused as error:
            return refusal(self._host, request.goal_id, error)
        self._accepted = trial, request
        return m.ExecuteReply(accepted=True, reason="")

    def _begin_cancel(self, pending: Deferred[m.CancelRequest, m.CancelReply]) -> None:
        if self._restart.keep(lambda: self._begin_cancel(pending)):
            return
        trial = self._loop.trial
        if trial is None or trial.name != pending.request.trial:
            # Nothing of it moves the arms; what does is none of its business.
            pending.reply(m.CancelReply(tick=self._host.tick))
            return
        self._restart.forget()
        self._loop.cancel(trial, pending)
