"""From a log file to a `Trial`."""

import tomllib
from pathlib import Path

from fras_cli.report.gathering import Gathering
from fras_cli.report.trial import Trial
from fras_common.scenario import Scenario
from fras_common.scenario.loader import convert
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
            gathering = Gathering(_trial_of(reader))
        gathering.take(message)
    if gathering is None:
        gathering = Gathering(_trial_of(reader))
    elif gathering.known == 0:
        raise ForeignLog(path, "it holds no message of a key that FRAS knows")
    return gathering.trial(
        path=str(path),
        damage=reader.damage,
        metadata={**reader.metadata, "head": reader.closing.get("head", "")},
        scenario=_scenario_of(reader),
    )


def _trial_of(reader: LogReader) -> str:
    if "trial" not in reader.metadata:
        raise ForeignLog(reader.path, "it lacks the metadata record `fras` with the trial's name")
    return reader.metadata["trial"]


def _scenario_of(reader: LogReader) -> Scenario:
    if "scenario" not in reader.metadata:
        raise ForeignLog(reader.path, "its metadata record `fras` lacks the scenario")
    try:
        raw = tomllib.loads(reader.metadata["scenario"])
    except tomllib.TOMLDecodeError as error:
        raise ForeignLog(reader.path, f"its recorded scenario is no TOML: {error}") from error
    return convert(raw, f"{reader.path}, recorded scenario")
