"""What is read from a log: the file's trial, whole or cut, and what is no log at all."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from fras_cli.report import ForeignLog, NoSuchLog, NotAnMcap, read_trial
from fras_cli.report.trial import Trial
from fras_common.codec import encode
from fras_common.messages import Array


@pytest.fixture(scope="module")
def trial(log_path: Path) -> Trial:
    return read_trial(log_path)


def test_every_tick_once_and_in_order(trial: Trial) -> None:
    ticks = list(range(65))
    assert [state.tick for state in trial.robot] == ticks
    assert [state.tick for state in trial.tissue] == ticks
    assert [verdict.tick for verdict in trial.verdicts] == ticks


def test_views_are_first_highest_and_last(trial: Trial) -> None:
    assert trial.views is not None
    assert [view.tick for view in (trial.views.first, trial.views.highest, trial.views.last)] == [
        0,
        47,
        64,
    ]


def test_robot_state_tells_goal_tips_and_phase(trial: Trial) -> None:
    start, pulled = trial.robot[0], trial.robot[50]
    assert (start.goal_id, start.action) == ("", "")
    assert (pulled.goal_id, pulled.action, pulled.phase) == ("g3", "pull", "interrupted")
    assert pulled.tips_in_world["psm1"].position_m[2] == pytest.approx(0.005 + 0.027)


def test_a_whole_file_is_complete_with_metadata_and_scenario(trial: Trial) -> None:
    assert trial.complete
    assert trial.damage == ""
    assert trial.metadata["host"] == "theatre-1"
    assert trial.scenario.seed == 7
    assert trial.scenario.tissue.dt_s == 0.1


def test_services_and_warnings_are_kept(trial: Trial) -> None:
    assert trial.services["sim"].facts == {"linear_solver": "block tridiagonal"}
    assert trial.warnings == ("log: warning: late, tick = 12",)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_cut_file_gives_what_came_before_the_cut(
    log_path: Path, tmp_path: Path, trial: Trial, share: float
) -> None:
    whole = log_path.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(share * len(whole))])
    part = read_trial(cut)
    assert not part.complete
    assert part.damage
    assert part.messages <= trial.messages
    assert part.robot == trial.robot[: len(part.robot)]


def test_flushed_chunks_survive_a_kill(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    story.write_beginning(log)
    story.write_ticks(log, 0, 10)
    log.file.flush()
    story.write_ticks(log, 11, 20)
    part = read_trial(log.file.path)
    assert not part.complete
    assert [state.tick for state in part.robot] == list(range(11))
    log.file.close({})


def test_a_damaged_chunk_is_not_taken_for_data(tmp_path: Path, log_path: Path, story: Any) -> None:
    """Without compression only the checksum can tell that a digit of a force has changed."""
    metadata = dict(read_trial(log_path).metadata)
    path = tmp_path / "damaged.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start(profile="fras")
        writer.add_metadata("fras", metadata)
        channel = writer.register_channel("sa/verdict", "msgpack", 0)
        verdict = msgspec.structs.replace(story.verdict(1), trial=story.TRIAL, reason="marker")
        writer.add_message(channel, log_time=0, data=encode(verdict), publish_time=0)
        writer.finish()
    assert read_trial(path).verdicts[0].reason == "marker"
    path.write_bytes(path.read_bytes().replace(b"marker", b"harker"))
    damaged = read_trial(path)
    assert damaged.verdicts == ()
    assert not damaged.complete


def test_other_trials_count_as_messages_only(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    story.write_beginning(log)
    log.put("sa/verdict", story.verdict(3), trial="yesterday")
    story.write_ticks(log, 0, 1)
    log.file.close({})
    trial = read_trial(log.file.path)
    assert [verdict.tick for verdict in trial.verdicts] == [0, 1]
    assert trial.messages == 4 + 1 + 6


def test_gaps_in_the_numbering_are_lost_messages(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    story.write_ticks(log, 0, 3)
    log.put("sa/verdict", story.verdict(4), skip=3)
    log.put("robot/state", story.robot(4), skip=1)
    log.file.close({})
    assert read_trial(log.file.path).lost == 4


def test_malformed_messages_are_counted_and_left_out(
    new_log: Callable[..., Any], story: Any
) -> None:
    log = new_log()
    story.write_ticks(log, 0, 2)
    trial = "t-7"
    log.raw("sa/verdict", b"\xc1 no msgpack")
    log.raw("robot/state", encode({"tick": "three", "seq": 99}))
    flat = msgspec.msgpack.decode(encode(story.tissue(3))) | {"seq": 50, "trial": trial}
    flat["nodes_m"] = msgspec.msgpack.decode(encode(Array.of(np.zeros(4), "<f4")))
    log.raw("sim/tissue_state", encode(flat))
    log.file.close({})
    trial = read_trial(log.file.path)
    assert trial.malformed == 3
    assert len(trial.tissue) == len(trial.robot) == len(trial.verdicts) == 3


def test_a_surface_that_names_no_node_is_refused(new_log: Callable[..., Any], story: Any) -> None:
    log = new_log()
    beyond = Array.of(np.full((1, 3), 10**6), "<i4")
    log.put("sim/tissue_model", msgspec.structs.replace(story.model(), surface=beyond))
    log.file.close({})
    trial = read_trial(log.file.path)
    assert trial.model is None
    assert trial.malformed == 1


def test_a_state_published_again_keeps_its_first_time(
    new_log: Callable[..., Any], story: Any
) -> None:
    log = new_log()
    story.write_ticks(log, 0, 2)
    first_ns = log.now_ns
    log.now_ns += 10**9
    log.put("robot/state", msgspec.structs.replace(story.robot(2), holds={"surgeon": "look"}))
    log.file.close({})
    state = read_trial(log.file.path).robot[-1]
    assert (state.stamp_ns, state.held) == (first_ns, True)


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(NoSuchLog, match=r"none\.mcap.*No such file"):
        read_trial(tmp_path / "none.mcap")


@pytest.mark.parametrize("content", [b"", b"\x89MC", b"hello, this is not an MCAP file at all"])
def test_no_mcap(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "text.mcap"
    path.write_bytes(content)
    with pytest.raises(NotAnMcap, match="is no MCAP file"):
        read_trial(path)


def foreign(path: Path, profile: str, metadata: dict[str, str] | None, topic: str) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile=profile)
        if metadata is not None:
            writer.add_metadata("fras", metadata)
        channel = writer.register_channel(topic, "json", 0)
        writer.add_message(channel, log_time=0, data=b"{}", publish_time=0)
        writer.finish()
    return path


@pytest.mark.parametrize(
    ("profile", "metadata", "why"),
    [
        ("ros2", None, "profile is 'ros2'"),
        ("fras", None, "lacks the metadata record"),
        ("fras", {"trial": "t"}, "no message of a key"),
    ],
)
def test_foreign_files_are_named(
    tmp_path: Path, profile: str, metadata: dict[str, str] | None, why: str
) -> None:
    path = foreign(tmp_path / "foreign.mcap", profile, metadata, "/camera/image")
    with pytest.raises(ForeignLog, match=why):
        read_trial(path)


@pytest.mark.parametrize(
    ("scenario", "why"), [(None, "lacks the scenario"), ("= no toml", "is no TOML")]
)
def test_a_log_without_a_scenario_is_foreign(
    tmp_path: Path, scenario: str | None, why: str
) -> None:
    metadata = {"trial": "t"} | ({} if scenario is None else {"scenario": scenario})
    path = foreign(tmp_path / "foreign.mcap", "fras", metadata, "sa/verdict")
    with pytest.raises(ForeignLog, match=why):
        read_trial(path)
