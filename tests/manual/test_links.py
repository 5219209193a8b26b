"""Every link between files of the checkout leads somewhere, and to a heading that is there."""

from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from support.pages import PAGES, ROOT, anchors, links


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_link_leads_somewhere(page: Path):
    dead: list[str] = []
    for link in links(page):
        parts = urlsplit(link)
        if parts.scheme:
            assert parts.scheme == "https", link
            continue
        target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
        named = target / "README.md" if target.is_dir() else target
        if not target.exists() or (parts.fragment and parts.fragment not in anchors(named)):
            dead.append(link)
    assert dead == []


def test_pages_that_nobody_would_find():
    """Each page of docs/ is in the site's navigation, or below what it leaves out by name."""
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    lost = [
        name
        for page in PAGES
        if (name := page.relative_to(ROOT).as_posix()).startswith("docs/")
        and f" {name.removeprefix('docs/')}" not in navigation
        and not name.startswith(("docs/decisions/0", "docs/results/"))
    ]
    assert lost == []
