"""What `fras keys` does: make certificates, renew, revoke, and hand on what a host needs."""

import re
import shutil
from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path

from fras_cli.keys.authority import HOSTS, Pair, certified, is_router, make_authority
from fras_cli.keys.folder import (
    NAMES,
    BadKeys,
    KeysExist,
    authority_of,
    certificate_path,
    check_keys,
    hosts_of_router,
    key_path,
    names_in,
    put_names,
    put_pairs,
    unwritable,
)
from fras_common.access import LINK, PARTICIPANTS
from fras_common.identity import AUTHORITY, CERTIFICATE, KEY, NAMES_FILE, certificate_names

__all__ = ["DAYS", "export_keys", "init_keys", "issue_keys", "revoke_keys", "rotate_keys"]

DAYS, AUTHORITY_DAYS = 365, 3650
OLD = "old"


def init_keys(
    folder: Path, now: datetime, days: int = DAYS, hosts: Sequence[str] = HOSTS
) -> list[str]:
    """Make a CA and a certificate for each service; returns their names.

    Raises
    ------
    KeysExist
        There is a CA already.
    BadKeys
        The folder can't be written, or others may look into it.
    """
    if (path := certificate_path(folder, AUTHORITY)).exists():
        raise KeysExist(
            f"{path} is there already: `fras keys issue NAME` adds one, `fras keys rotate` makes "
            "new ones, --dir names another folder",
            path=path,
        )
    authority = make_authority(now, timedelta(days=AUTHORITY_DAYS))
    named = dict.fromkeys(NAMES, hosts)
    made = _certified(authority, named, now, days, {}, folder)
    put_pairs(folder, {AUTHORITY: authority, **made})
    put_names(folder, {})
    return [*NAMES]


def issue_keys(
    folder: Path,
    names: Sequence[str],
    now: datetime,
    days: int = DAYS,
    hosts: Sequence[str] = HOSTS,
) -> None:
    """Certify some more names by the folder's CA.

    Raises
    ------
    KeysExist
        One of them is there.
    BadKeys
        A name is none of those that access control knows; the CA can't be used.
    """
    for name in names:
        if name not in NAMES and not re.fullmatch(LINK + r"[a-z0-9][a-z0-9_-]{0,39}", name):
            raise BadKeys(
                f"{name!r} has no rights on the bus: one of {', '.join(NAMES)}, or {LINK}NAME"
            )
        if (path := certificate_path(folder, name)).exists():
            raise KeysExist(f"{path} is there already: `fras keys rotate` replaces it", path=path)
    named = dict.fromkeys(names, hosts)
    said = certificate_names(folder)
    put_pairs(folder, _certified(authority_of(folder), named, now, days, said, folder))


def rotate_keys(
    folder: Path,
    now: datetime,
    days: int = DAYS,
    hosts: Sequence[str] = HOSTS,
    names: Sequence[str] = (),
    *,
    new_authority: bool = False,
) -> Path:
    """Make certificates of the folder anew, the old ones kept beside; returns where.

    Parameters
    ----------
    hosts : sequence of str
        By which routers may be reached, besides those that their certificates name now.
    names : sequence of str
        Whose; all by default.
    new_authority : bool
        Make the CA anew, too: nothing that it certified is let in any more.

    Raises
    ------
    BadKeys
        There is no CA, or it can't be used; a name has no certificate here.
    """
    old = authority_of(folder)
    if new_authority and names:
        raise BadKeys("a new CA signs all certificates anew: leave out the names, or --new-ca")
    there = names_in(folder)
    for name in names:
        _require_here(folder, name, there)
    authority = make_authority(now, timedelta(days=AUTHORITY_DAYS)) if new_authority else old
    named = {name: _hosts(folder, name, hosts) for name in names or there}
    # Nobody has to be told apart from what another CA has signed.
    said = {} if new_authority else certificate_names(folder)
    made = _certified(authority, named, now, days, said, folder)
    kept = _keep(folder, now)
    put_pairs(folder, {AUTHORITY: authority, **made} if new_authority else made)
    put_names(folder, said)
    return kept


def revoke_keys(folder: Path, names: Sequence[str], now: datetime, days: int = DAYS) -> Path:
    """Make certificates that say another name, the only one that counts; returns where the old are.

    What has been certified before under these names is let in and may do nothing, once each router
    has read the new names: at its start.

    Raises
    ------
    BadKeys
        A name is that of the CA or of a router, which this can't help; the CA can't be used.
    """
    for name in names:
        if name == AUTHORITY or is_router(name):
            raise BadKeys(
                f"{name} can't be revoked alone: who has its key can play the router to every "
                "service. `fras keys rotate --new-ca`, and start all again"
            )
        if name not in PARTICIPANTS:
            raise BadKeys(f"{name!r} has no certificate: one of {', '.join(PARTICIPANTS)}")
    authority, said = authority_of(folder), certificate_names(folder)
    said = {**said, **{name: _next(name, said) for name in names}}
    made = _certified(authority, dict.fromkeys(names, HOSTS), now, days, said, folder)
    kept = _keep(folder, now)
    put_names(folder, said)
    put_pairs(folder, made)
    return kept


def export_keys(folder: Path, names: Sequence[str], out: Path, now: datetime) -> list[str]:
    """Copy what another host needs: the CA's certificate, and these with their keys.

    Raises
    ------
    KeysExist
        There is something at `out`.
    BadKeys
        One of them can't be used.
    """
    if out.exists() and any(out.iterdir() if out.is_dir() else [out]):
        raise KeysExist(f"{out} is there already: remove it, or --out another folder", path=out)
    check_keys(folder, names, now)
    pairs = {
        name: Pair(certificate_path(folder, name).read_bytes(), key_path(folder, name).read_bytes())
        for name in names
    }
    authority = Pair(certificate_path(folder, AUTHORITY).read_bytes(), key=b"")
    put_pairs(out, {AUTHORITY: authority, **pairs})
    put_names(out, certificate_names(folder))
    return [*pairs]


def _require_here(folder: Path, name: str, there: Sequence[str]) -> None:
    if name not in there:
        path = certificate_path(folder, name)
        raise BadKeys(f"{path}: no such certificate; there are {', '.join(there)}", path=path)


def _next(name: str, said: Mapping[str, str]) -> str:
    number = int(said[name].rpartition(".")[2]) if name in said else 1
    return f"{name}.{number + 1}"


def _hosts(folder: Path, name: str, more: Sequence[str]) -> Sequence[str]:
    if not is_router(name):
        return HOSTS
    known = hosts_of_router(folder, name) if certificate_path(folder, name).exists() else []
    return [*dict.fromkeys((*known, *more))]


def _certified(
    authority: Pair,
    named: Mapping[str, Sequence[str]],
    now: datetime,
    days: int,
    said: Mapping[str, str],
    folder: Path,
) -> dict[str, Pair]:
    """Certify names, each with the hosts of routers and with what the certificate is to say."""
    validity = timedelta(days=days)
    try:
        return {
            name: certified(authority, said.get(name, name), now, validity, hosts)
            for name, hosts in named.items()
        }
    except (ValueError, TypeError) as error:
        path = certificate_path(folder, AUTHORITY)
        raise BadKeys(f"{path}: {error}: `fras keys rotate --new-ca`", path=folder) from error


def _keep(folder: Path, now: datetime) -> Path:
    """Copy all that is there to a folder beside."""
    kept = folder / OLD / now.strftime("%Y%m%dT%H%M%S.%fZ")
    try:
        kept.mkdir(parents=True, mode=0o700)
        for path in sorted(folder.iterdir()):
            if path.suffix in (CERTIFICATE, KEY) or path.name == NAMES_FILE:
                shutil.copy2(path, kept)
    except OSError as error:
        raise unwritable(kept, error) from error
    return kept
