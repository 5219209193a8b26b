"""docs/reference/safety.md as data."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "safety.md"
_ROW = re.compile(r"^\| `(?P<name>\w+)` \|(?P<cells>.*)\|$", re.M)


@dataclass(frozen=True)
class Row:
    """One safeguard as the page has it."""

    name: str
    guards: str
    number: str
    refuses: str
    proofs: tuple[str, ...]


def rows() -> list[Row]:
    """All rows, in the page's order."""
    found: list[Row] = []
    for match in _ROW.finditer(PAGE.read_text(encoding="utf-8")):
        guards, number, refuses, proofs = (cell.strip() for cell in match["cells"].split("|"))
        found.append(Row(match["name"], guards, number, refuses, tuple(proofs.split())))
    return found
