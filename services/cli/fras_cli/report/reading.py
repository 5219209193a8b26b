"""From a log file to a `Trial`."""

from pathlib import Path

from fras_cli.report.gathering import Gathering
from fras_cli.report.trial import Trial
from fras_log.about import scenario_of, trial_of
from fras_log.errors import ForeignLog
from fras_log.reader import LogReader


def read_trial(path: Path) -> Trial:
    """Read a log, whole or cut off, and understand its trial.

    Parameters
    ----------
    path : Path
        An `audit.mcap`.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog
        There is nothing to report on.
    ScenarioError
        The recorded scenario is not one that this version knows.
    """
    reader = LogReader(path)
    gathering: Gathering | None = None
    for message in reader.messages():
        if gathering is None:
            gathering = Gathering(trial_of(reader))
        gathering.take(message)
    if gathering is None:
        gathering = Gathering(trial_of(reader))
    elif gathering.known == 0:
        raise ForeignLog(path, "it holds no message of a key that FRAS knows")
    return gathering.trial(
        path=str(path),
        damage=reader.damage,
        metadata={**reader.metadata, "head": reader.closing.get("head", "")},
        scenario=scenario_of(reader),
    )
