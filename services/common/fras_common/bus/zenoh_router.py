"""A full Zenoh router in this process."""

# The wheel's stubs leave some types open.
# pyright: reportUnknownMemberType=false

from collections.abc import Callable, Mapping, Sequence

import zenoh

from fras_common.bus.settings import NoRouter, router_settings
from fras_common.bus.zenoh_wire import configured
from fras_common.identity import Identity, require_tls

__all__ = ["route"]


def route(
    listen: Sequence[str],
    until: Callable[[], None],
    identity: Identity | None = None,
    access: Mapping[str, object] | None = None,
    connect: Sequence[str] = (),
) -> None:
    """Be a full Zenoh router on all of `listen` for as long as `until` blocks.

    The link to each router in `connect` is made as soon as that router is there, and again
    whenever it was lost. See `router_settings`.

    Raises
    ------
    NoRouter
        If the address can't be bound.
    BadIdentity
        If the endpoint is `tls/` without an identity, or another one with it.
    """
    for endpoint in listen:
        require_tls(endpoint, identity)
    if identity is not None:
        # Who is not let in is told of on standard error, and so in the router's log.
        zenoh.init_log_from_env_or("warn")
    try:
        session = zenoh.open(configured(router_settings(listen, identity, access, connect)))
    except zenoh.ZError as error:
        asked = ", ".join(listen)
        raise NoRouter(f"can't listen on {asked}: {error}", connect=asked) from error
    try:
        until()
    finally:
        session.close()
