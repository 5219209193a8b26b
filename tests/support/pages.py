"""The pages of the documentation as data: their code blocks, links and anchors."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


@dataclass(frozen=True)
class Block:
    """A fenced block of code."""

    page: Path
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


@cache
def tokens(page: Path) -> list[Token]:
    return MarkdownIt("commonmark").enable("table").parse(page.read_text(encoding="utf-8"))


def blocks(page: Path, *languages: str) -> list[Block]:
    """Blocks of code in some languages, in order."""
    return [
        Block(page, (token.map or [0])[0] + 1, token.info, token.content)
        for token in tokens(page)
        if token.type == "fence" and token.info in languages
    ]


def links(page: Path) -> Iterator[str]:
    """Where links and pictures of a page lead."""
    for token in tokens(page):
        for child in token.children or []:
            if child.type == "link_open":
                yield str(child.attrGet("href"))
            elif child.type == "image":
                yield str(child.attrGet("src"))


@cache
def anchors(page: Path) -> set[str]:
    """Names of a page's headings, as GitHub and the site make them."""
    found = set[str]()
    stream = tokens(page)
    for opening, inline in pairwise(stream):
        if opening.type == "heading_open":
            said = "".join(child.content for child in inline.children or [])
            found.add(re.sub(r"[^\w\- ]", "", said.lower()).replace(" ", "-"))
    return found


def spans(page: Path) -> list[str]:
    """Code within the lines of a page."""
    return [
        child.content
        for token in tokens(page)
        for child in token.children or []
        if child.type == "code_inline"
    ]
