"""A planner that starts again: it goes on with the trial that the one before it has left."""

from collections.abc import Callable

from fras_common.errors import FrasError
from fras_common.messages import TaskRequest
from fras_common.scenario import Scenario
from fras_common.service import ServiceHost
from fras_common.service.recall import Recall
from fras_common.topics import TASK
from fras_planner.adapter import PlanMaker
from fras_planner.executive import Executive
from fras_planner.memory import Resumption
from fras_planner.performer import Performer
from fras_planner.resumption import TakenUp, take_up

__all__ = ["Enter", "Restart"]

Enter = Callable[[TaskRequest, Scenario, Resumption | None], tuple[Executive, PlanMaker]]
"""Makes the executive and the planner of a trial that begins, or is gone on with."""


class Restart:
    """Asks which trial is under way, and goes on with it.

    Parameters
    ----------
    host : ServiceHost
    performer : Performer
    enter : Enter
    """

    def __init__(self, host: ServiceHost, performer: Performer, enter: Enter) -> None:
        self._host = host
        self._performer = performer
        self._enter = enter
        self._recall = Recall(host, take_up(), self._take_up)

    def give_up(self) -> None:
        """Take nothing up: a trial begins."""
        self._recall.give_up()

    def wake(self, now_s: float) -> float | None:
        """Ask what is to be known; seconds until it is asked again, or None."""
        return self._recall.wake(now_s)

    def _take_up(self, taken: TakenUp | None) -> None:
        if taken is None:
            return
        resumed = taken.resumption
        status, request = resumed.status, resumed.request
        if request is None:
            # Nobody knows any more what was to be done: it can only be ended.
            request = TaskRequest(command="start", trial=status.trial)
        scenario = request.scenario or Scenario()
        executive, plans = self._enter(request, scenario, resumed)
        self._recall_plan(plans, resumed)
        # This process speaks for what the one before it was told.
        if taken.record is not None:
            self._host.publish_mirror(TASK, taken.record)
        self._host.log.warning("trial taken up", trial=status.trial, phase=status.phase)
        self._performer.start(executive.run(), scenario.run.peer_timeout_s, taken.result)

    def _recall_plan(self, plans: PlanMaker, resumed: Resumption) -> None:
        """Know the plan that is followed, for whoever asks about it."""
        if resumed.followed is None:
            return
        try:
            plans.recall(*resumed.followed)
        except FrasError as error:
            self._host.log.warning("the last plan can't be told", problem=str(error))
