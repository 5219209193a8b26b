"""Who may open the page, and what it may ask of others."""

from collections.abc import Callable, Iterator
from urllib.parse import urlsplit

import psutil
import pytest
from benchmarks.browser import Fence
from benchmarks.surgeon import Served, SurgeonsPage, served
from benchmarks.theatre import Theatre, eventually
from playwright.sync_api import Browser, expect

OpenPage = Callable[..., SurgeonsPage]

SURGEON = "surgeon-0123456789"
VIEWER = "viewer-0123456789"
SENT = """text => new Promise((done) => {
  const socket = new WebSocket(`ws://${location.host}/control`);
  const heard = [];
  socket.onopen = () => socket.send(text);
  socket.onmessage = (event) => {
    for (const one of JSON.parse(event.data).said ?? []) if (one.words) heard.push(one.words);
    if (heard.length) { socket.close(); done(heard.join(" ")); }
  };
  socket.onclose = () => done(`closed ${heard.join(" ")}`);
})"""
REFUSED = """place => new Promise((done) => {
  const socket = new WebSocket(place);
  socket.onopen = () => done("open");
  socket.onerror = () => done("refused");
})"""


@pytest.fixture(scope="module")
def guarded(theatre: Theatre) -> Iterator[Served]:
    """Serve a page that asks for a token."""
    with served(theatre.link, "--token", SURGEON, "--view-token", VIEWER) as made:
        yield made


def bare(server: Served) -> str:
    return f"http://{urlsplit(server.address).netloc}/"


def test_without_its_token_the_page_stays_closed(guarded: Served, open_page: OpenPage) -> None:
    for address in (bare(guarded), f"{bare(guarded)}?token=wrong-0123456789"):
        page = open_page(address)
        assert page.status == 401
        assert "token" in page.page.locator("body").inner_text()
        page.errors.clear()  # the refusal itself
    page = open_page(guarded.address, scene=False)
    page.is_live()
    assert SURGEON not in page.page.url
    page.page.reload()  # the cookie opens it from now on
    page.is_live()


def test_two_pages_of_one_machine_stay_open_side_by_side(
    theatre: Theatre, guarded: Served, browser: Browser
) -> None:
    context = browser.new_context()
    try:
        page = context.new_page()
        with served(theatre.link, "--token", "another-0123456789") as second:
            for opened in (guarded, second):
                page.goto(opened.address, wait_until="commit")
            for opened in (guarded, second):
                answer = page.goto(bare(opened), wait_until="commit")
                assert answer is not None
                assert answer.status == 200
    finally:
        context.close()


def test_who_may_only_look_has_no_stop_and_a_forged_one_does_nothing(
    guarded: Served, theatre: Theatre, open_page: OpenPage
) -> None:
    viewer = open_page(f"{bare(guarded)}?token={VIEWER}", scene=False)
    viewer.is_live()
    expect(viewer.page.locator("#stop")).to_be_hidden()
    viewer.page.keyboard.press("Space")
    assert viewer.page.evaluate(SENT, '{"do": "stop"}') == "This page may only look."
    surgeon = open_page(guarded.address, scene=False)
    surgeon.is_live()
    assert viewer.read("stopped") == ""
    surgeon.stop()
    theatre.until_held("monitor")
    viewer.reads("holds", "Stopped on this page")
    resume = '{"do": "resume", "holds": {"monitor": "stop pressed on the surgeon\'s page"}}'
    assert viewer.page.evaluate(SENT, resume) == "This page may only look."
    assert theatre.held[-1].holds.keys() == {"monitor"}
    surgeon.press("Let the arms go on")
    surgeon.press("Yes, go on")
    theatre.until_held()


def test_another_site_in_the_same_browser_presses_no_button(
    server: Served, browser: Browser
) -> None:
    context = browser.new_context()
    try:
        page = context.new_page()
        page.route("http://127.0.0.1:1/", lambda route: route.fulfill(body="elsewhere"))
        page.goto("http://127.0.0.1:1/")
        for path in ("control", "scene"):
            place = f"ws://127.0.0.1:{server.port}/{path}"
            assert page.evaluate(REFUSED, place) == "refused"
    finally:
        context.close()


def test_nothing_reaches_another_machine(
    server: Served, open_page: OpenPage, browser: Browser, fence: Fence
) -> None:
    page = open_page(server.address)
    page.is_live()
    eventually(lambda: page.page.frame_locator("#scene").locator("canvas").count(), "the scene")
    assert page.elsewhere() == []
    assert fence.asked == []
    # The page may not even if its code said so, and who does all the same is noticed.
    assert page.page.evaluate("fetch('http://fonts.example/').then(() => 1, () => 0)") == 0
    assert fence.asked == []
    page.errors.clear()  # its own policy forbade it
    context = browser.new_context()
    context.new_page().evaluate("fetch('http://fonts.example/').catch(() => 0)")
    context.close()
    assert fence.asked.pop().startswith("GET http://fonts.example/")
    # Nor does its server.
    for one in psutil.Process(server.process.pid).net_connections("inet"):
        assert not one.raddr or one.raddr.ip == "127.0.0.1"
