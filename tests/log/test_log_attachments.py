"""The files attached to a log: found before the messages, and written nowhere but where asked."""

from pathlib import Path

import pytest

from fras_common.bus import RawSample
from fras_log import LogFile
from fras_log.attachments import (
    BadAttachment,
    InTheWay,
    read_attachments,
    rules_in,
    write_attachments,
)
from support.forger import put_together, take_apart

FILES = {
    "scenario.toml": b"seed = 2\n",
    "mesh": b"\0\1",
    "asp/goal.lp": "% für alle\r\n".encode(),
    "asp/preferences/lex.lp": b"% lex\n",
}


def log(path: Path, attachments: dict[str, bytes]) -> Path:
    file = LogFile(path, {"trial": "t"}, attachments, 0)
    file.write(RawSample("some/key", b"x", ""), 1)
    file.close({})
    return path


def test_all_attachments_are_read(tmp_path: Path) -> None:
    assert read_attachments(log(tmp_path / "a.mcap", FILES)) == FILES
    assert read_attachments(log(tmp_path / "b.mcap", {})) == {}


def test_a_log_that_is_cut_has_them_all_the_same(tmp_path: Path) -> None:
    path = log(tmp_path / "a.mcap", FILES)
    path.write_bytes(path.read_bytes()[:-300])
    assert read_attachments(path) == FILES


def test_what_is_attached_behind_the_messages_or_again_does_not_count(tmp_path: Path) -> None:
    """The chain vouches for neither: a forger could put them there."""
    path = log(tmp_path / "a.mcap", FILES)
    pieces = take_apart(path.read_bytes())
    other = log(tmp_path / "b.mcap", {"asp/goal.lp": b"% forged", "asp/more.lp": b"% forged"})
    forged = [one for one in take_apart(other.read_bytes()) if b"% forged" in one.content]
    assert len(forged) == 2
    path.write_bytes(put_together([*pieces, *forged]))
    assert read_attachments(path) == FILES
    first = next(number for number, one in enumerate(pieces) if b"asp/goal.lp" in one.content)
    path.write_bytes(put_together([*pieces[: first + 1], forged[0], *pieces[first + 1 :]]))
    assert read_attachments(path) == FILES


def test_a_damaged_attachment_is_left_out(tmp_path: Path) -> None:
    path = log(tmp_path / "a.mcap", FILES)
    path.write_bytes(path.read_bytes().replace(b"% lex\n", b"% Lex\n"))
    found = read_attachments(path)
    assert "asp/preferences/lex.lp" not in found
    assert found["scenario.toml"] == FILES["scenario.toml"]


def test_the_rules_are_told_by_their_place_below_asp(tmp_path: Path) -> None:
    assert rules_in(FILES, tmp_path) == {
        "goal.lp": "% für alle\r\n",
        "preferences/lex.lp": "% lex\n",
    }
    assert rules_in({"mesh": b"\xff"}, tmp_path) == {}
    with pytest.raises(BadAttachment, match=r"asp/x\.lp' is no text"):
        rules_in({"asp/x.lp": b"\xff"}, tmp_path)


def test_attachments_are_written_as_they_are(tmp_path: Path) -> None:
    out = tmp_path / "new" / "folder"
    written = write_attachments(FILES, tmp_path / "a.mcap", out)
    assert {path.relative_to(out).as_posix(): path.read_bytes() for path in written} == FILES


def test_nothing_is_written_over_and_then_nothing_is_written(tmp_path: Path) -> None:
    (tmp_path / "mesh").write_bytes(b"mine")
    with pytest.raises(InTheWay, match="mesh exists and is not written over"):
        write_attachments(FILES, tmp_path / "a.mcap", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mesh"]
    assert (tmp_path / "mesh").read_bytes() == b"mine"


def test_a_link_that_leads_nowhere_is_in_the_way_too(tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    out = tmp_path / "out"
    out.mkdir()
    (out / "mesh").symlink_to(elsewhere)
    with pytest.raises(InTheWay):
        write_attachments(FILES, tmp_path / "a.mcap", out)
    assert not elsewhere.exists()


@pytest.mark.parametrize(
    "name",
    [
        *("../x", "/etc/x", "asp/../../x", "asp//x", "", ".", "..", "asp/", "asp/./x"),
        *("a\\b", "C:x", "a\nb", "a\0b", "a\x1b[2Jb"),
    ],
)
def test_no_name_leads_out_of_the_folder(tmp_path: Path, name: str) -> None:
    out = tmp_path / "out"
    with pytest.raises(BadAttachment, match="nothing was written"):
        write_attachments({"fine": b"", name: b"x"}, tmp_path / "a.mcap", out)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_a_folder_to_another_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadAttachment, match="'a/b'"):
        write_attachments({"a": b"", "a/b": b""}, tmp_path / "a.mcap", tmp_path / "out")
    assert list(tmp_path.iterdir()) == []
