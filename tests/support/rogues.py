"""Participants that should not be let in, or not be heard: for the suite against `--secure`."""

import json
from collections.abc import Generator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import zenoh

from fras_cli.keys import Pair, certified, init_keys
from fras_common.bus.settings import client_settings
from fras_common.bus.zenoh_bus import ZenohBus
from fras_common.identity import Identity, identity_in

OPEN_S = 0.5


class Rogues:
    """Attackers of one stack.

    Parameters
    ----------
    cell, connect : str
        The stack's.
    keys : Path
        Its folder of keys.
    folder : Path
        Where their own are made.
    """

    def __init__(self, cell: str, connect: str, keys: Path, folder: Path) -> None:
        self._cell, self._connect = cell, connect
        self._keys, self._folder = keys, folder

    @contextmanager
    def named(self, name: str, source: str = "") -> Generator[ZenohBus]:
        """Take part with the stack's own certificate of a service: one that was stolen."""
        identity = identity_in(self._keys, name)
        source = source or f"{name}/rogue"
        bus = ZenohBus(self._cell, self._connect, source, identity=identity)
        try:
            yield bus
        finally:
            bus.close()

    def open_with(self, identity: Identity | None, connect: str = "") -> None:
        """Open a session, past what our own bus would refuse; it must fail."""
        settings = client_settings(self._cell, connect or self._connect, OPEN_S, identity)
        self._open(settings)

    def without_certificate(self) -> None:
        """Know the CA's certificate, which is no secret, and show none."""
        authority = str(self._keys / "ca.pem")
        settings = client_settings(self._cell, self._connect, OPEN_S, None)
        self._open({**settings, "transport/link/tls/root_ca_certificate": authority})

    def expired(self) -> Identity:
        """Give a certificate of the stack's own CA that was valid until yesterday."""
        authority = Pair((self._keys / "ca.pem").read_bytes(), (self._keys / "ca.key").read_bytes())
        then = datetime.now(UTC) - timedelta(days=3)
        return self._write("expired", certified(authority, "planner", then, timedelta(days=2)))

    def of_another_authority(self) -> Identity:
        """Give a certificate by the right name of a CA of one's own."""
        folder = self._folder / "other"
        init_keys(folder, datetime.now(UTC))
        return Identity(self._keys / "ca.pem", folder / "planner.pem", folder / "planner.key")

    def routers(self) -> Identity:
        """Give the router's own certificate, which is no client's."""
        return identity_in(self._keys, "router")

    def plain(self) -> str:
        """Give the same endpoint without TLS."""
        return self._connect.replace("tls/", "tcp/")

    def _write(self, name: str, pair: Pair) -> Identity:
        certificate, key = self._folder / f"{name}.pem", self._folder / f"{name}.key"
        certificate.write_bytes(pair.certificate)
        key.write_bytes(pair.key)
        return Identity(self._keys / "ca.pem", certificate, key)

    def _open(self, settings: Any) -> None:
        config = zenoh.Config()
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
        # It is let in or an error says why; nobody waits for longer than the settings allow.
        zenoh.open(config).close()
