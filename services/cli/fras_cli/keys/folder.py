"""The folder of `fras keys`: `<name>.pem` and `<name>.key` of the CA, the router, each service."""

import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import msgspec
from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.serialization import load_pem_private_key
from cryptography.x509.oid import NameOID

from fras_cli.keys.authority import ROUTER, Pair, hosts_named
from fras_common.access import LINK, PARTICIPANTS
from fras_common.errors import FrasError
from fras_common.files import is_private
from fras_common.identity import (
    AUTHORITY,
    CERTIFICATE,
    KEY,
    NAMES_FILE,
    certificate_names,
    identity_in,
    require_private,
    require_readable,
)

__all__ = [
    "NAMES",
    "BadKeys",
    "KeysExist",
    "Standing",
    "authority_of",
    "certificate_path",
    "check_hosts_named",
    "check_keys",
    "hosts_of_router",
    "key_path",
    "look_at_keys",
    "names_in",
    "put_names",
    "put_pairs",
    "unwritable",
]

NAMES = (ROUTER, *PARTICIPANTS)


class BadKeys(FrasError):
    """Keys that can't be used or made. Attributes: ``path``."""


class KeysExist(FrasError):
    """Keys that would be written over. Attributes: ``path``."""


@dataclass(frozen=True)
class Standing:
    """One certificate of the folder.

    Attributes
    ----------
    until : datetime or None
        When it expires, if it can be read.
    problem : str
        Why it can't be used; empty if it can.
    """

    name: str
    until: datetime | None
    problem: str


def names_in(folder: Path) -> list[str]:
    """List the names of which there is a certificate or a key, those of linked routers last."""
    links = {
        path.stem
        for path in folder.glob(f"{LINK}*")
        if path.suffix in (CERTIFICATE, KEY) and path.is_file()
    }
    return [
        name
        for name in (*NAMES, *sorted(links))
        if certificate_path(folder, name).exists() or key_path(folder, name).exists()
    ]


def look_at_keys(folder: Path, now: datetime) -> list[Standing]:
    """Tell how each certificate of the folder stands."""
    authority = certificate_path(folder, AUTHORITY).exists() or key_path(folder, AUTHORITY).exists()
    names = [*([AUTHORITY] if authority else []), *names_in(folder)]
    return [_standing(folder, name, now) for name in names]


def check_keys(folder: Path, names: Sequence[str], now: datetime) -> None:
    """Refuse a folder in which one of the names has nothing to show.

    Raises
    ------
    BadKeys
    """
    for name in (AUTHORITY, *names):
        standing = _standing(folder, name, now)
        if standing.problem:
            raise BadKeys(f"{certificate_path(folder, name)}: {standing.problem}")


def hosts_of_router(folder: Path, name: str) -> list[str]:
    """List the hosts by which a router's certificate says that it may be reached.

    Raises
    ------
    BadKeys
    """
    return hosts_named(_read(folder, name))


def check_hosts_named(folder: Path, name: str, hosts: Sequence[str]) -> None:
    """Refuse a router's certificate that others would not take at one of these addresses.

    Raises
    ------
    BadKeys
    """
    known = hosts_of_router(folder, name)
    for host in hosts:
        if host not in known:
            path = certificate_path(folder, name)
            raise BadKeys(
                f"{path}: it is good for {', '.join(known)}, not for {host}: "
                f"`fras keys rotate {name} --host {host}`",
                path=path,
            )


def _standing(folder: Path, name: str, now: datetime) -> Standing:
    try:
        certificate = _read(folder, name)
        if name != AUTHORITY:
            said = certificate_names(folder).get(name, name)
            identity = identity_in(folder, name)
            certificate.verify_directly_issued_by(_read(folder, AUTHORITY))
            key = load_pem_private_key(identity.key.read_bytes(), password=None)
            if key.public_key() != certificate.public_key():
                return Standing(name, None, "its key is another one's: `fras keys rotate`")
            if (says := _common_name(certificate)) != said:
                problem = f"it says {says!r}, and {said!r} counts: `fras keys rotate {name}`"
                return Standing(name, None, problem)
    except FrasError as error:
        return Standing(name, None, str(error))
    except (ValueError, TypeError, InvalidSignature):
        return Standing(name, None, "not of this folder's CA, or its key is none")
    until = certificate.not_valid_after_utc
    problem = ""
    if until <= now:
        problem = f"expired at {until:%Y-%m-%d %H:%M} UTC: `fras keys rotate`"
    elif certificate.not_valid_before_utc > now:
        problem = f"valid from {certificate.not_valid_before_utc:%Y-%m-%d %H:%M} UTC only"
    return Standing(name, until, problem)


def _common_name(certificate: x509.Certificate) -> str:
    return ", ".join(
        str(one.value) for one in certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    )


def _read(folder: Path, name: str) -> x509.Certificate:
    path = certificate_path(folder, name)
    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except FileNotFoundError as error:
        raise BadKeys(
            f"{path}: no such file: where ca.key is `fras keys init` makes all, `fras keys issue "
            f"{name}` one, and `fras keys export` what another host needs",
            path=path,
        ) from error
    except (OSError, ValueError) as error:
        raise BadKeys(f"{path}: no certificate to be read: {error}", path=path) from error


def authority_of(folder: Path) -> Pair:
    """Read the CA and its key.

    Raises
    ------
    BadIdentity
        One of them can't be read, or others may use the key.
    """
    certificate, key = certificate_path(folder, AUTHORITY), key_path(folder, AUTHORITY)
    require_readable(certificate)
    require_readable(key)
    require_private(key)
    return Pair(certificate.read_bytes(), key.read_bytes())


def put_pairs(folder: Path, made: Mapping[str, Pair]) -> None:
    """Write, each file whole or not at all, its owner's alone.

    Raises
    ------
    BadKeys
        The folder can't be written, or others may look into it.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        if not is_private(folder):
            raise BadKeys(f"{folder}: others may look into it: `chmod 700 {folder}`", path=folder)
        for name, pair in made.items():
            if pair.key:
                _put(key_path(folder, name), pair.key)
            _put(certificate_path(folder, name), pair.certificate)
    except OSError as error:
        raise unwritable(folder, error) from error


def put_names(folder: Path, names: Mapping[str, str]) -> None:
    """Write which names of certificates count.

    Raises
    ------
    BadKeys
    """
    try:
        _put(folder / NAMES_FILE, msgspec.json.encode(dict(names)) + b"\n")
    except OSError as error:
        raise unwritable(folder, error) from error


def _put(path: Path, content: bytes) -> None:
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    with os.fdopen(descriptor, "wb") as file:
        file.write(content)
    Path(temporary).replace(path)


def unwritable(folder: Path, error: OSError) -> BadKeys:
    """Say that keys can't be written there."""
    return BadKeys(f"{folder}: keys can't be written: {error.strerror}", path=folder)


def certificate_path(folder: Path, name: str) -> Path:
    """Return where a certificate is."""
    return folder / f"{name}{CERTIFICATE}"


def key_path(folder: Path, name: str) -> Path:
    """Return where a private key is."""
    return folder / f"{name}{KEY}"
