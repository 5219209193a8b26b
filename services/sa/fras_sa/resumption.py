"""What situation awareness that starts again has to know, and the trial that it makes of that."""

from dataclasses import dataclass

from fras_common import messages as m
from fras_common.service.recall import Asked, Last, Recalling, Since, reset_under_way
from fras_common.topics import PATIENT, ROBOT_STATE, SA_RESET, TISSUE_MODEL, TISSUE_STATE, VERDICT
from fras_sa.trial import WatchedTrial


@dataclass(frozen=True)
class TakenUp:
    """The trial under way, judged as far as can be, and what is to be said of it.

    Parameters
    ----------
    asked : Asked
        The reset that began it.
    trial : WatchedTrial
    verdicts : list of Verdict
    """

    asked: Asked
    trial: WatchedTrial
    verdicts: list[m.Verdict]


def take_up() -> Recalling:
    """Recall the trial under way; returns it as `TakenUp`, or None if there is none."""
    asked: Asked | None = yield from reset_under_way(SA_RESET)
    if asked is None:
        return None
    name = asked.request.trial
    model: m.TissueModel | None = yield Last(TISSUE_MODEL)
    verdict: m.Verdict | None = yield Last(VERDICT)
    if verdict is not None and verdict.trial != name:
        verdict = None
    since = verdict.tick if verdict is not None else 0
    tissues: list[m.TissueState] = yield Since(TISSUE_STATE, since)
    robots: list[m.RobotState] = yield Since(ROBOT_STATE, since)
    patients: list[m.TissueState] = []
    if asked.request.scenario.has_patient:
        patients = yield Since(PATIENT.state, since)
    trial = WatchedTrial(asked.request.scenario)
    if model is not None and model.trial == name:
        trial.see_model(model)
    verdicts = trial.resume(
        verdict,
        [one for one in tissues if one.trial == name],
        [one for one in robots if one.trial == name],
        [one for one in patients if one.trial == name],
    )
    return TakenUp(asked, trial, verdicts)
