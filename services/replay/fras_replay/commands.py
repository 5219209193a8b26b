"""What a replay does when it is told to; the clock's time is an argument."""

from typing import NamedTuple

from fras_common.messages import ReplayControl
from fras_replay.errors import NoSuchMark
from fras_replay.player import Due, Player
from fras_replay.recording import NS, Recording
from fras_replay.timeline import Place

__all__ = ["Obeyed", "obey"]

MARK_PASSED_NS = NS


class Obeyed(NamedTuple):
    """How a replay stands once it has done what it was told.

    Attributes
    ----------
    player : Player
    anew : bool
        Whether it stands elsewhere, so that how things stand there has to be shown.
    due : Due or None
        What to send on the way.
    """

    player: Player
    anew: bool = False
    due: Due | None = None


def obey(told: ReplayControl, recording: Recording, player: Player, now_ns: int) -> Obeyed:
    """Do what is told, but for the end, which is the process's.

    Parameters
    ----------
    told : ReplayControl
        Any command but `stop`.
    recording : Recording
    player : Player
        How the replay stands.
    now_ns : int [ns]

    Raises
    ------
    BadRate, NoSuchMark
        It can't be done.
    """
    match told.command:
        case "play":
            return Obeyed(player.play(now_ns), anew=player.state == "ended")
        case "pause":
            return Obeyed(player.pause(now_ns))
        case "step":
            due = player.step(now_ns)
            return Obeyed(due.player, due=due)
        case "back":
            return Obeyed(player.back(now_ns), anew=True)
        case "rate":
            return Obeyed(player.at_rate(told.value, now_ns))
        case "loop":
            return Obeyed(player.looping(bool(told.value)))
        case _:
            place = _sought(told, recording, player, now_ns)
            return Obeyed(player.seek(place, now_ns), anew=True)


def _sought(told: ReplayControl, recording: Recording, player: Player, now_ns: int) -> Place:
    match told.command:
        case "seek_s":
            return recording.timeline.at(round(told.value * NS))
        case "seek_tick":
            return recording.timeline.after_tick(int(told.value))
        case _:
            return recording.marks[_mark(told, recording, player, now_ns)].place


def _mark(told: ReplayControl, recording: Recording, player: Player, now_ns: int) -> int:
    place = player.place(now_ns)
    match told.command:
        case "next_mark":
            number = recording.mark_at(place) + 1
        case "previous_mark":
            # While it plays, the mark just passed is not the one that is meant.
            back_ns = MARK_PASSED_NS if player.state == "playing" else 0
            number = recording.mark_before(place, back_ns)
        case _:
            number = int(told.value)
    if not 0 <= number < len(recording.marks):
        marks = len(recording.marks)
        there = f"its marks are 0 to {marks - 1}" if marks else "it has none"
        raise NoSuchMark(f"the log has no mark {number}: {there}", number=number)
    return number
