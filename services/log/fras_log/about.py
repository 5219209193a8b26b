"""What a log says about itself before its first message: trial, scenario, version."""

import re
import tomllib
from importlib.metadata import version

from fras_common.scenario import Scenario
from fras_common.scenario.loader import convert
from fras_log.errors import ForeignLog, NewerLog
from fras_log.reader import LogReader


def trial_of(reader: LogReader) -> str:
    """Return the name of the file's trial.

    Raises
    ------
    ForeignLog
        The file does not tell.
    """
    if "trial" not in reader.metadata:
        raise ForeignLog(reader.path, "it lacks the metadata record `fras` with the trial's name")
    return reader.metadata["trial"]


def scenario_of(reader: LogReader) -> Scenario:
    """Return the recorded scenario.

    Raises
    ------
    ForeignLog
        There is none, or it is no TOML.
    ScenarioError
        It is not one that this version knows.
    """
    if "scenario" not in reader.metadata:
        raise ForeignLog(reader.path, "its metadata record `fras` lacks the scenario")
    try:
        raw = tomllib.loads(reader.metadata["scenario"])
    except (ValueError, RecursionError) as error:
        raise ForeignLog(reader.path, f"its recorded scenario is no TOML: {error}") from error
    return convert(raw, f"{reader.path}, recorded scenario")


def refuse_newer(reader: LogReader) -> None:
    """Refuse a log that a later version of FRAS wrote.

    Raises
    ------
    NewerLog
    """
    ours, theirs = version("fras"), reader.metadata.get("fras_version", "")
    if _numbers(theirs) > _numbers(ours):
        raise NewerLog(reader.path, theirs, ours)


def _numbers(version_text: str) -> tuple[int, ...]:
    """Return the release's numbers; none for a text that does not begin with one."""
    release = re.match(r"\d{1,9}(\.\d{1,9})*", version_text)
    return tuple(int(number) for number in release[0].split(".")) if release else ()
