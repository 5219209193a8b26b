"""Situation awareness again: each verdict, each context and each target, from recorded states."""

from collections.abc import Iterator

from fras_audit.builds import rounding
from fras_audit.comparison import Tally, unstamped
from fras_audit.progress import Progress
from fras_audit.recorded import Recorded, reply_of, request_of
from fras_audit.ticks import by_tick, first_of_tick, ticks_while
from fras_common import messages as m
from fras_common.errors import FrasError
from fras_common.topics import (
    CONTEXT,
    PATIENT,
    ROBOT_STATE,
    SA_CONTEXT,
    SA_RESET,
    SA_TARGET,
    TISSUE_MODEL,
    TISSUE_STATE,
    VERDICT,
)
from fras_sa.trial import WatchedTrial

# At which ticks it may have been answered, question, answer, and number on its key.
Asked = tuple[range, m.TargetRequest, m.TargetReply, int]


def audit(recorded: Recorded, progress: Progress) -> list[Tally]:
    """Derive what situation awareness said, tick by tick.

    Returns
    -------
    list of Tally
        Verdicts, contexts, targets.
    """
    return _Audit(recorded).run(progress)


class _Audit:
    def __init__(self, recorded: Recorded) -> None:
        tolerance = rounding(recorded, "sa")
        self._recorded = recorded
        self._asked = list(_targets(recorded))
        self._verdicts = Tally("sa", "verdicts", len(recorded.of(VERDICT)), tolerance)
        self._contexts = Tally("sa", "contexts", len(recorded.of(CONTEXT)), tolerance)
        self._targets = Tally("sa", "targets", len(self._asked), tolerance)
        self._tallies = [self._verdicts, self._contexts, self._targets]
        self._robots = first_of_tick(recorded.of(ROBOT_STATE))
        self._tissues = first_of_tick(recorded.of(TISSUE_STATE))
        self._patients = first_of_tick(recorded.of(PATIENT.state))
        self._said = by_tick(recorded.of(VERDICT))
        self._told = by_tick(recorded.of(CONTEXT))
        # A context in the mirror is numbered like the one published.
        self._answers = {
            (answer.source, answer.seq): (request_of(SA_CONTEXT, mirror), answer)
            for mirror in recorded.mirrors(SA_CONTEXT)
            if mirror.fault is None
            for answer in [reply_of(SA_CONTEXT, mirror)]
        }

    def run(self, progress: Progress) -> list[Tally]:
        reset = self._recorded.reset(SA_RESET)
        models = self._recorded.of(TISSUE_MODEL)
        if reset is None or not models:
            what = "the reset of situation awareness" if reset is None else TISSUE_MODEL.key
            self._stop(f"nothing derived: the log lacks {what}")
            return self._tallies
        watched = WatchedTrial(reset.scenario)
        try:
            watched.see_model(models[0])
        except FrasError as error:
            self._stop(f"the scene can't be watched: {error}")
            return self._tallies
        last = max([*self._said, *self._told, *self._tissues, -1])
        for tick in range(last + 1):
            if not self._judge(watched, tick):
                break
            progress("sa", tick + 1, last + 1)
        return self._tallies

    def _judge(self, watched: WatchedTrial, tick: int) -> bool:
        """Judge one tick; False if what it needs is not in the log."""
        needed = {ROBOT_STATE.key: self._robots, TISSUE_STATE.key: self._tissues}
        if watched.has_patient:
            needed[PATIENT.state.key] = self._patients
        missing = [key for key, states in needed.items() if tick not in states]
        if missing:
            self._stop(f"not derived from tick {tick} on: the log lacks {' and '.join(missing)}")
            return False
        watched.see_state(self._robots[tick])
        watched.see_state(self._tissues[tick])
        if watched.has_patient:
            watched.see_patient(self._patients[tick])
        verdict = watched.judge_next()
        if verdict is None:
            self._stop(f"not derived from tick {tick} on: its states do not belong together")
            return False
        said = self._said.get(tick, [])
        for one in said:
            self._verdicts.compare_messages(f"tick {tick}", one, verdict)
        if not said and not self._recorded.damage:
            self._verdicts.lacks(f"tick {tick}", unstamped(verdict))
        self._tell(watched, tick)
        self._aim(watched, tick)
        return True

    def _tell(self, watched: WatchedTrial, tick: int) -> None:
        for told in self._told.get(tick, []):
            where = f"context {told.request_id} at tick {tick}"
            if (told.source, told.seq) not in self._answers:
                self._contexts.notes.append(f"{where}: its question is not in the log")
                continue
            request, answer = self._answers[told.source, told.seq]
            try:
                derived = watched.context(request)
            except FrasError as error:
                self._contexts.surplus(where, f"a context; refused again: {error}", told.seq)
                continue
            self._contexts.compare_messages(where, told, derived)
            if unstamped(answer) != unstamped(told):
                self._contexts.compare_messages(f"{where}, as answered", answer, derived)

    def _aim(self, watched: WatchedTrial, tick: int) -> None:
        """Answer again what was asked at this tick."""
        for place, (ticks, request, reply, seq) in enumerate(self._asked):
            if tick in ticks:
                # A question may have come between two ticks: then either may be its moment.
                is_last = tick == ticks[-1]
                where = f"{request.action}({request.arm},{request.block}) at tick {tick}"
                try:
                    derived = watched.target(request)
                except FrasError as error:
                    if is_last:
                        self._targets.surplus(where, f"a target; refused again: {error}", seq)
                    continue
                if not is_last and derived != reply:
                    continue
                self._targets.compare(where, reply, derived, seq)
                self._asked[place] = (range(0), request, reply, seq)

    def _stop(self, why: str) -> None:
        for tally in self._tallies:
            tally.notes.append(why)


def _targets(recorded: Recorded) -> Iterator[Asked]:
    said = recorded.of(VERDICT)
    for mirror in recorded.mirrors(SA_TARGET):
        if mirror.fault is None:
            request = request_of(SA_TARGET, mirror)
            yield ticks_while(mirror, said), request, reply_of(SA_TARGET, mirror), mirror.seq
