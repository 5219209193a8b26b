"""From a log file to what it records of its trial."""

from itertools import chain
from pathlib import Path

from fras_audit.recorded import Recorded, gather
from fras_log import LogReader
from fras_log.about import refuse_newer, scenario_of, trial_of
from fras_log.attachments import read_attachments


def read_recorded(path: Path) -> Recorded:
    """Read a log, whole or cut off; it is never written to.

    Raises
    ------
    NoSuchLog, NotAnMcap, ForeignLog, NewerLog
        There is nothing to audit.
    ScenarioError
        The recorded scenario is not one that this version knows.
    """
    reader = LogReader(path)
    messages = reader.messages()
    # The recorder's metadata stand before any message.
    first = [message for message in [next(messages, None)] if message is not None]
    trial = trial_of(reader)
    refuse_newer(reader)
    recorded = Recorded(str(path), trial, dict(reader.metadata), scenario_of(reader))
    recorded.attachments = read_attachments(path)
    gather(chain(first, messages), recorded)
    recorded.damage = reader.damage
    return recorded
