"""The tutorial, word by word: its commands run, and print what stands there."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.pages import ROOT, Block, blocks

PAGE = ROOT / "docs" / "tutorial.md"
# What is another each time, and on each machine: times, counts of messages, names of trials, keys.
VARYING = (
    (re.compile(r"\d+(\.\d+)? (s|ms)\b"), "# s"),
    (re.compile(r"\d+ messages"), "# messages"),
    (re.compile(r"\d{8}-\d{6}"), "#"),
    (re.compile(r"key [0-9a-f]{16}"), "key #"),
    (re.compile(r"(\d+\.\d{3})\d{4,}"), r"\1#"),
)


def comparable(text: str) -> list[str]:
    for pattern, instead in VARYING:
        text = pattern.sub(instead, text)
    return [line.rstrip() for line in text.splitlines() if line.strip() not in {"", "..."}]


def steps() -> Iterator[tuple[Block, Block | None]]:
    """Each block of commands, with what it prints where the page says it."""
    found = blocks(PAGE, "sh", "text")
    for block, after in zip(found, [*found[1:], None], strict=True):
        if block.language == "sh":
            yield block, after if after is not None and after.language == "text" else None


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """What the tutorial needs of a checkout, and nothing that is there already."""
    shutil.copytree(ROOT / "asp", tmp_path / "asp")
    (tmp_path / "runs").mkdir()
    return tmp_path


def test_every_command_runs_and_prints_what_the_page_says(checkout: Path) -> None:
    setup, *rest = steps()
    assert "make install" in setup[0].text
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "XDG_RUNTIME_DIR": str(checkout), "COLUMNS": "80"}
    for commands, expected in rest:
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", commands.text],
            cwd=checkout,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{commands}: {done.stderr}"
        said = iter(comparable(done.stdout + done.stderr))
        for line in comparable(expected.text if expected else ""):
            assert line in said, f"{expected}: {line!r} is not said, or not in this order"
    assert (checkout / "runs" / "first" / "report.html").exists()
