"""Who a process is under the security profile: files of a certificate, its key, and the CA's.

They are made by `fras keys` and named after the service; a process needs three of them only.
"""

import os
import re
from dataclasses import dataclass
from pathlib import Path

import msgspec

from fras_common.errors import FrasError
from fras_common.files import data_folder, is_private, read_at_most

AUTHORITY = "ca"
CERTIFICATE, KEY = ".pem", ".key"
NAMES_FILE = "names.json"
"""What a certificate must say where one was revoked: `{"sim": "sim.2"}`; only routers read it."""
NAMES_BYTES = 65_536


class BadIdentity(FrasError):
    """A certificate or key that can't be used. Attributes: ``path``."""


@dataclass(frozen=True)
class Identity:
    """What a process shows to the router, and by what it knows the router.

    Attributes
    ----------
    authority : Path
        The CA's certificate.
    certificate, key : Path
        Its own; the certificate's name says which service it is.
    """

    authority: Path
    certificate: Path
    key: Path


def default_keys_dir() -> Path:
    """Where certificates are: `$FRAS_KEYS`, else `$XDG_DATA_HOME/fras/keys`, else below ~.

    Raises
    ------
    BadIdentity
        None of them is known, as for a user whom no system knows.
    """
    if given := os.environ.get("FRAS_KEYS"):
        return Path(given)
    try:
        return data_folder() / "keys"
    except RuntimeError as error:
        raise BadIdentity("there is no home directory for keys: set FRAS_KEYS") from error


def identity_in(folder: Path, name: str) -> Identity:
    """Find the identity of a service in a folder of `fras keys`.

    Raises
    ------
    BadIdentity
        A file is missing or can't be read, or others may use the key.
    """
    identity = Identity(
        folder / f"{AUTHORITY}{CERTIFICATE}",
        folder / f"{name}{CERTIFICATE}",
        folder / f"{name}{KEY}",
    )
    for path in (identity.authority, identity.certificate, identity.key):
        require_readable(path)
    require_private(identity.key)
    return identity


def certificate_names(folder: Path) -> dict[str, str]:
    """Read which names of certificates count, of those that no longer bear the plain one.

    Raises
    ------
    BadIdentity
        The file says something else: a certificate that was revoked might be let in.
    """
    path = folder / NAMES_FILE
    try:
        names = msgspec.json.decode(read_at_most(path, NAMES_BYTES), type=dict[str, str])
    except FileNotFoundError:
        return {}
    except (OSError, msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise BadIdentity(f"{path}: not the names of certificates: {error}", path=path) from error
    for name, said in names.items():
        if not re.fullmatch(re.escape(name) + r"\.[1-9][0-9]{0,8}", said):
            raise BadIdentity(f"{path}: {name!r} can't be called {said!r}", path=path)
    return names


def require_readable(path: Path) -> None:
    """Refuse a file that is not there or not to be read.

    Raises
    ------
    BadIdentity
    """
    try:
        path.open("rb").close()
    except OSError as error:
        raise BadIdentity(
            f"{path}: {error.strerror}: make keys with `fras keys init`, or copy them here",
            path=path,
        ) from error


def require_private(path: Path) -> None:
    """Refuse a key that others than its owner may use.

    Raises
    ------
    BadIdentity
    """
    if not is_private(path):
        raise BadIdentity(f"{path}: others may use this key: `chmod 600 {path}`", path=path)


def require_tls(endpoint: str, identity: Identity | None) -> None:
    """Refuse an identity that would not be shown, and an endpoint that would ask for one.

    Raises
    ------
    BadIdentity
    """
    if (identity is not None) != endpoint.startswith("tls/"):
        wanted = "certificates (--tls DIR)" if identity is None else "an endpoint tls/HOST:PORT"
        raise BadIdentity(f"{endpoint}: it takes {wanted}, too", path=None)
