"""Where a log may stand, whoever asks for it: refused by name, and the recorder goes on."""

from pathlib import Path
from typing import Any

import pytest

from fras_common.bus import RemoteFault
from fras_common.messages import OpenRequest, ResetReply
from fras_common.scenario import Scenario
from fras_recorder.contents import DIRECTORY_LENGTH, LogUnwritable, log_path

Stage = Any  # the fixture's class, in conftest.py, can't be imported from here


def request(directory: str) -> OpenRequest:
    return OpenRequest(trial="t", scenario=Scenario(), mesh=b"", directory=directory)


@pytest.mark.parametrize(
    "directory",
    [
        *("", ".", "runs/x", "../x", "/tmp/../etc", "/tmp/a\0b", "/tmp/a\nb", "/tmp/\u202ex"),
        *("/" + "x" * DIRECTORY_LENGTH, "/proc/self/mem/x/../y"),
    ],
    ids=repr,
)
def test_a_directory_that_is_none_is_refused(directory: str) -> None:
    with pytest.raises(LogUnwritable):
        log_path(request(directory))


def test_logs_stay_below_the_folder_named_links_followed(tmp_path: Path) -> None:
    below, outside = tmp_path / "runs", tmp_path / "outside"
    below.mkdir()
    outside.mkdir()
    (below / "link").symlink_to(outside)
    (below / "loop").symlink_to(below / "loop")
    assert log_path(request(str(below / "a" / "b")), below) == below / "a" / "b" / "audit.mcap"
    for directory in (outside, below / "link" / "x", tmp_path, Path("/"), below / "loop"):
        with pytest.raises(LogUnwritable):
            log_path(request(str(directory)), below)


@pytest.mark.parametrize("name", ["x" * 300, "a\0b", "../x"], ids=["long", "nul", "up"])
def test_a_recorder_that_is_asked_for_the_impossible_goes_on(
    stage: Stage, tmp_path: Path, name: str
) -> None:
    with pytest.raises(RemoteFault) as caught:
        stage.open(Path(f"{tmp_path}/{name}"))
    assert caught.value.remote_kind == "LogUnwritable"
    assert isinstance(stage.open(tmp_path / "good"), ResetReply)
