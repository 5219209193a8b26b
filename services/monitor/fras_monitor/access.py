"""Who may open the page and press its buttons: pure decisions on what a browser sends."""

import hmac
import re
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from typing import Final, Literal
from urllib.parse import parse_qs, urlsplit

from fras_common.errors import FrasError

Role = Literal["surgeon", "viewer"]
MIN_TOKEN: Final = 16
TOKEN: Final = re.compile(r"[A-Za-z0-9_-]+")


class OpenToAll(FrasError):
    """The page would listen to other machines without asking for a token."""


class BadToken(FrasError):
    """A token that is short, or can't stand in an address and a cookie."""


@dataclass(frozen=True)
class Policy:
    """What is asked of a browser.

    Attributes
    ----------
    token : str
        Whoever knows it may do everything; empty: whoever reaches the port may.
    view_token : str
        Whoever knows this one may look; empty: there is none.
    read_only : bool
        Nobody may do more than look.

    Raises
    ------
    BadToken
    """

    token: str = ""
    view_token: str = ""
    read_only: bool = False

    def __post_init__(self) -> None:
        for token in filter(None, (self.token, self.view_token)):
            if len(token) < MIN_TOKEN or not TOKEN.fullmatch(token):
                raise BadToken(
                    f"a token has at least {MIN_TOKEN} letters, digits, dashes and underscores"
                )
        if self.view_token and (not self.token or self.token == self.view_token):
            raise BadToken("a token to look needs another one to do more: give --token, too")

    def role_of(self, shown: str) -> Role | None:
        """Say what somebody who shows a token may do; None: nothing, not even look.

        Notes
        -----
        Both comparisons are made each time, and each takes as long whatever is shown.
        """
        full = hmac.compare_digest(shown.encode(), self.token.encode())
        view = hmac.compare_digest(shown.encode(), self.view_token.encode())
        if full or not self.token:
            return "viewer" if self.read_only else "surgeon"
        return "viewer" if view and self.view_token else None


def require_closed(host: str, policy: Policy) -> None:
    """Refuse to listen to other machines without a token.

    Raises
    ------
    OpenToAll
    """
    if policy.token or is_loopback(host):
        return
    raise OpenToAll(
        f"--host {host} lets other machines in: give a --token, too (or leave --host out)",
        host=host,
    )


def is_loopback(host: str) -> bool:
    """Whether a name stands for this machine alone."""
    if host == "localhost":
        return True
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def token_in_query(path: str) -> str:
    """Return what the query of a request's path shows as `token`; empty if nothing."""
    return parse_qs(urlsplit(path).query).get("token", [""])[0]


def cookie_name(port: int) -> str:
    """Name the cookie of the page at a port: a browser sends those of a host to all its ports."""
    return f"fras_token_{port}"


def token_in_cookies(header: str, port: int) -> str:
    """Return what the cookies show to the page at a port; empty if nothing."""
    try:
        morsel = SimpleCookie(header).get(cookie_name(port))
    except CookieError:
        return ""
    return morsel.value if morsel is not None else ""


def query_of(policy: Policy) -> str:
    """Return what to put behind the page's address so that it opens."""
    return f"?token={policy.token}" if policy.token else ""


def cookie_for(token: str, port: int) -> str:
    """Return the header that makes the browser show the token from now on, to this page alone."""
    return f"{cookie_name(port)}={token}; Path=/; HttpOnly; SameSite=Strict"


def comes_from_here(origin: str | None, host: str, policy: Policy) -> bool:
    """Whether a request is of a page of ours, not of another site open in the same browser.

    Parameters
    ----------
    origin : str or None
        The header of that name; browsers send it with each web socket, programs need not.
    host : str
        The header of that name.
    policy : Policy
        Without a token a name that merely leads here is refused, too: another site could make its
        own name do so.
    """
    if not policy.token and not is_loopback(urlsplit(f"//{host}").hostname or ""):
        return False
    return origin is None or urlsplit(origin).netloc == host
