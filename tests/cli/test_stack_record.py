"""The record that `fras up` leaves for the other commands."""

import os
from pathlib import Path

import psutil
import pytest

from fras_cli import runtime


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
    runtime.forget("local")
    assert runtime.find("local") is None
    with pytest.raises(runtime.NoStack, match="fras up --cell local"):
        runtime.require("local")


@pytest.mark.parametrize("pid", [os.getpid(), 2**22 + 1])
def test_record_of_a_process_that_is_gone_is_removed(tmp_path: Path, pid: int) -> None:
    """Also where its process id was given to another one, which started at another time."""
    runtime.keep("local", "tcp/127.0.0.1:1", tmp_path)
    path = runtime.runtime_dir() / "local.json"
    created_s = psutil.Process().create_time()
    text = path.read_text().replace(f'"pid":{os.getpid()}', f'"pid":{pid}')
    path.write_text(text.replace(str(created_s), "1.5"))
    assert runtime.find("local") is None
    assert not path.exists()


def test_damaged_record_is_no_stack(tmp_path: Path) -> None:
    path = runtime.runtime_dir() / "local.json"
    path.write_text("{")
    assert runtime.find("local") is None
    assert not path.exists()
