"""The one port of the page: who may enter, and what is behind which path.

viser makes its web server itself and offers no place for a token, for pages of ours, or for a
second web socket. So for the moment in which it does, `websockets`' `serve` is replaced by one that
puts this door in front of viser's handler and in place of its files. Nothing else is touched.
"""

import re
import secrets
import socket
from collections.abc import Awaitable, Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from http import HTTPStatus
from pathlib import Path
from typing import Any, Final

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from fras_common.errors import FrasError
from fras_monitor.access import (
    Policy,
    Role,
    comes_from_here,
    cookie_for,
    token_in_cookies,
    token_in_query,
)
from fras_monitor.page.client import Text, read_client

WHO: ContextVar[Role] = ContextVar("WHO", default="viewer")
"""What whoever sent the message that is being handled may do."""

PAGE: ContextVar[str] = ContextVar("PAGE", default="")
"""Which page's scene it was that sent it."""

CONTROL: Final = "/control"
SCENE: Final = re.compile(r"/scene(?:/([0-9a-f]{1,32}))?(/?)")
_HTML: Final = "text/html; charset=utf-8"
_JAVASCRIPT: Final = "text/javascript; charset=utf-8"
FILES: Final = {
    "/page.css": ("page.css", "text/css; charset=utf-8"),
    "/page.js": ("page.js", _JAVASCRIPT),
    "/plot.js": ("plot.js", _JAVASCRIPT),
}
# In `page.html`: whose scene it is. The server tells the pages' cameras apart by it.
_SCENE_OF_PAGE: Final = b"{page}"
# A browser that keeps to it can contact nobody but this server, whatever the page's code says.
_OURS: Final = (
    "default-src 'self'; img-src 'self' data:; object-src 'none'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
_VISERS: Final = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' blob: data:; connect-src 'self' blob: data:; "
    "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
_SCENES_PAGE: Final = {
    "Content-Type": _HTML,
    "Content-Security-Policy": _VISERS,
    "Cache-Control": "no-cache",
}
# Its name changes with what is in it.
_SCENES_PROGRAM: Final = {
    "Content-Type": _JAVASCRIPT,
    "Content-Security-Policy": _VISERS,
    "Cache-Control": "private, max-age=31536000, immutable",
}
_NO_TOKEN: Final = (
    b"This page asks for a token: open the address that `fras monitor` printed, token included.\n"
)

Handler = Callable[[ServerConnection], Awaitable[None]]


class PortInUse(FrasError):
    """Another program listens where the page was to be."""


class Server(viser.ViserServer):
    """viser's server, that makes no tunnel to the outside for whoever asks it to."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse: a page of an operating room is shared by nobody."""
        return None


class Door:
    """Listens, and lets in.

    Parameters
    ----------
    host : str
    port : int
        0: any that is free.
    policy : Policy
    control : callable
        Takes over each web socket of our own page.

    Raises
    ------
    PortInUse
    """

    def __init__(self, host: str, port: int, policy: Policy, control: Handler) -> None:
        self._policy = policy
        self._control = control
        self._client = read_client()
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self.socket = socket.socket(family, socket.SOCK_STREAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self.socket.bind((host, port))
        except OSError as error:
            self.socket.close()
            raise PortInUse(
                f"the page can't listen at {host}:{port}: {error.strerror}; choose another --port",
                port=port,
            ) from error
        self.host, self.port = host, int(self.socket.getsockname()[1])

    @property
    def address(self) -> str:
        """Where a browser finds the page."""
        name = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{name}:{self.port}/"

    def open(self) -> Server:
        """Start viser's server behind this door."""
        with self._in_front():
            return Server(host=self.host, port=self.port, verbose=False)

    @contextmanager
    def _in_front(self) -> Generator[None]:
        module: Any = websockets.asyncio.server
        serve = module.serve

        def ours(handler: Handler, host: str, port: int, **options: Any) -> Any:
            del host, port
            options["process_request"] = self._screen
            return serve(self._guarded(handler), sock=self.socket, **options)

        module.serve = ours
        try:
            yield
        finally:
            module.serve = serve

    def _guarded(self, visers: Handler) -> Handler:
        async def handle(connection: ServerConnection) -> None:
            request = connection.request
            role = self._role(request) if request is not None else None
            if request is None or role is None:
                return
            WHO.set(role)
            path = request.path.partition("?")[0]
            if (scene := SCENE.fullmatch(path)) is not None:
                PAGE.set(scene[1] or "")
            await (self._control if path == CONTROL else visers)(connection)

        return handle

    def _screen(self, _: ServerConnection, request: Request) -> Response | None:
        path = request.path.partition("?")[0]
        upgrades = request.headers.get("Upgrade", "").lower() == "websocket"
        host = request.headers.get("Host", "")
        if not comes_from_here(request.headers.get("Origin"), host, self._policy):
            return _plain(HTTPStatus.FORBIDDEN, b"Not from here.\n")
        if self._role(request) is None:
            return _plain(HTTPStatus.UNAUTHORIZED, _NO_TOKEN)
        if upgrades:
            known = path == CONTROL or SCENE.fullmatch(path)
            return None if known else _plain(HTTPStatus.NOT_FOUND, b"No such place.\n")
        if path == "/":
            if token := token_in_query(request.path):
                headers = {"Location": "/", "Set-Cookie": cookie_for(token, self.port)}
                return _response(HTTPStatus.SEE_OTHER, b"", headers)
            return _page()
        if path in FILES:
            return _file(*FILES[path])
        if (scene := SCENE.fullmatch(path)) is not None and scene[1] and scene[2]:
            return _text(request, self._client.page, _SCENES_PAGE)
        if self._client.program is not None and path == f"/scene/{self._client.name}":
            return _text(request, self._client.program, _SCENES_PROGRAM)
        return _plain(HTTPStatus.NOT_FOUND, b"No such place.\n")

    def _role(self, request: Request) -> Role | None:
        shown = token_in_query(request.path)
        if not shown:
            shown = token_in_cookies(request.headers.get("Cookie", ""), self.port)
        return self._policy.role_of(shown)


def _text(request: Request, text: Text, headers: dict[str, str]) -> Response:
    """Send it packed to a browser that takes it so."""
    packs = "gzip" in request.headers.get("Accept-Encoding", "")
    told = {"Content-Encoding": "gzip" if packs else "identity", **headers}
    return _response(HTTPStatus.OK, text.packed if packs else text.plain, told)


def _page() -> Response:
    """Send the page, which asks for its scene at once."""
    body = _read("page.html").replace(_SCENE_OF_PAGE, secrets.token_hex(16).encode())
    headers = {"Content-Type": _HTML, "Content-Security-Policy": _OURS, "Cache-Control": "no-store"}
    return _response(HTTPStatus.OK, body, headers)


def _file(name: str, kind: str) -> Response:
    headers = {"Content-Type": kind, "Content-Security-Policy": _OURS, "Cache-Control": "no-cache"}
    return _response(HTTPStatus.OK, _read(name), headers)


def _read(name: str) -> bytes:
    return (Path(__file__).parent / "static" / name).read_bytes()


def _plain(status: HTTPStatus, body: bytes) -> Response:
    return _response(status, body, {"Content-Type": "text/plain; charset=utf-8"})


def _response(status: int, body: bytes, headers: dict[str, str]) -> Response:
    told = {
        "Content-Length": str(len(body)),
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        **headers,
    }
    return Response(status, HTTPStatus(status).phrase, Headers(told), body)
