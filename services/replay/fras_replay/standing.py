"""Where a replay stands, as a message and in words; the clock's time is an argument."""

from fras_common.messages import ReplayStatus
from fras_replay.player import UNLIMITED, Player
from fras_replay.recording import NS, Recording

__all__ = ["in_words", "status_of"]


def status_of(
    recording: Recording, player: Player, now_ns: int, *, marks: bool = False
) -> ReplayStatus:
    """Tell where a replay stands, with all marks of the log if they are asked for."""
    timeline = recording.timeline
    place = player.place(now_ns)
    return ReplayStatus(
        phase=player.state,
        position_s=place.at_ns / NS,
        begin_s=player.begin.at_ns / NS,
        end_s=player.end.at_ns / NS,
        duration_s=timeline.duration_ns / NS,
        log_time_ns=recording.began_ns + place.at_ns,
        tick=timeline.tick(place),
        last_tick=timeline.last_tick,
        rate=player.rate,
        loop=player.loop,
        laps=player.laps,
        mark=recording.mark_at(place),
        messages=place.before,
        of=timeline.end.before,
        log=str(recording.path),
        trial=recording.trial,
        damage=list(recording.damage),
        marks=[mark.told for mark in recording.marks] if marks else [],
    )


def in_words(status: ReplayStatus) -> str:
    """Where a replay stands, for people."""
    speed = "as fast as possible" if status.rate == UNLIMITED else f"rate {status.rate:g}"
    loop = f", lap {status.laps + 1}" if status.loop else ""
    return (
        f"{status.phase} {status.position_s:.2f} s of {status.duration_s:.2f} s, "
        f"tick {status.tick} of {status.last_tick}, {speed}{loop}"
    )
