"""`fras replay`: keys of the terminal, places on the command line, what is refused."""

from array import array
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fras_cli.app import app
from fras_cli.failures import exit_status
from fras_cli.replay import Wanted, first_player
from fras_cli.replay_keys import command_of, split_keys
from fras_common.messages import ReplayControl
from fras_replay import BadPlace, LiveCell, NothingToReplay, Selection, read_recording
from fras_replay.timeline import Ticks, Timeline
from support.recordings import Said, short_trial, write_log


@pytest.mark.parametrize(
    ("key", "playing", "rate", "command", "value"),
    [
        (b" ", True, 1.0, "pause", 0.0),
        (b" ", False, 1.0, "play", 0.0),
        (b"n", True, 1.0, "step", 0.0),
        (b"\x1b[C", True, 1.0, "step", 0.0),
        (b"p", True, 1.0, "back", 0.0),
        (b"\x1b[D", True, 1.0, "back", 0.0),
        (b"+", True, 1.0, "rate", 2.0),
        (b"+", True, 1.5, "rate", 2.0),
        (b"+", True, 100.0, "rate", 0.0),
        (b"+", True, 0.0, "rate", 0.0),
        (b"-", True, 0.0, "rate", 100.0),
        (b"-", True, 1.0, "rate", 0.5),
        (b"-", True, 0.1, "rate", 0.1),
        (b"]", True, 1.0, "next_mark", 0.0),
        (b"[", True, 1.0, "previous_mark", 0.0),
        (b"q", True, 1.0, "stop", 0.0),
    ],
)
def test_keys(key: bytes, playing: bool, rate: float, command: str, value: float):
    told = command_of(key, playing, rate)
    assert isinstance(told, ReplayControl)
    assert (told.command, told.value) == (command, value)


def test_another_key_means_nothing():
    assert command_of(b"x", playing=True, rate=1.0) is None
    assert command_of(b"\x1b", playing=True, rate=1.0) is None


def test_keys_read_at_once_are_told_apart():
    assert split_keys(b"n\x1b[C [\x1b[Dq") == [b"n", b"\x1b[C", b" ", b"[", b"\x1b[D", b"q"]


@pytest.fixture
def timeline(tmp_path: Path) -> Timeline:
    recording = read_recording(write_log(tmp_path / "audit.mcap", short_trial()), Selection())
    recording.close()
    return recording.timeline


def test_places_are_ticks_or_seconds(timeline: Timeline):
    player = first_player(timeline, Wanted("x", first="3", last="5"), 1.0)
    assert (player.begin, player.end) == (timeline.before_tick(3), timeline.after_tick(5))
    assert (player.index, player.at_ns) == player.begin
    player = first_player(timeline, Wanted("x", first="0.05s", last=".1s"), 1.0)
    assert (player.begin.at_ns, player.end.at_ns) == (50_000_000, 100_000_000)
    whole = first_player(timeline, Wanted("x", paused=True), 1.0)
    assert (whole.begin, whole.end, whole.state) == (timeline.begin, timeline.end, "paused")


@pytest.mark.parametrize("text", ["3 s", "-1", "soon", "1e3", "s", ""])
def test_what_is_no_place_is_refused(timeline: Timeline, text: str):
    with pytest.raises(BadPlace) as caught:
        first_player(timeline, Wanted("x", first=text), 1.0)
    assert exit_status(caught.value) == 2


@pytest.mark.parametrize(("first", "last"), [("5", "3"), ("10", None), ("1s", None), (None, "0s")])
def test_an_empty_part_is_refused(timeline: Timeline, first: str | None, last: str | None):
    with pytest.raises(NothingToReplay, match=r"0\.20 s and ticks up to 9"):
        first_player(timeline, Wanted("x", first=first, last=last), 1.0)


def test_a_log_of_a_single_moment_can_be_played():
    one = Timeline(array("q", [0]), 0, Ticks([], []), Ticks([], []), {})
    assert first_player(one, Wanted("x"), 1.0).end.before == 1


def test_a_live_cell_is_a_stack_that_is_in_the_way():
    assert exit_status(LiveCell("x", ["motion/1"])) == 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--rate", "200"], "0.1 to 100"),
        (["--include", "nothing/**"], "fits no key of the log; there are: log/sa,"),
        (["--remap", "a"], "OLD=NEW"),
        (["--cell", "a b"], "letters, digits"),
        (["--connect", "localhost"], "localhost"),
        (["--from", "soon"], "no place"),
    ],
)
def test_bad_options_are_named_before_anything_starts(
    tmp_path: Path, arguments: list[str], words: str
):
    write_log(tmp_path / "audit.mcap", short_trial())
    shown = CliRunner().invoke(app, ["replay", str(tmp_path), *arguments])
    assert exit_status(shown.exception) == 2  # type: ignore[arg-type]
    assert words in str(shown.exception)


def test_what_is_no_log_is_named(tmp_path: Path):
    (tmp_path / "empty.mcap").write_bytes(b"")
    (tmp_path / "text.mcap").write_text("not a log")
    write_log(tmp_path / "none.mcap", list[Said]())
    for name, kind in {
        "empty": "NotAnMcap",
        "text": "NotAnMcap",
        "none": "NothingToReplay",
    }.items():
        shown = CliRunner().invoke(app, ["replay", str(tmp_path / f"{name}.mcap")])
        assert type(shown.exception).__name__ == kind
