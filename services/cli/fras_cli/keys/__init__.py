"""`fras keys`: a CA, and a certificate for each service, by which it is known on the bus."""

from fras_cli.keys.authority import Pair, certified, is_router, make_authority
from fras_cli.keys.folder import (
    BadKeys,
    KeysExist,
    Standing,
    check_hosts_named,
    check_keys,
    look_at_keys,
)
from fras_cli.keys.making import export_keys, init_keys, issue_keys, revoke_keys, rotate_keys

__all__ = [
    "BadKeys",
    "KeysExist",
    "Pair",
    "Standing",
    "certified",
    "check_hosts_named",
    "check_keys",
    "export_keys",
    "init_keys",
    "is_router",
    "issue_keys",
    "look_at_keys",
    "make_authority",
    "revoke_keys",
    "rotate_keys",
]
