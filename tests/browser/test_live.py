"""A procedure as the page shows it, stopped and resumed there."""

import re
from collections.abc import Callable

from benchmarks.surgeon import Served, SurgeonsPage, differing
from benchmarks.theatre import Theatre, eventually
from playwright.sync_api import expect

from fras_common.messages import Plan

OpenPage = Callable[..., SurgeonsPage]

INSTRUMENTS = {"psm1": "Right instrument", "psm2": "Left instrument"}
VERBS = {"reach": "reach", "grasp": "grasp", "pull": "lift", "move": "carry", "release": "let go"}
TISSUE_PIXELS = 2000
# So slow that an action lasts for as long as a busy machine takes to click.
SLOWLY = 0.1


def told(plan: Plan) -> list[tuple[str, str, str]]:
    """Who does what where, of each action of a plan."""
    return [
        (
            INSTRUMENTS[action.args[0]],
            VERBS[action.name],
            "-".join(re.findall(r"\d+", action.args[1])) if len(action.args) > 1 else "",
        )
        for action in plan.actions
    ]


def test_stop_stops_until_it_is_lifted_twice_asked(
    trial: Theatre, server: Served, open_page: OpenPage
) -> None:
    page = open_page(server.address)
    page.is_live()
    trial.start(pace=SLOWLY)
    trial.until_acting("reach")
    page.stop()
    page.reads("stopped", re.compile(r"acknowledged after \d+ ms, arms at rest after \d+ ms"))
    state = trial.robot[-1]
    assert state.holds.keys() == {"monitor"}
    assert state.action is not None
    assert state.action.phase == "held"
    page.reads("headline", "The arms are held")
    page.reads("holds", "Stopped on this page")

    # The plan on the page is the plan of the message, and nothing of it is done.
    plan = trial.plans[-1]
    rows = page.rows()
    assert [state for _, state in rows] == ["current", "next", "next"]
    for (text, _), (who, what, where) in zip(rows, told(plan), strict=True):
        assert text.startswith(who)
        assert what in text
        assert text.endswith(f"point {where}")

    assert differing(page.scene(), page.scene()) == 0
    assert trial.robot[-1].tick == state.tick

    page.press("Let the arms go on")
    page.press("No, stay")
    assert trial.held[-1].holds.keys() == {"monitor"}
    page.press("Let the arms go on")
    page.press("Yes, go on")
    trial.until_held()
    page.reads("stopped", re.compile(r"^$"))
    trial.until_acting("reach")
    page.reads("headline", "reaching for point")


def test_the_tissue_moves_and_the_end_is_told(
    trial: Theatre, server: Served, open_page: OpenPage
) -> None:
    page = open_page(server.address)
    page.is_live()
    trial.start(pace=SLOWLY)
    trial.until_acting("reach")
    page.reads("headline", "reaching for point")
    flat = page.scene()
    trial.end()
    trial.start(pace=0)
    assert trial.until_ended().outcome == "success"
    page.reads("outcome", "The target region is exposed.")
    page.reads("visibility-words", re.compile("^exposed: "))
    assert {state for _, state in page.rows()} == {"done"}
    assert differing(flat, page.scene()) > TISSUE_PIXELS


def test_two_look_and_a_key_stops_from_wherever_it_was_clicked_last(
    trial: Theatre, server: Served, open_page: OpenPage
) -> None:
    pages = [open_page(server.address, scene=scene) for scene in (True, False)]
    for page in pages:
        page.is_live()
    trial.start(pace=SLOWLY)
    trial.until_acting("reach")
    for page in pages:
        page.reads("headline", "reaching for point")
    # The keyboard belongs to the scene's frame from the click on.
    pages[0].page.mouse.click(420, 600)
    assert pages[0].page.evaluate("document.activeElement.id") == "scene"
    pages[0].page.keyboard.press("Space")
    for page in pages:
        page.reads("stopped", "arms at rest after")
        page.reads("holds", "Stopped on this page")
    assert pages[0].rows() == pages[1].rows() != []
    pages[1].press("Let the arms go on")
    # STOP is pressed while the other page asks: what was agreed to is asked anew.
    pages[0].stop()
    expect(pages[1].page.locator("#ask")).to_be_visible()
    pages[1].press("Yes, go on")
    trial.until_held()
    for page in pages:
        expect(page.page.locator("#held")).to_be_hidden()


def test_a_plan_is_approved_or_rejected_with_a_reason(
    trial: Theatre, server: Served, open_page: OpenPage
) -> None:
    page = open_page(server.address, scene=False)
    trial.start(pace=SLOWLY, planner={"confirm": True})
    expect(page.page.locator("#approval")).to_be_visible()
    first = trial.plans[-1]
    page.page.get_by_label("Why not").fill("a vessel runs there")
    page.press("Reject")
    eventually(lambda: trial.plans[-1].request_id != first.request_id, "another plan")
    second = trial.plans[-1]
    assert second.target != first.target
    assert first.target in second.rejected
    page.reads("decisions", re.compile("rejected. A vessel runs there"))
    (who, _, where), *_ = told(second)
    page.reads("plan", re.compile(f"{who}: reach for point {where}"))
    assert not trial.robot or trial.robot[-1].action is None
    page.press("Approve")
    trial.until_acting("reach")
    expect(page.page.locator("#approval")).to_be_hidden()
    assert [one.approved for one in trial.task[-1].decisions] == [False, True]
    assert {one.by for one in trial.task[-1].decisions} == {"monitor"}


def test_a_supervised_procedure_waits_while_no_page_is_open(
    trial: Theatre, server: Served, open_page: OpenPage
) -> None:
    page = open_page(server.address, scene=False)
    page.is_live()
    trial.until_seen()
    trial.start(pace=SLOWLY, run={"supervised": True})
    trial.until_acting("reach")
    assert trial.robot[-1].holds == {}
    page.close()
    eventually(lambda: trial.robot[-1].holds, "held since nobody looks")
    again = open_page(server.address, scene=False)
    trial.until_seen()
    again.reads("headline", "The arms are held")
    again.press("Let the arms go on")
    again.press("Yes, go on")
    trial.until_held()
