"""What the executive asks: for a context, which waits until its tick is judged, and for targets."""

from collections.abc import Callable

from fras_common import messages as m
from fras_common.errors import FrasError
from fras_common.service import Deferred, ServiceHost
from fras_common.service.recall import Recall
from fras_common.topics import CONTEXT, SA_CONTEXT, SA_TARGET
from fras_sa.errors import OtherTrial, TooManyQuestions
from fras_sa.trial import WatchedTrial

__all__ = ["Questions"]

# Each is looked at again with each verdict.
QUESTIONS = 100


class Questions:
    """Serves `sa/context` and `sa/target`.

    Parameters
    ----------
    host : ServiceHost
    recall : Recall
        Keeps what is asked before it is known which trial is under way.
    trial : callable
        The trial that is watched now.
    """

    def __init__(
        self, host: ServiceHost, recall: Recall, trial: Callable[[], WatchedTrial]
    ) -> None:
        self._host = host
        self._recall = recall
        self._trial = trial
        self._pending: list[Deferred[m.ContextRequest, m.Context]] = []
        self._context = host.publisher(CONTEXT)
        host.serve_deferred(SA_TARGET, self._on_target_request)
        host.serve_deferred(SA_CONTEXT, self._on_context_request)

    @property
    def waiting(self) -> bool:
        """Whether any of them waits for its tick."""
        return bool(self._pending)

    def look_again(self) -> None:
        """Answer those that waited for the tick that was judged now."""
        waiting, self._pending = self._pending, []
        for pending in waiting:
            self._on_context_request(pending)

    def fail(self, error: FrasError) -> None:
        """Answer those that wait with what makes waiting vain."""
        waiting, self._pending = self._pending, []
        for pending in waiting:
            pending.fail(error)

    def _on_context_request(self, pending: Deferred[m.ContextRequest, m.Context]) -> None:
        """Answer, or keep the question until its tick has been judged."""
        request, trial = pending.request, self._trial()
        if self._is_early(request.trial, lambda: self._on_context_request(pending)):
            return
        try:
            self._require_trial(request.trial)
            if trial.problem is None and (trial.verdict is None or trial.tick < request.min_tick):
                if len(self._pending) >= QUESTIONS:
                    raise TooManyQuestions(len(self._pending), request.min_tick)
                self._pending.append(pending)
                return
            context = trial.context(request)
        except FrasError as error:
            pending.fail(error)
            return
        pending.reply(self._context.put(context))

    def _on_target_request(self, pending: Deferred[m.TargetRequest, m.TargetReply]) -> None:
        request = pending.request
        if self._is_early(request.trial, lambda: self._on_target_request(pending)):
            return
        try:
            self._require_trial(request.trial)
            reply = self._trial().target(request)
        except FrasError as error:
            pending.fail(error)
        else:
            pending.reply(reply)

    def _is_early(self, asked: str, again: Callable[[], None]) -> bool:
        """Whether a question comes before it is known which trial is under way: it is kept."""
        return asked != self._host.gate.trial and self._recall.keep(again)

    def _require_trial(self, asked: str) -> None:
        if asked != self._host.gate.trial:
            raise OtherTrial(asked, self._host.gate.trial)
