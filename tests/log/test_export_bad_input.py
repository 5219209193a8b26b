"""What an export does with logs that are cut, foreign or newer, and with files in its way."""

import io
import resource
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer
from rich.console import Console
from tests.cli.report import conftest as made

from fras_cli.app import main
from fras_cli.log_export import NoFormat, export_log
from fras_log import ForeignLog, LogFile, NoSuchLog, NotAnMcap
from fras_log.errors import NewerLog
from fras_log.export import (
    Format,
    NothingToExport,
    OutputExists,
    OutputIsLog,
    OutputUnwritable,
    export,
)
from support.exported import parse_publicly, read_foxglove, read_rerun, run_rerun

BOTH = [Format.FOXGLOVE, Format.RERUN]


def told(log: Path, kinds: list[Format], out: Path | None = None, **options: bool) -> str:
    """Export as the command does, and return what it prints."""
    text = io.StringIO()
    chosen: dict[str, Any] = {"overwrite": False, "with_layout": False, **options}
    console = Console(file=text, width=200)
    assert export_log(log, kinds, out, console=console, **chosen) == 0
    return text.getvalue()


def write_log(path: Path, metadata: dict[str, str]) -> Path:
    LogFile(path, metadata, {}, 1).close({})
    return path


@pytest.fixture
def log(trial_log: Path, tmp_path: Path) -> Path:
    """The trial's log in a folder of its own, as a run leaves it."""
    return Path(shutil.copy(trial_log, tmp_path / "audit.mcap"))


@pytest.fixture
def cut_log(tmp_path: Path) -> Path:
    """A recorder killed at tick 30: what it had flushed is there, and half a chunk."""
    path = tmp_path / "audit.mcap"
    log = made.open_log(path)
    made.write_beginning(log)
    made.write_ticks(log, 0, 30)
    log.file.flush()
    whole = path.stat().st_size
    made.write_ticks(log, 31, 40)
    log.file.flush()
    log.file.abandon()
    content = path.read_bytes()
    path.write_bytes(content[: (whole + len(content)) // 2])
    return path


def test_a_cut_log_exports_what_it_holds_and_says_so(cut_log: Path, tmp_path: Path) -> None:
    text = told(cut_log, BOTH)
    assert "cut off: exported is what it holds, up to tick 30" in text
    read = read_foxglove(cut_log.with_name("audit.foxglove.mcap"))
    assert [len(read[topic]) for topic in ("/tissue", "/tf", "/gauges")] == [31, 31, 31]
    for message in read["/tissue"]:
        parse_publicly(message)
    last = read["/log"][-1].content
    assert last.name == "export"
    assert last.message.startswith("the log ends here, early: ")
    rerun_file = cut_log.with_suffix(".rrd")
    assert run_rerun(tmp_path, "rrd", "verify", str(rerun_file)).returncode == 0
    moving, staying = read_rerun(rerun_file)
    assert moving["/world/tissue"]["tick"] == list(range(31))
    assert moving["/log"]["TextLog:text"][-1][0].startswith("export: the log ends here, early")
    assert "ends early" in staying["/__properties/fras_cut"]["damage"][0]


def test_a_whole_log_is_not_called_cut_and_what_was_left_out_is_told(log: Path) -> None:
    text = told(log, BOTH)
    assert "cut off" not in text
    assert "1 messages could not be understood" in text
    assert "open it in Foxglove or Lichtblick" in text
    assert f"`rerun {log.with_suffix('.rrd')}`" in text
    texts = [
        one.content.message for one in read_foxglove(log.with_name("audit.foxglove.mcap"))["/log"]
    ]
    assert not [one for one in texts if "ends here" in one]


def foreign(path: Path) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="another")
        writer.finish()
    return path


def unknown_keys(path: Path) -> Path:
    log = made.open_log(path)
    log.raw("someone/elses", b"\x80")
    log.file.close({})
    return path


def empty(path: Path) -> Path:
    path.write_bytes(b"")
    return path


def no_ticks(path: Path) -> Path:
    made.open_log(path).file.close({})
    return path


def newer(path: Path) -> Path:
    # What follows in a log to come is not understood: the version is what has to be named.
    metadata = {"trial": "t", "fras_version": "999.0.1", "scenario": "unheard_of = 1"}
    return write_log(path, metadata)


def nameless(path: Path) -> Path:
    return write_log(path, {"fras_version": "0.1.0"})


BAD: list[tuple[Callable[[Path], Path], type[Exception], str]] = [
    (foreign, ForeignLog, "its profile is 'ros2'"),
    (unknown_keys, ForeignLog, "no message of a key that FRAS knows"),
    (empty, NotAnMcap, "is no MCAP file"),
    (no_ticks, NothingToExport, "holds nothing of its trial to show"),
    (newer, NewerLog, r"written by FRAS 999\.0\.1.*install 999\.0\.1 or newer"),
    (nameless, ForeignLog, "lacks the metadata record `fras` with the trial's name"),
    (lambda path: path, NoSuchLog, "can't be read"),
]


@pytest.mark.parametrize(("make", "error", "words"), BAD)
def test_what_is_no_log_of_ours_is_named_and_nothing_written(
    make: Callable[[Path], Path], error: type[Exception], words: str, tmp_path: Path
) -> None:
    path = make(tmp_path / "audit.mcap")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(error, match=words):
        told(path, BOTH)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("kind", BOTH)
def test_an_output_that_exists_stays_unless_forced(kind: Format, log: Path) -> None:
    output = log.with_name(f"audit{kind}")
    output.write_text("mine")
    with pytest.raises(OutputExists, match="--force"):
        told(log, BOTH)
    assert output.read_text() == "mine"
    assert sorted(log.parent.iterdir()) == sorted([log, output])
    told(log, [kind], overwrite=True)
    assert output.read_bytes()[:4] != b"mine"


def test_the_log_itself_is_never_written(log: Path) -> None:
    before = log.read_bytes()
    link = log.with_name("link.mcap")
    link.hardlink_to(log)
    for out in (log, link):
        with pytest.raises(OutputIsLog, match="is the log"):
            told(log, [Format.FOXGLOVE], out=out, overwrite=True)
    told(log, BOTH)
    assert log.read_bytes() == before


def test_an_export_that_breaks_off_leaves_nothing(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fras_log.export.foxglove.FoxgloveFile.close", full)
    with pytest.raises(OSError, match="No space left"):
        told(log, BOTH)
    assert list(log.parent.iterdir()) == [log]


@pytest.mark.parametrize("kind", BOTH)
def test_a_full_disk_is_told_and_leaves_nothing(kind: Format, log: Path) -> None:
    """A limit on the size of files stands for it: the system refuses to write on."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))
    try:
        with pytest.raises((OSError, OutputUnwritable)):
            told(log, [kind])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(log.parent.iterdir()) == [log]


def test_names_of_the_files(log: Path, tmp_path: Path) -> None:
    told(log, BOTH, out=tmp_path / "both.of.them", with_layout=True)
    told(log, [Format.RERUN], out=tmp_path / "new" / "one.rrd")
    names = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.*"))
    assert names == [
        "audit.mcap",
        "both.of.them.foxglove.mcap",
        "both.of.them.foxglove.mcap.layout.json",
        "both.of.them.rrd",
        "new/one.rrd",
    ]
    with pytest.raises(NoFormat, match="--foxglove, --rerun, or both"):
        told(log, [])


@pytest.mark.parametrize(("arguments", "status"), [([], 2), (["--foxglove"], 0)])
def test_the_command_takes_a_runs_folder(
    arguments: list[str], status: int, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["fras", "log", "export", str(log.parent), *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == status
    assert log.with_name("audit.foxglove.mcap").exists() == (status == 0)


def test_a_missing_library_is_told_with_the_extra_that_brings_it(
    log: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(sys.modules, "fras_log.export.rerun", raising=False)
    monkeypatch.delitem(sys.modules, "fras_log.export.blueprint", raising=False)
    monkeypatch.setitem(sys.modules, "rerun", None)
    monkeypatch.setattr(sys, "argv", ["fras", "log", "export", str(log), "--rerun"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 3
    assert "pip install 'fras[rerun]'" in capsys.readouterr().err
    assert list(log.parent.iterdir()) == [log]


def test_progress_is_told_once_it_takes_long(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fras_cli.log_export.QUIET_S", 3600.0)
    assert "exporting" not in told(log, [Format.FOXGLOVE])
    monkeypatch.setattr("fras_cli.log_export.QUIET_S", 0.0)
    text = told(log, [Format.FOXGLOVE], overwrite=True)
    assert "exporting audit.mcap: " in text
    shares: list[float] = []
    export(log, {Format.FOXGLOVE: log.with_name("again.mcap")}, progress=shares.append)
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[-1] <= 1.0
