"""The record that `fras up` leaves for the other commands."""

import os
from pathlib import Path

import msgspec
import psutil
import pytest

from fras_cli import runtime
from fras_cli.keep import endpoint


@pytest.fixture(autouse=True)
def private_runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


def test_record_is_found_while_its_process_lives(tmp_path: Path) -> None:
    kept = runtime.keep("local", "tcp/127.0.0.1:1", tmp_path)
    assert runtime.find("local") == kept
    assert runtime.require("local").pid == os.getpid()
    assert runtime.find("other") is None
    with pytest.raises(runtime.StackExists, match=str(os.getpid())):
        runtime.keep("local", "tcp/127.0.0.1:2", tmp_path)
    runtime.forget(kept)
    assert runtime.find("local") is None
    with pytest.raises(runtime.NoStack, match="fras up --cell local"):
        runtime.require("local")


@pytest.mark.parametrize("pid", [os.getpid(), 2**22 + 1], ids=["given_to_another", "gone"])
def test_record_of_a_process_that_is_gone_is_removed(tmp_path: Path, pid: int) -> None:
    """Also where its process id was given to another one, which started at another time."""
    runtime.keep("local", "tcp/127.0.0.1:1", tmp_path)
    path = runtime.runtime_dir() / "local.json"
    created_s = psutil.Process().create_time()
    text = path.read_text().replace(f'"pid":{os.getpid()}', f'"pid":{pid}')
    path.write_text(text.replace(str(created_s), "1.5"))
    assert runtime.find("local") is None
    assert not path.exists()


def test_only_its_owner_forgets_a_record(tmp_path: Path) -> None:
    kept = runtime.keep("local", "tcp/127.0.0.1:1", tmp_path)
    other = msgspec.structs.replace(kept, connect="tcp/127.0.0.1:2")
    runtime.forget(other)
    assert runtime.find("local") == kept


def test_record_outlives_a_step_of_the_clock(tmp_path: Path) -> None:
    kept = runtime.keep("local", "tcp/127.0.0.1:1", tmp_path)
    path = runtime.runtime_dir() / "local.json"
    path.write_text(path.read_text().replace(str(kept.created_s), str(kept.created_s + 2.0)))
    assert runtime.find("local") is not None


@pytest.mark.parametrize("cell", ["", "a/b", "..", "a b", "**"])
def test_bad_cell_is_named(cell: str) -> None:
    with pytest.raises(runtime.BadCell, match="allowed"):
        runtime.find(cell)


def test_damaged_record_is_no_stack(tmp_path: Path) -> None:
    path = runtime.runtime_dir() / "local.json"
    path.write_text("{")
    assert runtime.find("local") is None
    assert not path.exists()


def test_stacks_that_runs_start_for_themselves_are_found_beside_the_kept_one(
    tmp_path: Path,
) -> None:
    with runtime.noted("local", "tcp/127.0.0.1:2", tmp_path):
        assert runtime.find("local") is None
        assert [one.connect for one in runtime.all_of("local")] == ["tcp/127.0.0.1:2"]
        assert endpoint("local", None) == "tcp/127.0.0.1:2"
        kept = runtime.keep("local", "tcp/127.0.0.1:1", tmp_path)
        assert [one.connect for one in runtime.all_of("local")] == [
            "tcp/127.0.0.1:1",
            "tcp/127.0.0.1:2",
        ]
        assert runtime.all_of("loc") == []
        with pytest.raises(runtime.SeveralStacks, match=r"--connect.*:1, .*:2"):
            endpoint("local", None)
        assert endpoint("local", "tcp/127.0.0.1:9") == "tcp/127.0.0.1:9"
        runtime.forget(kept)
    assert runtime.all_of("local") == []
    with pytest.raises(runtime.NoStack):
        runtime.require_any("local")


def test_the_note_of_a_run_that_was_killed_is_removed(tmp_path: Path) -> None:
    with runtime.noted("local", "tcp/127.0.0.1:2", tmp_path):
        (path,) = runtime.runtime_dir().glob("local.*.json")
        text = path.read_text()
        path.write_text(text.replace(str(psutil.Process().create_time()), "1.5"))
        assert runtime.all_of("local") == []
        assert not path.exists()


def test_a_folder_in_which_others_may_write_is_refused(tmp_path: Path) -> None:
    """Who can plant a record there says where a stop goes, and whom `fras down` ends."""
    folder = runtime.runtime_dir()
    folder.chmod(0o777)
    with pytest.raises(runtime.BadRuntimeFolder, match="somebody else may write here"):
        runtime.find("local")
    folder.chmod(0o700)
    assert runtime.find("local") is None
    folder.rmdir()
    mine = tmp_path / "elsewhere"
    mine.mkdir(mode=0o700)
    folder.symlink_to(mine)
    with pytest.raises(runtime.BadRuntimeFolder):
        runtime.find("local")
