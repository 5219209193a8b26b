"""Everyone who looks at the page: each gets what has changed, at their own speed."""

import asyncio
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, Final

import msgspec
import structlog
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from fras_monitor.access import Role
from fras_monitor.commands import AnyCommand, BadCommand, Here, Look, Stop, parse
from fras_monitor.page.door import WHO

Content = Mapping[str, Any]
MAX_VIEWERS: Final = 20
MESSAGES: Final = 16
# A page in sight says so each 0.3 s; one whose browser has gone, or hides it, is soon none.
HERE_S: Final = 1.0
ENCODE = msgspec.json.Encoder().encode


class Viewer:
    """One open page: what it was sent last, and what waits for it.

    Parameters
    ----------
    role : {"surgeon", "viewer"}
    """

    def __init__(self, role: Role) -> None:
        self.role = role
        self.heard_s = float("-inf")
        self.changed = asyncio.Event()
        self._sent: dict[str, Any] = {}
        self._said: list[Content] = []

    def say(self, words: Content) -> None:
        """Send something once; of many that a slow page has not taken yet the last ones."""
        self._said = [*self._said, words][-MESSAGES:]
        self.changed.set()

    def take(self, content: Content) -> dict[str, Any]:
        """Return what this page does not know yet; empty if nothing."""
        news = {
            name: value
            for name, value in content.items()
            if name not in self._sent or self._sent[name] != value
        }
        self._sent |= news
        if self._said:
            news["said"] = self._said
            self._said = []
        return news


class Hub:
    """Speaks with all open pages; all but `publish` and `say` runs on the server's own thread.

    Parameters
    ----------
    session : str
        Name of this server's life: a page of another one loads itself anew.
    on_command : callable
        Gets what a surgeon asks for; it must not wait.
    """

    def __init__(self, session: str, on_command: Callable[[AnyCommand], None]) -> None:
        self._session = session
        self._on_command = on_command
        self._content: Content = {}
        self._viewers: set[Viewer] = set()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._log = structlog.get_logger(service="monitor")

    def counts(self, now_s: float) -> tuple[int, int]:
        """How many open pages have answered lately: that can stop the arms, that can only look."""
        roles = [one.role for one in tuple(self._viewers) if now_s - one.heard_s < HERE_S]
        return roles.count("surgeon"), roles.count("viewer")

    def publish(self, content: Content) -> None:
        """Show something else from now on."""
        self._content = {**self._content, **content}
        self._soon(self._wake_all)

    def say(self, words: str, *, good: bool = True) -> None:
        """Tell every page something once."""
        told = {"words": words, "good": good}
        self._soon(lambda: [one.say(told) for one in self._viewers])

    async def attend(self, connection: ServerConnection) -> None:
        """Serve one page until it goes."""
        self._loop = asyncio.get_running_loop()
        if len(self._viewers) >= MAX_VIEWERS:
            await connection.close(1013, "too many pages are open")
            return
        viewer = Viewer(WHO.get())
        viewer.say({"you": viewer.role, "session": self._session})
        self._viewers.add(viewer)
        sender = asyncio.create_task(self._send(connection, viewer))
        try:
            # However it closes, that a page goes is no fault; who is left shows in `counts`.
            with suppress(ConnectionClosed):
                async for message in connection:
                    self._hear(viewer, message)
        finally:
            self._viewers.discard(viewer)
            sender.cancel()

    def _hear(self, viewer: Viewer, message: str | bytes) -> None:
        try:
            command = parse(message)
        except BadCommand as error:
            self._log.warning("a page sent what no button sends", problem=str(error))
            viewer.say({"words": "That was not understood.", "good": False})
            return
        if isinstance(command, Here):
            viewer.heard_s = time.monotonic()
            return
        if viewer.role != "surgeon" and not isinstance(command, Look):
            viewer.say({"words": "This page may only look.", "good": False})
            return
        self._on_command(command)
        if isinstance(command, Stop):
            self._wake_all()

    async def _send(self, connection: ServerConnection, viewer: Viewer) -> None:
        try:
            while True:
                await viewer.changed.wait()
                viewer.changed.clear()
                if news := viewer.take(self._content):
                    await connection.send(ENCODE(news).decode())
        except ConnectionClosed:
            return

    def _wake_all(self) -> None:
        for viewer in self._viewers:
            viewer.changed.set()

    def _soon(self, job: Callable[[], object]) -> None:
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(job)
