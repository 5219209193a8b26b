"""docs/security.md against the topic table: who publishes, answers, asks; its tests exist."""

import re
from pathlib import Path

from fras_common.access import PARTICIPANTS, rights_of
from fras_common.topics import QUERIES

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
EVERYBODYS = {query.key for query in QUERIES if query.askers == ("*",)}


def row(name: str) -> str:
    """A participant's row as the page must have it."""
    rights = rights_of(name)
    own = {f"{family}/{name}" for family in ("health", "log", "fault")} | {f"rpc/{name}/**"}
    keys = [key.replace("psm1/", "psm*/") for key in rights.publishes if key not in own]
    publishes = ", ".join(f"`{key}`" for key in keys if not key.startswith("psm2/"))
    asks = ", ".join(f"`{key}`" for key in rights.asks if key not in EVERYBODYS)
    serves = ", ".join(f"`{key}`" for key in rights.serves)
    return f"| {name} | {publishes} | {serves} | {asks} |"


def test_the_page_has_each_participants_rights():
    lines = PAGE.splitlines()
    start = lines.index("| certificate | publishes | answers | asks |")
    assert lines[start + 2 : start + 2 + len(PARTICIPANTS)] == [row(name) for name in PARTICIPANTS]
    assert not lines[start + 2 + len(PARTICIPANTS)].startswith("|")


def test_what_everybody_may_ask_stands_on_the_page():
    words = PAGE[: PAGE.index("| certificate |")].replace("planner `why_not`", "`planner/why_not`")
    stops = {"motion/hold", "replay/status"}
    assert all(f"`{key}`" in words for key in EVERYBODYS - stops)


def test_each_proof_that_the_page_names_exists():
    named = set(re.findall(r"`(tests/[\w/.]+)`", PAGE))
    assert len(named) > 8
    assert [path for path in named if not (ROOT / path).exists()] == []
