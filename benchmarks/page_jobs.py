"""What `fras bench page` measures: stops, the first picture, and what a page costs a tick."""

import multiprocessing
import re
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from importlib.metadata import version
from itertools import pairwise
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

import numpy as np
from benchmarks.surgeon import SCREENS, SurgeonsPage
from benchmarks.theatre import Theatre
from numpy.typing import NDArray
from playwright.sync_api import Browser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from fras_cli.report import read_trial

Floats = NDArray[np.float64]

STOPPED: Final = re.compile(r"acknowledged after (\d+) ms, arms at rest after (\d+) ms")
STILL: Final = frozenset({"rest", "settle", "held", "interrupted", "done"})
MOST_REPLANS: Final = 100
MESH: Final = "21,25,2"

FIRST_PICTURE_AFTER: Final = "first picture after ms "
# Say when the canvas in the frame of the scene first shows something that is not white. All from
# the page around it: a script that Playwright is to run in a new frame is at times not run there.
# Said on the console: who waits in a page has Playwright compile scripts of its own there.
FIRST_PICTURE: Final = """
if (window === window.top) {
  const small = document.createElement("canvas");
  small.width = small.height = 48;
  const context = small.getContext("2d", { willReadFrequently: true });
  const shows = (canvas) => {
    if (canvas.width === 0 || canvas.height === 0) return false;
    context.clearRect(0, 0, 48, 48);
    context.drawImage(canvas, 0, 0, 48, 48);
    const { data } = context.getImageData(0, 0, 48, 48);
    for (let at = 0; at < data.length; at += 4) {
      if (data[at + 3] > 100 && Math.min(data[at], data[at + 1], data[at + 2]) < 200) return true;
    }
    return false;
  };
  const look = () => {
    const scene = document.getElementById("scene").contentDocument;
    if ([...scene.querySelectorAll("canvas")].some(shows)) {
      console.log("first picture after ms " + performance.now());
    } else requestAnimationFrame(look);
  };
  const keepDrawn = () => {
    const scene = document.getElementById("scene")?.contentWindow;
    if (!scene?.location.pathname.startsWith("/scene") || scene.document.body === null) return;
    clearInterval(looking);
    const kind = scene.HTMLCanvasElement.prototype;
    const made = kind.getContext;
    kind.getContext = function (name, options) {
      // What was drawn stays readable until the next frame.
      const kept = name.startsWith("webgl") ? { ...options, preserveDrawingBuffer: true } : options;
      return made.call(this, name, kept);
    };
    requestAnimationFrame(look);
  };
  const looking = setInterval(keepDrawn, 5);
}
"""


def measure_stops(
    theatre: Theatre, page: SurgeonsPage, count: int, seed: int, tell: Callable[[int], None]
) -> tuple[Floats, Floats]:
    """Press STOP while an arm moves, at random times, resume, and again.

    Returns
    -------
    acknowledged, at_rest : ndarray, shape (count,) [ms]
        From the server's receipt of the press, as the page tells them.
    """
    rng = np.random.default_rng(seed)
    told: list[tuple[int, int]] = []
    while len(told) < count:
        if not theatre.task or theatre.task[-1].phase == "idle":
            theatre.start(1.0, mesh=MESH, planner={"max_replans": MOST_REPLANS})
        page.page.wait_for_timeout(float(rng.uniform(0.0, 400.0)))
        if not _moves(theatre):
            continue
        page.stop()
        page.reads("stopped", STOPPED)
        found = STOPPED.search(page.read("stopped"))
        if found is None:
            raise RuntimeError("the stop was forgotten before it was read")
        told.append((int(found[1]), int(found[2])))
        tell(len(told))
        page.press("Let the arms go on")
        page.press("Yes, go on")
        theatre.until_held()
    theatre.end()
    times = np.array(told, dtype=np.float64)
    return times[:, 0], times[:, 1]


def _moves(theatre: Theatre) -> bool:
    state = theatre.robot[-1] if theatre.robot else None
    return state is not None and state.action is not None and state.action.phase not in STILL


def measure_first_picture(browser: Browser, address: str, count: int) -> Floats:
    """Open the page anew, nothing cached; until tissue is drawn, shape (count,) [s]."""
    taken: list[float] = []
    for _ in range(count):
        # No `SurgeonsPage`: what it intercepts goes through this process first.
        page = browser.new_page(viewport=SCREENS)
        page.add_init_script(FIRST_PICTURE)
        with page.expect_console_message(
            lambda one: one.text.startswith(FIRST_PICTURE_AFTER)
        ) as said:
            page.goto(address, wait_until="commit")
        taken.append(float(said.value.text.removeprefix(FIRST_PICTURE_AFTER)) / 1e3)
        page.close()
    return np.array(taken)


def watch(address: str, ready: Event, done: Event) -> None:
    """Take all that the page's server sends a browser, and draw nothing; a process of its own."""
    here = urlsplit(address).netloc
    viser = [Subprotocol(f"viser-v{version('viser')}")]

    def drain(path: str, protocols: list[Subprotocol] | None) -> None:
        with connect(f"ws://{here}/{path}", subprotocols=protocols, max_size=None) as socket:
            socket.recv()
            entered.release()
            try:
                while not done.is_set():
                    socket.recv()
            except ConnectionClosed:
                return

    entered = threading.Semaphore(0)
    for path, protocols in (("control", None), ("scene", viser)):
        threading.Thread(target=drain, args=(path, protocols), daemon=True).start()
    for _ in range(2):
        entered.acquire()
    ready.set()
    done.wait()


@contextmanager
def watched(address: str) -> Generator[None]:
    """Have a page open that does not draw."""
    context = multiprocessing.get_context("spawn")
    ready, done = context.Event(), context.Event()
    process = context.Process(target=watch, args=(address, ready, done))
    process.start()
    try:
        if not ready.wait(60):
            raise RuntimeError("the page's server says nothing")
        yield
    finally:
        done.set()
        process.join()


def tick_ms(theatre: Theatre, seed: int) -> Floats:
    """Run a scene as fast as possible; how long each tick within an action took [ms]."""
    theatre.start(0.0, mesh=MESH, seed=seed)
    theatre.until_ended()
    return durations_ms(theatre.folder / "audit.mcap")


def loop_ms(theatre: Theatre, seed: int) -> Floats:
    """Run a scene at the pace of life; each tick, from the arms' state to the verdict [ms]."""
    theatre.start(1.0, mesh=MESH, seed=seed)
    theatre.until_ended()
    trial = read_trial(theatre.folder / "audit.mcap")
    judged = {one.tick: one.stamp_ns for one in trial.verdicts}
    return np.array(
        [
            (judged[one.tick] - one.stamp_ns) / 1e6
            for one in trial.robot
            if one.goal_id and one.tick in judged
        ]
    )


def durations_ms(log: Path) -> Floats:
    """Return the time between two robot states of the same action [ms]."""
    robot = read_trial(log).robot
    return np.array(
        [
            (after.stamp_ns - before.stamp_ns) / 1e6
            for before, after in pairwise(robot)
            if before.goal_id == after.goal_id != ""
        ]
    )
