"""Write the pages that are made from the code: `python -m manual`, or `make reference`."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from manual.commands import commands_page
from manual.decisions import decisions_page
from manual.keys import keys_page
from manual.messages import messages_page
from manual.rules import rules_page
from manual.scenario import scenario_page

DOCS: Final = Path(__file__).parents[1] / "docs"
PAGES: Final[dict[str, Callable[[], str]]] = {
    "reference/keys.md": keys_page,
    "reference/messages.md": messages_page,
    "reference/commands.md": commands_page,
    "reference/scenario.md": scenario_page,
    "reference/rules.md": rules_page,
    "decisions/README.md": decisions_page,
}
"""Page below docs/ to what makes it; a test holds the committed ones against them."""


def main() -> None:
    """Write each page anew."""
    for name, make in PAGES.items():
        (DOCS / name).write_text(make(), encoding="utf-8")


if __name__ == "__main__":
    main()
