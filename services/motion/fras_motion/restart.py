"""A motion that starts again: the holds as they were, and the trial where it was left."""

from collections.abc import Callable, Mapping

from fras_common import messages as m
from fras_common.errors import FrasError
from fras_common.service import ServiceHost
from fras_common.service.recall import Recall
from fras_common.topics import MOTION_RESET
from fras_motion.adapter import snapshot_of
from fras_motion.arm_access import ArmAccess
from fras_motion.holds import RESTART, Holds
from fras_motion.resumption import Left, TakenUp, given_up, recall_holds, take_up
from fras_motion.tick_loop import TickLoop
from fras_motion.trial import MotionTrial

__all__ = ["Restart"]


class Restart:
    """Takes up what another motion left; the arms stand there, until resumed.

    Parameters
    ----------
    host : ServiceHost
    holds : Holds
    arms : ArmAccess
    loop : TickLoop
        Goes on with the trial.
    new_trial : callable
        Makes the trial that a request began.
    """

    def __init__(
        self,
        host: ServiceHost,
        holds: Holds,
        arms: ArmAccess,
        loop: TickLoop,
        new_trial: Callable[[m.ResetRequest], MotionTrial],
    ) -> None:
        self._host = host
        self._holds = holds
        self._arms = arms
        self._loop = loop
        self._new_trial = new_trial
        self._recall_holds = Recall(host, recall_holds(), self._restore_holds, "holds")
        self._recall = Recall(host, take_up(), self._take_up)

    def keep(self, again: Callable[[], None]) -> bool:
        """Keep what asks of a trial while it is not known yet which one is under way."""
        return self._loop.trial is None and self._recall.keep(again)

    def give_up(self) -> None:
        """Take nothing up: a trial begins."""
        self.forget()
        self._recall.give_up()

    def forget(self) -> None:
        """Lift the hold that stands for the restart: nothing of before it is gone on with."""
        if RESTART in self._holds.current():
            self._holds.resume(RESTART, by=RESTART)

    def wake(self, now_s: float) -> float | None:
        """Ask what is to be known, the holds before the trial; seconds until it is asked again."""
        return (self._recall if self._recall_holds.is_done else self._recall_holds).wake(now_s)

    def _restore_holds(self, holds: Mapping[str, str]) -> None:
        self._holds.restore(holds)
        self._arms.restore(holds)
        if holds:
            self._host.log.warning("holds restored", holds=holds)

    def _take_up(self, taken: TakenUp) -> None:
        if taken.left is not None and self._loop.trial is None:
            self._go_on(taken.left)
        if taken.problem:
            self._host.log.error("the trial under way can't be taken up", problem=taken.problem)
        if taken.lost is not None:
            self._loop.results.put(taken.lost)

    def _go_on(self, left: Left) -> None:
        self._holds.hold(RESTART, f"motion started again at tick {left.state.tick}")
        try:
            trial = self._new_trial(left.asked.request)
            trial.resume(snapshot_of(left.state), left.used)
        except FrasError as error:
            self.forget()
            self._host.log.error("the trial under way can't be taken up", problem=str(error))
            if left.result is not None:
                self._loop.results.put(given_up(left.result))
            return
        self._loop.enter(trial, left.asked.request)
        # This process speaks for what the one before it was told.
        self._host.publish_mirror(MOTION_RESET, left.asked.record)
        if left.result is not None:
            self._loop.results.put(left.result)
        self._host.log.warning("trial taken up", trial=trial.name, tick=trial.tick)
