"""Files from elsewhere, read no further than they may be long."""

from pathlib import Path

import pytest

from fras_common.files import TEXT_BYTES, read_at_most
from fras_common.scenario import ScenarioError, load
from fras_supervisor import TableError, load_table


def test_a_file_is_read_up_to_its_limit_and_refused_beyond(tmp_path: Path) -> None:
    path = tmp_path / "f"
    path.write_bytes(b"12345")
    assert read_at_most(path, 5) == b"12345"
    with pytest.raises(OSError, match="more than 4 bytes"):
        read_at_most(path, 4)


def test_a_device_without_an_end_has_one() -> None:
    with pytest.raises(OSError, match="more than 1000 bytes"):
        read_at_most(Path("/dev/zero"), 1000)


@pytest.mark.parametrize(
    "content",
    [
        b"a = " + b"[" * 100_000,
        b"a = " + b"9" * 5_000,
        b"\xff\xfe",
        b"#" * (TEXT_BYTES + 1),
        b".".join([b"a"] * 5_000) + b" = 1",
    ],
    ids=["nested", "digits", "no text", "long", "dotted"],
)
def test_scenarios_and_tables_that_would_break_their_reader_are_refused(
    tmp_path: Path, content: bytes
) -> None:
    path = tmp_path / "file.toml"
    path.write_bytes(content)
    with pytest.raises(ScenarioError):
        load(path)
    with pytest.raises(TableError):
        load_table(path)
