"""The surgeon's page as a person has it: served by its own process, opened in a browser."""

import io
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Final
from urllib.parse import urlencode, urlsplit

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser, Page, Route, ViewportSize, expect

from fras_cli.link import Link

PATIENCE_MS: Final = 90_000.0
SCREENS: Final[ViewportSize] = {"width": 1280, "height": 800}
ANNOUNCED: Final = re.compile(r"the surgeon's page: (http\S+)")
expect.set_options(timeout=PATIENCE_MS)
SCENE: Final = re.compile(r"/scene/[^/?]+/$")
BLANK: Final = "<!doctype html><title>not drawn</title>"


class Served:
    """A page's server, in a process of its own.

    Parameters
    ----------
    command : sequence of str
        Without its port.
    """

    def __init__(self, command: Sequence[str]) -> None:
        self._command = command
        self.address = ""
        self.start()

    def start(self, port: int = 0) -> None:
        """Start it and wait until it says where the page is."""
        self.process = subprocess.Popen(
            [*self._command, "--port", str(port)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        said: list[str] = []
        for line in self._output:
            said.append(line)
            if (found := ANNOUNCED.search(line)) is not None:
                self.address = found[1]
                break
        else:
            raise RuntimeError("no page is served:\n" + "".join(said))
        # What nobody reads would fill the pipe, and then stop the process.
        self._drain = threading.Thread(target=self._output.read, daemon=True)
        self._drain.start()

    @property
    def _output(self) -> IO[str]:
        output = self.process.stdout
        if output is None:
            raise RuntimeError("its output goes elsewhere")
        return output

    @property
    def port(self) -> int:
        """Where it listens."""
        return urlsplit(self.address).port or 0

    def kill(self) -> None:
        """End it as a crash would."""
        self.process.kill()
        self._reap()

    def stop(self) -> None:
        """End it as Ctrl-C would, with all that it started."""
        self.process.send_signal(signal.SIGINT)
        self._reap()

    def _reap(self) -> None:
        self.process.wait()
        self._drain.join()
        self._output.close()


@contextmanager
def served(link: Link, *arguments: str, cell: str = "") -> Generator[Served]:
    """Serve the page of a cell, that of the link if none is named, as long as it is needed."""
    made = Served(
        [
            *(sys.executable, "-m", "fras_monitor"),
            *("--cell", cell or link.cell, "--connect", link.connect, *arguments),
        ]
    )
    try:
        yield made
    finally:
        made.kill()


@contextmanager
def served_log(log: Path, cell: str) -> Generator[Served]:
    """Serve the page over a log."""
    made = Served([sys.executable, "-m", "fras_cli", "monitor", str(log), "--cell", cell])
    try:
        yield made
    finally:
        made.stop()


class SurgeonsPage:
    """One open page, and everything that it asked the network for.

    Parameters
    ----------
    browser : Browser
    address : str
        Where the page is, token included.
    scene : bool
        False: the scene is left out, which spares a second of computing it.
    screen : ViewportSize
        Width and height of the window.
    sharpness : float
        Pixels of a picture for each of the window's.

    Attributes
    ----------
    errors : list of str
        What the browser reports as one.
    status : int
        With what the server answered the first request.
    """

    def __init__(
        self,
        browser: Browser,
        address: str,
        *,
        scene: bool = True,
        screen: ViewportSize | None = None,
        sharpness: float = 0.5,
    ) -> None:
        self.errors: list[str] = []
        self._places: list[str] = []
        self._netloc = urlsplit(address).netloc
        size = screen or SCREENS
        # A quarter of the pixels: they are computed, and what is read is the text.
        self.context = browser.new_context(viewport=size, device_scale_factor=sharpness)
        self.context.set_default_timeout(PATIENCE_MS)
        if scene:
            # viser draws fewer pixels where frames take long, and two pictures of one view differ.
            where = {"fixedDpr": f"{sharpness:g}"}
            self.context.route(SCENE, lambda route: _lead(route, where))
        else:
            self.context.route("**/scene/**", lambda route: route.fulfill(body=BLANK))
        self.context.on("request", lambda request: self._places.append(request.url))
        self.page: Page = self.context.new_page()
        self.page.on("websocket", lambda one: self._places.append(one.url))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on(
            "console",
            lambda said: self.errors.append(said.text) if said.type == "error" else None,
        )
        answer = self.page.goto(address, wait_until="commit")
        self.status = answer.status if answer is not None else 0

    def elsewhere(self) -> list[str]:
        """Return what was asked of anybody but the page's own server."""
        return [place for place in self._places if not self._is_here(place)]

    def _is_here(self, place: str) -> bool:
        parts = urlsplit(place.removeprefix("blob:"))
        return parts.scheme == "data" or parts.netloc == self._netloc

    def reads(self, name: str, words: str | re.Pattern[str]) -> None:
        """Wait until the element of that id reads so."""
        expect(self.page.locator(f"#{name}")).to_contain_text(words, timeout=PATIENCE_MS)

    def read(self, name: str) -> str:
        """Return what the element of that id reads now."""
        return self.page.locator(f"#{name}").inner_text()

    def is_live(self) -> None:
        """Wait until the page says that what it shows is now."""
        self.reads("live", re.compile(r"^Live$"))

    def is_old(self) -> None:
        """Wait until the page says that it is not."""
        expect(self.page.locator("body")).to_have_class(re.compile(r"\bold\b"), timeout=PATIENCE_MS)
        expect(self.page.locator("#cover")).to_be_visible()

    def press(self, name: str) -> None:
        """Click what a person would."""
        self.page.get_by_role("button", name=name, exact=False).click()

    def stop(self) -> None:
        """Click STOP as a person does: where it stands, without asking whether it is ready."""
        box = self.page.locator("#stop").bounding_box()
        if box is None:
            raise RuntimeError("STOP is not to be seen")
        self.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)

    def scene(self) -> NDArray[np.int16]:
        """Take a picture of the canvas that the tissue is drawn on, shape (height, width, 3)."""
        canvas = self.page.frame_locator("#scene").locator("canvas").first
        shot = canvas.screenshot(timeout=PATIENCE_MS)
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"), dtype=np.int16)

    def force_n(self) -> float:
        """Return the force that the page shows; 0 while it knows none."""
        found = re.match(r"[\d.]+", self.read("force-words"))
        return float(found[0]) if found else 0.0

    def rows(self) -> list[tuple[str, str]]:
        """Return the timetable: text and state of each action."""
        found = self.page.locator("#plan li")
        at_once = "all => all.map((one) => [one.innerText, one.className])"
        return [(text, state) for text, state in found.evaluate_all(at_once)]

    def close(self) -> None:
        """Leave it."""
        self.context.close()


def _lead(route: Route, query: Mapping[str, str]) -> None:
    """Have a page ask once more, with a query."""
    route.fulfill(status=302, headers={"Location": f"{route.request.url}?{urlencode(query)}"})


def differing(one: NDArray[np.int16], other: NDArray[np.int16]) -> int:
    """Count the pixels that differ by more than antialiasing does."""
    return int(np.count_nonzero(np.abs(one - other).max(axis=2) > 24))
