"""Markdown as the pages of the reference write it."""

import textwrap
from collections.abc import Iterable, Sequence
from typing import Final

NOTE: Final = "<!-- Made by `make reference`: change what it is made from, not this page. -->"


def page(title: str, *parts: str) -> str:
    """Return a page with a title, from parts that a blank line separates."""
    return "\n\n".join((NOTE, f"# {title}", *(part.strip("\n") for part in parts))) + "\n"


def prose(text: str) -> str:
    """Return a paragraph, however its source is broken into lines, in lines of 100 characters."""
    return textwrap.fill(
        " ".join(text.split()), 100, break_long_words=False, break_on_hyphens=False
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table without the columns that say nothing.

    A cell's own bars and line ends do not break it.
    """
    body = [tuple(row) for row in rows]
    said = [at for at in range(len(head)) if any(row[at] for row in body)]
    full = [[row[at] for at in said] for row in (tuple(head), *body)]
    return "\n".join([_row(full[0]), "|" + "---|" * len(said), *map(_row, full[1:])])


def _row(cells: Sequence[str]) -> str:
    said = (" ".join(cell.split()).replace("|", "\\|") for cell in cells)
    return "".join(f"| {cell} " if cell else "| " for cell in said) + "|"


def code(text: str) -> str:
    """Return text as code within a line, or nothing for none."""
    return f"`{text}`" if text else ""


def block(text: str, language: str) -> str:
    """Return lines of code."""
    return f"```{language}\n{text.strip()}\n```"
