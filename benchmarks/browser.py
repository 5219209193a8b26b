"""A headless Chromium that reaches this machine alone: for tests, pictures and benchmarks.

Whatever it would ask of another machine goes to a fence instead, a listener that answers nothing
and notes who was asked for. It is Debian's headless shell: the whole browser asks its maker for
updates and accounts, whatever its options say, and takes twice as long to start.
"""

import os
import shutil
import socket
import threading
from collections.abc import Generator
from contextlib import contextmanager
from typing import Final

from playwright.sync_api import Browser, sync_playwright

NAMES: Final = ("chromium-headless-shell", "chrome-headless-shell")
VARIABLE: Final = "FRAS_CHROMIUM"
OPTIONS: Final = (
    "--no-sandbox",  # root has no other way; the page is ours
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-quic",
    "--disable-sync",
    # No display, no graphics processor: WebGL is computed.
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
)
FIRST_LINE_BYTES: Final = 4096
FIRST_LINE_S: Final = 5.0


class NoBrowser(Exception):
    """No Chromium is installed: `make browser` installs one."""


class Fence:
    """Stands where the way to other machines would be, and notes what was asked for there.

    Attributes
    ----------
    asked : list of str
        First lines of the requests, `CONNECT fonts.example:443 HTTP/1.1`.
    address : str
        Where it listens.
    """

    def __init__(self) -> None:
        self.asked: list[str] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self._thread = threading.Thread(target=self._run, name="fence", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:  # closed
                return
            with connection:
                connection.settimeout(FIRST_LINE_S)
                try:
                    said = connection.recv(FIRST_LINE_BYTES)
                except OSError:
                    said = b""
            self.asked.append(said.partition(b"\r\n")[0].decode("ascii", "replace"))

    def close(self) -> None:
        """End it."""
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._thread.join()


def find_chromium() -> str:
    """Return the path of a headless shell: that of `$FRAS_CHROMIUM`, or one on the path.

    Raises
    ------
    NoBrowser
    """
    for name in filter(None, (os.environ.get(VARIABLE), *NAMES)):
        if (found := shutil.which(name)) is not None:
            return found
    raise NoBrowser(f"no headless Chromium is here ({', '.join(NAMES)}): `make browser`")


@contextmanager
def chromium(fence: Fence) -> Generator[Browser]:
    """Start a headless Chromium with an empty profile of its own; end it whatever happens.

    Raises
    ------
    NoBrowser
    """
    path = find_chromium()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=path,
            args=list(OPTIONS),
            proxy={"server": f"http://{fence.address}", "bypass": "127.0.0.1,localhost"},
        )
        try:
            yield browser
        finally:
            browser.close()
