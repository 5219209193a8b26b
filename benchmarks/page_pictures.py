"""Pictures of the surgeon's page for docs/: `python -m benchmarks.page_pictures [--out DIR]`.

One procedure of scenario b with approval, on the default mesh: its plan waits, is done, stopped,
resumed, crosses the force limit and is made anew; then a frozen service, and the recording.
"""

import argparse
import re
import signal
import tempfile
from pathlib import Path
from typing import Final

import numpy as np
from benchmarks.browser import Fence, chromium
from benchmarks.surgeon import SurgeonsPage, served, served_log
from benchmarks.theatre import Theatre, eventually
from PIL import Image
from playwright.sync_api import Browser, ViewportSize, expect

from fras_cli.stack import own_stack

OUT: Final = Path(__file__).parent.parent / "docs" / "images"
TABLETS: Final[dict[str, ViewportSize]] = {
    "tablet": {"width": 1024, "height": 768},
    "tablet-upright": {"width": 820, "height": 1180},
}
# Slow enough that a picture of a lift is one of a lift.
PACE: Final = 0.05
# What nothing is drawn on differs by less.
WHITE: Final = 64
EVENTS: Final = 12
SETTLE_MS: Final = 1000.0


class Camera:
    """Takes pictures of one page.

    Parameters
    ----------
    browser : Browser
    address : str
    out : Path
    """

    def __init__(self, browser: Browser, address: str, out: Path) -> None:
        self._browser = browser
        self._address = address
        self._out = out
        self.page = self._open()

    def _open(self, screen: ViewportSize | None = None) -> SurgeonsPage:
        page = SurgeonsPage(self._browser, self._address, screen=screen, sharpness=1.0)
        frame = page.page.frame_locator("#scene")
        frame.locator("canvas").first.wait_for()
        # Without a graphics processor viser warns of that; a surgeon's screen has one.
        warning = frame.get_by_role("alert").first
        warning.get_by_role("button").click()
        warning.wait_for(state="hidden")
        return page

    def take(self, name: str) -> None:
        """Write `page-NAME.png`."""
        self._shoot(self.page, name)

    def on_tablets(self) -> None:
        """Open the page on smaller screens, too, and take what they show."""
        for name, screen in TABLETS.items():
            page = self._open(screen)
            page.is_live()
            self._shoot(page, name)
            page.close()

    def _shoot(self, page: SurgeonsPage, name: str) -> None:
        path = self._out / f"page-{name}.png"
        page.page.screenshot(path=path)
        Image.open(path).convert("RGB").save(path, optimize=True)
        print(f"written: {path}", flush=True)


def approved(page: SurgeonsPage) -> None:
    expect(page.page.locator("#approval")).to_be_visible()
    page.press("Approve")


def resumed(page: SurgeonsPage) -> None:
    page.press("Let the arms go on")
    page.press("Yes, go on")


def ask_why_not(page: SurgeonsPage) -> None:
    """Click through the scene, row by row, until a point is hit and the planner answers."""
    box = page.page.locator("#scene").bounding_box()
    if box is None:
        raise RuntimeError("there is no scene")
    for down in range(30, 75, 2):
        for right in range(30, 70, 2):
            page.page.mouse.click(
                box["x"] + box["width"] * right / 100, box["y"] + box["height"] * down / 100
            )
            if "Why not point" in page.read("question"):
                return
    raise RuntimeError("no point was hit")


def take_procedure(theatre: Theatre, camera: Camera) -> None:
    page = camera.page
    page.is_live()
    theatre.start(PACE, "b", "21,25,2", planner={"confirm": True})
    expect(page.page.locator("#approval")).to_be_visible()
    eventually(lambda: np.ptp(page.scene()) > WHITE, "the scene is drawn")
    camera.take("approval")
    page.press("Approve")
    theatre.until_acting("pull")
    eventually(lambda: page.force_n() > 0.15, "the tissue is under load")
    camera.take("pull")
    page.stop()
    page.reads("stopped", "arms at rest after")
    camera.take("stopped")
    resumed(page)
    made = len(theatre.plans)
    while theatre.plans[-1].reason != "force":
        eventually(lambda before=made: len(theatre.plans) > before, "the next plan")
        made = len(theatre.plans)
        if theatre.plans[-1].reason != "force":
            approved(page)
    expect(page.page.locator("#approval")).to_be_visible()
    page.reads("changes", re.compile("force limit"))
    ask_why_not(page)
    page.reads("answer", re.compile(r"\S"))
    camera.take("replan")
    theatre.process("sim").send_signal(signal.SIGSTOP)
    page.is_old()
    camera.take("not-live")
    theatre.process("sim").send_signal(signal.SIGCONT)
    page.is_live()
    page.press("Approve")
    theatre.until_ended()
    page.reads("outcome", re.compile(r"\S"))
    camera.on_tablets()


def take_replay(browser: Browser, log: Path, out: Path) -> None:
    with served_log(log, "pictures-replay") as server:
        camera = Camera(browser, server.address, out)
        camera.page.reads("live", "Replay")
        page = camera.page
        page.press("Pause")
        for _ in range(EVENTS):
            page.press("Next event")
            page.page.wait_for_timeout(SETTLE_MS)
            if "lifting" in page.read("headline"):
                break
        camera.take("replay")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    fence = Fence()
    with tempfile.TemporaryDirectory() as name, chromium(fence) as browser:
        folder = Path(name)
        with (
            own_stack("pictures", None, folder / "logs") as stack,
            served(stack.link) as page,
        ):
            theatre = Theatre(stack, folder)
            take_procedure(theatre, Camera(browser, page.address, options.out))
        take_replay(browser, theatre.folder / "audit.mcap", options.out)
    fence.close()


if __name__ == "__main__":
    main()
