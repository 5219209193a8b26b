"""One trial as situation awareness sees it: messages in, messages out, no bus."""

from collections.abc import Sequence
from typing import TypeVar

from fras_common import messages as m
from fras_common.scenario import Scenario
from fras_sa.adapter import (
    context_of,
    model_of,
    parameters_of,
    robot_of,
    target_of,
    tissue_of,
    verdict_of,
)
from fras_sa.awareness import Awareness, AwarenessError, Memory, Trend
from fras_sa.errors import LostMoment, NothingKnown
from fras_sa.join import Moment, TickJoin

H = TypeVar("H", bound=m.Header)


class WatchedTrial:
    """What is known of one trial.

    Parameters
    ----------
    scenario : Scenario
        For its thresholds, and whether the tissue that is seen is another one than its model.

    Attributes
    ----------
    has_patient : bool
        Whether a tick is judged only with the patient's state.
    verdict : Verdict or None
        The last one.
    problem : AwarenessError or None
        Why the scene can't be watched.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._parameters = parameters_of(scenario.awareness)
        self._awareness: Awareness | None = None
        self._memory = Memory()
        self.has_patient = scenario.has_patient
        self._join = TickJoin(has_patient=self.has_patient)
        self._now: Moment | None = None
        self.verdict: m.Verdict | None = None
        self.problem: AwarenessError | None = None

    @property
    def tick(self) -> int:
        """The last tick judged; -1 before the first."""
        return self.verdict.tick if self.verdict is not None else -1

    @property
    def missing(self) -> str:
        """The service that the next verdict waits for; empty while nothing of it is here."""
        if self.problem is not None:
            return ""
        if self._awareness is None and not self._join.is_empty:
            return "sim"
        return self._join.missing

    def see_model(self, model: m.TissueModel) -> None:
        """Take the scene; once is enough, a simulator that starts again says it again.

        Raises
        ------
        AwarenessError
            If it can't be watched; kept as `problem`.
        """
        if self._awareness is not None:
            return
        try:
            self._awareness = Awareness(self._parameters, model_of(model))
        except AwarenessError as error:
            self.problem = error
            raise

    def see_state(self, state: m.TissueState | m.RobotState) -> None:
        """Take a state; one of a tick that has been judged changes nothing.

        Raises
        ------
        TooFarAhead
        """
        self._join.add(state)

    def see_patient(self, state: m.TissueState) -> None:
        """Take a state of the patient; nothing where the trial has none.

        Raises
        ------
        TooFarAhead
        """
        self._join.add_seen(state)

    def judge_next(self) -> m.Verdict | None:
        """Judge the next tick as soon as all of its states and the model are here."""
        if self._awareness is None or (moment := self._join.take()) is None:
            return None
        judgement = self._awareness.judge(
            tissue_of(moment.tissue, moment.seen), robot_of(moment.robot), self._memory
        )
        self._memory = judgement.memory
        self._now = moment
        self.verdict = verdict_of(judgement, self._parameters, moment.seen)
        return self.verdict

    def resume(
        self,
        verdict: m.Verdict | None,
        tissues: Sequence[m.TissueState],
        robots: Sequence[m.RobotState],
        patients: Sequence[m.TissueState] = (),
    ) -> list[m.Verdict]:
        """Come to where the one before was; the scene has been taken.

        Parameters
        ----------
        verdict : Verdict or None
            The last one; None before the first.
        tissues, robots, patients : sequence of TissueState, RobotState, TissueState
            From its tick on, or from 0 on; of the patient where there is one.

        Returns
        -------
        list of Verdict
            To say: the last one again, and those that were still to come.

        Raises
        ------
        LostMoment
            The states that the last verdict is about are not among these.
        """
        said: list[m.Verdict] = []
        if verdict is not None:
            tissue, robot = _of_tick(verdict.tick, tissues), _of_tick(verdict.tick, robots)
            seen = _of_tick(verdict.tick, patients) if self.has_patient else tissue
            if tissue is None or robot is None or seen is None:
                raise LostMoment(verdict.tick)
            trend = Trend.restored(
                verdict.tick, verdict.level, verdict.max_force_n, verdict.force_rate_n_s
            )
            self._memory = Memory.restored(verdict.max_height, robot_of(robot).action, trend)
            self._now = Moment(tissue, robot, seen)
            self._join = TickJoin(verdict.tick + 1, has_patient=self.has_patient)
            self.verdict = verdict
            said.append(verdict)
        for state in (*tissues, *robots):
            self._join.add(state)
        for state in patients:
            self._join.add_seen(state)
        while (one := self.judge_next()) is not None:
            said.append(one)
        return said

    def context(self, request: m.ContextRequest) -> m.Context:
        """Tell the situation at the last tick judged.

        Raises
        ------
        AwarenessError, NothingKnown
        """
        if self.problem is not None:
            raise self.problem
        awareness, now = self._known()
        tissue, robot = tissue_of(now.tissue, now.seen), robot_of(now.robot)
        view = awareness.context(tissue, robot, self._memory, request.expected)
        return context_of(view, now.tissue, request.request_id)

    def target(self, request: m.TargetRequest) -> m.TargetReply:
        """Tell where an action is to bring its arm.

        Raises
        ------
        AwarenessError, NothingKnown
        """
        awareness, now = self._known()
        tissue, robot = tissue_of(now.tissue, now.seen), robot_of(now.robot)
        return target_of(
            awareness.target(
                tissue, robot, action=request.action, arm=request.arm, block=request.block
            )
        )

    def _known(self) -> tuple[Awareness, Moment]:
        if self._awareness is None or self._now is None:
            raise NothingKnown("no state of this trial has been seen yet: reset and tick first")
        return self._awareness, self._now


def _of_tick(tick: int, states: Sequence[H]) -> H | None:
    return next((one for one in states if one.tick == tick), None)
