"""A log played back onto the bus. Public: what `fras replay` needs to run one."""

from fras_replay.errors import BadKey, BadPlace, BadRate, LiveCell, NoSuchMark, NothingToReplay
from fras_replay.host import ReplayHost
from fras_replay.player import UNLIMITED, Player, checked_rate
from fras_replay.recording import Recording, read_recording
from fras_replay.selection import Selection, parse_remap
from fras_replay.service import ReplayService, Settings
from fras_replay.standing import in_words
from fras_replay.timeline import Place, Timeline

__all__ = [
    "UNLIMITED",
    "BadKey",
    "BadPlace",
    "BadRate",
    "LiveCell",
    "NoSuchMark",
    "NothingToReplay",
    "Place",
    "Player",
    "Recording",
    "ReplayHost",
    "ReplayService",
    "Selection",
    "Settings",
    "Timeline",
    "checked_rate",
    "in_words",
    "parse_remap",
    "read_recording",
]
