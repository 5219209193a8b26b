"""What is in sight without scrolling, what of viser is not, and from where one looks."""

import re
import signal
from collections.abc import Callable

import pytest
from benchmarks.surgeon import Served, SurgeonsPage, differing
from benchmarks.theatre import Theatre, eventually
from playwright.sync_api import ViewportSize, expect

from fras_common.topics import SERVICES

OpenPage = Callable[..., SurgeonsPage]

NARROW = {"width": 500, "height": 800}
SLOWLY = 0.1
OTHER_PLACE_PIXELS = 2000


@pytest.mark.parametrize("screen", [{"width": 1280, "height": 800}, {"width": 1024, "height": 768}])
def test_the_health_of_every_part_is_in_sight_and_told_in_words(
    theatre: Theatre, server: Served, open_page: OpenPage, screen: ViewportSize
) -> None:
    page = open_page(server.address, scene=False, screen=screen)
    page.is_live()
    lights = page.page.locator("#services li")
    expect(lights).to_have_count(len(SERVICES))
    for number in range(len(SERVICES)):
        expect(lights.nth(number)).to_contain_text("working")
        expect(lights.nth(number)).to_be_in_viewport(ratio=1.0)
    expect(page.page.locator("#log")).to_be_in_viewport(ratio=1.0)
    planner = theatre.process("planner")
    planner.send_signal(signal.SIGSTOP)
    try:
        late = lights.filter(has_text=re.compile(r"planner: silent for \d"))
        expect(late).to_be_in_viewport(ratio=1.0)
        expect(late).to_have_class(re.compile("late|dead"))
    finally:
        planner.send_signal(signal.SIGCONT)
    expect(lights.filter(has_text="planner: working")).to_have_count(1)


@pytest.mark.parametrize(
    ("screen", "panel"),
    [
        ({"width": 1280, "height": 800}, "[data-floating-window]"),
        (NARROW, ".mantine-ScrollArea-root"),
    ],
)
def test_visers_own_panel_covers_nothing_and_opens_no_settings(
    server: Served, open_page: OpenPage, screen: ViewportSize, panel: str
) -> None:
    page = open_page(server.address, screen=screen)
    frame = page.page.frame_locator("#scene")
    # It is there: were it made otherwise, this would not find it.
    expect(frame.locator(panel).first).to_be_attached()
    expect(frame.locator(panel).filter(visible=True)).to_have_count(0)
    # A sheet of viser's warns where there is no graphics processor; nothing else can be pressed.
    pressed = frame.get_by_role("button").filter(visible=True)
    warned = frame.get_by_role("alert").get_by_role("button").filter(visible=True)
    expect(pressed).to_have_count(warned.count())


def test_each_page_looks_from_where_it_likes(
    trial: Theatre, server: Served, open_page: OpenPage
) -> None:
    page, other = open_page(server.address), open_page(server.address)
    trial.start(pace=SLOWLY)
    trial.until_acting("reach")
    for one in (page, other):
        one.reads("headline", "reaching for point")
    page.stop()
    trial.until_held("monitor")
    # Held is said two ticks before the arms stand.
    page.reads("stopped", "arms at rest after")
    before, still = page.scene(), other.scene()
    page.press("From above")
    eventually(
        lambda: differing(before, page.scene()) > OTHER_PLACE_PIXELS, "seen from another place"
    )
    assert differing(still, other.scene()) == 0
    page.press("Overview")
    eventually(lambda: differing(before, page.scene()) == 0, "seen from the first place again")


def test_on_a_tablet_that_is_turned_the_question_is_whole_and_the_plots_are_sharp(
    trial: Theatre, server: Served, open_page: OpenPage
) -> None:
    page = open_page(server.address, scene=False, screen={"width": 1024, "height": 768})
    trial.start(pace=SLOWLY)
    trial.until_acting("reach")
    page.stop()
    trial.until_held("monitor")
    page.reads("stopped", "arms at rest after")
    page.page.set_viewport_size({"width": 768, "height": 1024})
    # As many pixels are painted as are shown: what is painted smaller is stretched.
    plot = "const one = document.getElementById('force-plot');"
    painted = f"{plot} return Math.round(one.clientWidth * devicePixelRatio) === one.width;"
    eventually(lambda: page.page.evaluate(f"() => {{ {painted} }}"), "the plot is painted anew")
    page.press("Let the arms go on")
    # The header lies over everything: what it covers is not what is found at that place.
    found = (
        "const box = document.getElementById('ask-title').getBoundingClientRect();"
        "return document.elementFromPoint(box.x + 5, box.y + box.height / 2)?.id;"
    )
    assert page.page.evaluate(f"() => {{ {found} }}") == "ask-title"
    page.press("No, stay")
