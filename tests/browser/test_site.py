"""The documentation's site: it builds without a warning, and asks no other machine for anything."""

import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from functools import partial
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from benchmarks.browser import Fence
from playwright.sync_api import Browser, Page, Request, expect

from support.pages import ROOT

# What a browser loads by itself, and where it is said.
LOADED = {
    "script": "src", "img": "src", "iframe": "src", "source": "src", "video": "src",
    "object": "data",
}  # fmt: skip
STYLED = re.compile(r"url\(\s*['\"]?(?P<what>[^)'\"]+)|@import\s+['\"](?P<file>[^'\"]+)")


class Resources(HTMLParser):
    """Gathers what a page loads."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        said = dict(attrs)
        place = LOADED.get(tag) or ("href" if tag == "link" else "")
        # A link to the page itself, or to the next one, is not loaded.
        if place and said.get(place) and said.get("rel") not in {"canonical", "next", "prev"}:
            self.found.append(str(said[place]))


class Silent(SimpleHTTPRequestHandler):
    """Serves a folder and says nothing."""

    def log_message(self, format: str, *args: object) -> None:
        del format, args


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build it."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def address(site: Path) -> Iterator[str]:
    """Serve it."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Silent, directory=str(site))) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.fixture
def page(browser: Browser, fence: Fence) -> Iterator[Page]:
    """Open a page that nothing may fail on."""
    already = len(fence.asked)
    opened = browser.new_page(viewport={"width": 1280, "height": 800})
    failed: list[str] = []

    def note(request: Request) -> None:
        if request.failure != "net::ERR_ABORTED":  # by a page that is left
            failed.append(request.url)

    opened.on("requestfailed", note)
    opened.on("pageerror", lambda error: failed.append(str(error)))
    yield opened
    opened.close()
    assert failed == []
    assert fence.asked[already:] == []


def test_every_page_is_there(site: Path):
    for page in (ROOT / "docs").rglob("*.md"):
        name = page.relative_to(ROOT / "docs").as_posix().removesuffix(".md")
        made = site / f"{name.removesuffix('README')}{'index' * name.endswith('README')}.html"
        assert made.is_file(), name
    assert "says why it does what it does" in (site / "index.html").read_text()
    assert "keep_off_attachments" in (site / "source" / "asp" / "constraints.lp.html").read_text()


def test_no_page_loads_anything_from_elsewhere(site: Path):
    pages = list(site.rglob("*.html"))
    assert len(pages) > 80
    for page in pages:
        resources = Resources()
        resources.feed(page.read_text(encoding="utf-8"))
        assert resources.found
        for resource in resources.found:
            parts = urlsplit(resource)
            assert parts.scheme in {"", "data"}, (page, resource)
            assert not parts.netloc, (page, resource)
            if page.name != "404.html" and not parts.scheme:
                assert (page.parent / parts.path).exists(), (page, resource)


def test_no_style_loads_anything_from_elsewhere(site: Path):
    for sheet in site.rglob("*.css"):
        for match in STYLED.finditer(sheet.read_text(encoding="utf-8")):
            what = match["what"] or match["file"]
            assert what.startswith("data:") or not urlsplit(what).netloc, (sheet, what)


def test_types_stand_as_the_docstrings_have_them(site: Path):
    page = (site / "reference" / "python" / "fem.html").read_text(encoding="utf-8")
    assert "ndarray, shape (n_nodes, 3), float64 [m]" in page


def test_the_front_page_shows_its_figure(page: Page, address: str) -> None:
    page.goto(f"{address}/index.html")
    figure = page.get_by_alt_text("Before and after a retraction")
    expect(figure).to_be_visible()
    assert figure.evaluate("picture => picture.naturalWidth") > 500


def test_a_reference_page_is_found_by_searching_for_a_key(page: Page, address: str) -> None:
    page.goto(f"{address}/index.html")
    page.wait_for_load_state("networkidle")  # the index is there
    page.get_by_placeholder("Search").click()
    page.get_by_placeholder("Search").press_sequentially("planner/why_not")
    page.locator(".md-search-result__link", has=page.get_by_text("Keys")).first.click()
    expect(page).to_have_url(re.compile(r"/reference/keys\.html"))
    expect(page.locator("td code", has_text="planner/why_not").first).to_be_attached()


def test_no_table_leaves_its_page(page: Page, address: str) -> None:
    for name in ("reference/keys", "reference/scenario", "reference/safety", "promises"):
        page.goto(f"{address}/{name}.html")
        wide = page.evaluate("document.documentElement.scrollWidth > innerWidth")
        assert not wide, name
