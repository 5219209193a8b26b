"""The certificates of an own stack: made if there are none, looked at before anything starts."""

from collections.abc import Callable, Collection, Sequence
from datetime import UTC, datetime
from pathlib import Path

from fras_common.identity import AUTHORITY, KEY
from fras_supervisor import Table, TableError


def require_keys(table: Table) -> None:
    """Refuse a table with a process that would show no certificate.

    Raises
    ------
    TableError
    """
    for name, process in table.processes.items():
        if "{keys}" not in process.command:
            raise TableError(
                table.source,
                f"process.{name}.command",
                list(process.command),
                '"--tls", "{keys}" in each command of a table for --secure',
            )


def ready_keys(
    keys: Path,
    shown: Sequence[str],
    addresses: Sequence[str],
    elsewhere: Collection[str],
    tell: Callable[[str], None] | None = None,
) -> None:
    """Make keys if there are none, and see that those there are can be used.

    Of several hosts the one whose router the others link to makes them: another one would make a CA
    of its own, which nobody knows.

    Parameters
    ----------
    keys : Path
        Folder of the certificates.
    shown : sequence of str
        Names of the certificates that are shown on this host.
    addresses : sequence of str
        By which other hosts reach this one's router.
    elsewhere : collection of str
        Processes of other hosts.
    tell : callable, optional
        Gets what was made, in words.

    Raises
    ------
    BadKeys
    """
    # Not at the top: a plain stack needs no cryptography.
    from fras_cli.keys import (
        check_hosts_named,
        check_keys,
        init_keys,
        is_router,
        issue_keys,
        look_at_keys,
    )
    from fras_cli.keys.authority import HOSTS

    def told(words: str) -> None:
        if tell is not None:
            tell(words)

    now = datetime.now(UTC)
    known = {one.name for one in look_at_keys(keys, now)}
    makes = bool(addresses) or not elsewhere
    if not known and makes:
        known = {AUTHORITY, *init_keys(keys, now)}
        told(f"made keys in {keys} (`fras keys`)")
    if makes and (keys / f"{AUTHORITY}{KEY}").exists():
        for name in (*shown, *elsewhere):
            if is_router(name) and name not in known:
                issue_keys(keys, [name], now, hosts=(*HOSTS, *(addresses if name in shown else ())))
                told(f"made a certificate of {name} in {keys}")
    check_keys(keys, shown, now)
    for name in shown:
        if is_router(name) and addresses:
            check_hosts_named(keys, name, addresses)
