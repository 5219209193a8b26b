"""The command line's own connection to a cell."""

import threading
import uuid
from collections.abc import Callable
from pathlib import Path

from fras_cli import runtime
from fras_common.bus import Bus
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.identity import Identity, default_keys_dir, identity_in
from fras_common.topics import SERVICES

NAME = "cli"


def identity_for(name: str, cell: str, connect: str, keys: Path | None = None) -> Identity | None:
    """Find what to show at an endpoint; None at one that asks for nothing.

    Raises
    ------
    BadIdentity
    """
    if not connect.startswith("tls/"):
        return None
    known = (one.keys for one in runtime.all_of(cell) if one.connect == connect and one.keys)
    noted = next(known, "")
    return identity_in(keys or (Path(noted) if noted else default_keys_dir()), name)


class Link:
    """A bus that opens when it is first needed, and the liveliness tokens seen on it.

    Parameters
    ----------
    cell : str
    connect : str
        Endpoint of the router.
    open_timeout_s : float
        How long to wait for the router.
    keys : Path, optional
        Folder of the certificate to show at a `tls/` endpoint; by default that of the stack that
        this machine has there, else where keys are.
    name : str
        Whose certificate that is.
    """

    def __init__(
        self,
        cell: str,
        connect: str,
        open_timeout_s: float = 10.0,
        keys: Path | None = None,
        name: str = NAME,
    ) -> None:
        self.cell = cell
        self.connect = connect
        self._open_timeout_s = open_timeout_s
        self._keys = keys
        self._name = name
        self._bus: Bus | None = None
        self._tokens: set[str] = set()
        self._changed = threading.Condition()

    @property
    def bus(self) -> Bus:
        """The bus; opened by the first use."""
        if self._bus is None:
            self._bus = ZenohBus(
                self.cell,
                self.connect,
                f"{self._name}/{uuid.uuid4().hex[:4]}",
                open_timeout_s=self._open_timeout_s,
                identity=identity_for(self._name, self.cell, self.connect, self._keys),
            )
            self._bus.watch_tokens(self._on_token)
        return self._bus

    @property
    def is_open(self) -> bool:
        """Whether the bus has been needed yet."""
        return self._bus is not None

    def tokens(self) -> set[str]:
        """Tokens that are there now, without their instance: `{"alive/sim", "ready/sim"}`."""
        _ = self.bus
        with self._changed:
            return {token.rpartition("/")[0] for token in self._tokens}

    def missing(self) -> list[str]:
        """Services of the topic table that are not ready in this cell."""
        ready = self.tokens()
        return [service for service in SERVICES if f"ready/{service}" not in ready]

    def wait_complete(self, timeout_s: float) -> bool:
        """Wait until every service is ready; False if some are not in time."""
        with self._changed:
            return self._changed.wait_for(lambda: not self.missing(), timeout_s)

    def wait_ready(self, service: str, timeout_s: float) -> bool:
        """Wait until one service, which not every stack has, is ready; False if not in time."""
        with self._changed:
            return self._changed.wait_for(lambda: f"ready/{service}" in self.tokens(), timeout_s)

    def close(self) -> None:
        """Close the bus if it was opened."""
        if self._bus is not None:
            self._bus.close()
            self._bus = None

    def __enter__(self) -> "Link":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _on_token(self, token: str, present: bool) -> None:
        change: Callable[[str], None] = self._tokens.add if present else self._tokens.discard
        with self._changed:
            change(token)
            self._changed.notify_all()
