"""The list of all decision records."""

from pathlib import Path
from typing import Final

from manual.markdown import page, prose, table

FOLDER: Final = Path(__file__).parents[1] / "docs" / "decisions"


def decisions_page() -> str:
    """Return the page: number and title of each record."""
    rows: list[tuple[str, str]] = []
    for path in sorted(FOLDER.glob("0*.md")):
        number, _, title = path.read_text(encoding="utf-8").partition("\n")[0].partition(". ")
        rows.append((number.removeprefix("# "), f"[{title}]({path.name})"))
    return page(
        "Decisions",
        prose(
            """Why things are as they are: what was decided, why, and what was not taken. A
            record is not rewritten when a later one overrules it."""
        ),
        table(("", "decision"), rows),
    )
