"""What a Zenoh session is configured with, by Zenoh's own names; the error if none opens."""

from collections.abc import Mapping, Sequence
from typing import Self

from fras_common.codec import MAX_MESSAGE_BYTES
from fras_common.errors import FrasError
from fras_common.identity import Identity

Settings = Mapping[str, object]

# Zenoh's own queue of two batches and 1 ms of patience drop samples whenever its sender thread
# waits for a processor, and a sample dropped while an earlier loss is being recovered is never
# recovered (measured: 600 puts of 40 kB on a starved machine lost some in 5 of 10 runs; with these
# settings in none). A link that is congested already drops at once, so nobody waits for long.
TX_QUEUE: Settings = {
    "transport/link/tx/queue/size/real_time": 16,
    "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 20_000,
}

# A router asks often for one that it lost: by default up to 4 s would pass after a network is back.
RELINK: Settings = {"period_init_ms": 250, "period_max_ms": 1000, "period_increase_factor": 2}
# A router that was killed is back within a second; Zenoh's own second try comes after three.
RETRY: Settings = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 2}

_SHARED: Settings = {
    # What is put together from fragments before anyone can look at it: Zenoh's own limit is 1 GiB.
    "transport/link/rx/max_message_size": 2 * MAX_MESSAGE_BYTES,
    "scouting/multicast/enabled": False,
    "timestamping/enabled": True,
    # Its segments stay behind in /dev/shm; our messages are too small to gain from it.
    "transport/shared_memory/enabled": False,
    **TX_QUEUE,
}


class NoRouter(FrasError):
    """No Zenoh router answered at the address given, or none can be there."""

    @classmethod
    def within(
        cls, timeout_s: float, connect: str, identity: Identity | None, error: Exception
    ) -> Self:
        """Say that none let us in, and what to do."""
        refused = f", or it refuses {identity.certificate}: `fras keys show`" if identity else ""
        return cls(
            f"no Zenoh router at {connect} within {timeout_s} s{refused}: start one with "
            f"`fras up`, or name another with --connect ({error})",
            connect=connect,
        )


def client_settings(
    cell: str, connect: str, open_timeout_s: float, identity: Identity | None
) -> Settings:
    """Configure a participant."""
    return {
        **_SHARED,
        "mode": "client",
        "namespace": f"fras/{cell}",
        "connect/endpoints": [connect],
        "connect/timeout_ms": int(open_timeout_s * 1000),
        "connect/exit_on_failure": True,
        "connect/retry": RETRY,
        **(_client_tls(identity) if identity is not None else {}),
    }


def router_settings(
    listen: Sequence[str],
    identity: Identity | None,
    access: Mapping[str, object] | None,
    connect: Sequence[str] = (),
) -> Settings:
    """Configure a router.

    Parameters
    ----------
    listen : sequence of str
        Endpoints.
    identity : Identity or None
        Its own; without one it takes in whoever reaches it.
    access : mapping or None
        Zenoh's `access_control`, see `fras_common.access`.
    connect : sequence of str
        Endpoints of other routers.
    """
    return {
        **_SHARED,
        "mode": "router",
        "listen/endpoints": list(dict.fromkeys(listen)),
        "connect/endpoints": list(connect),
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        "connect/retry": RELINK,
        **(_router_tls(identity, links=bool(connect)) if identity is not None else {}),
        **({"access_control": access} if access is not None else {}),
    }


def _client_tls(identity: Identity) -> Settings:
    return {
        "transport/link/tls/root_ca_certificate": str(identity.authority),
        "transport/link/tls/connect_certificate": str(identity.certificate),
        "transport/link/tls/connect_private_key": str(identity.key),
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/verify_name_on_connect": True,
        "transport/link/tls/close_link_on_expiration": True,
    }


def _router_tls(identity: Identity, *, links: bool) -> Settings:
    return {
        # To another router it is a client, which shows a certificate and looks at the other's.
        **(_client_tls(identity) if links else {}),
        "transport/link/tls/root_ca_certificate": str(identity.authority),
        "transport/link/tls/listen_certificate": str(identity.certificate),
        "transport/link/tls/listen_private_key": str(identity.key),
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/close_link_on_expiration": True,
    }
