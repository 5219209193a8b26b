"""The pages that are made from the code are those that the code makes."""

from pathlib import Path

import pytest
from manual.__main__ import DOCS, PAGES
from manual.messages import messages_page
from manual.rules import header_of
from manual.scenario import FILE, meanings

from fras_common.messages.base import Wire

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", PAGES)
def test_committed_page_is_what_the_code_makes(name: str):
    assert (DOCS / name).read_text(encoding="utf-8") == PAGES[name](), "run `make reference`"


def kinds(base: type) -> set[type]:
    return {base}.union(*(kinds(one) for one in base.__subclasses__()))


def test_every_message_has_a_section():
    sections = {
        line.removeprefix("### ")
        for line in messages_page().splitlines()
        if line.startswith("### ")
    }
    own = {kind for kind in kinds(Wire) if kind.__module__.startswith("fras_common.messages")}
    assert sections == {kind.__name__ for kind in own} - {"Wire"}


def test_every_field_of_a_scenario_has_words():
    lines = (DOCS / "reference" / "scenario.md").read_text(encoding="utf-8").splitlines()
    silent = [line for line in lines if line.startswith("| `") and line.endswith("| |")]
    assert [line for line in silent if "_m`" not in line] == []  # corners and discs say it above


def test_words_of_a_scenario_file_go_on_over_lines_and_sections():
    said = meanings(FILE.read_text(encoding="utf-8"))
    assert said["tissue.dt_s"] == "one tick"
    assert said["scene.discs"].startswith("one attachment patch")
    assert said["run.hold_timeout_s"].endswith("where somebody is there")


@pytest.mark.parametrize("path", sorted((ROOT / "asp").rglob("*.lp")), ids=lambda path: path.name)
def test_every_rule_file_says_what_goes_in_and_comes_out(path: Path):
    header = header_of(path.read_text(encoding="utf-8"))
    assert header.startswith(f"{path.name}: ")
    assert "input " in header
    assert "output " in header
