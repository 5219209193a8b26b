"""Keys that sign logs: Ed25519, one a machine, made where there is none.

`python -m fras_log.keys` makes this machine's key and prints its fingerprint.
"""

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    PublicFormat,
    load_pem_private_key,
    load_pem_public_key,
)

from fras_common.errors import FrasError
from fras_common.files import data_folder, is_private

PUBLIC_SUFFIX = ".pub"
WHICH_PUBLIC = "give the log.pub of the machine that recorded"


class BadKey(FrasError):
    """A file that should hold a key and does not. Attributes: ``path``."""


@dataclass(frozen=True)
class PublicKey:
    """One that a log may be signed with.

    Parameters
    ----------
    raw : bytes
        Its 32 bytes.
    """

    raw: bytes

    @property
    def fingerprint(self) -> str:
        """Its name for people: the first 16 hexadecimal digits of its SHA-256."""
        return hashlib.sha256(self.raw).hexdigest()[:16]

    def has_signed(self, signature: bytes, text: bytes) -> bool:
        """Whether a signature is this key's."""
        try:
            Ed25519PublicKey.from_public_bytes(self.raw).verify(signature, text)
        except (InvalidSignature, ValueError):
            return False
        return True


class Signer:
    """A private key.

    Parameters
    ----------
    key : Ed25519PrivateKey
    """

    def __init__(self, key: Ed25519PrivateKey) -> None:
        self._key = key
        self.public = PublicKey(key.public_key().public_bytes(Encoding.Raw, PublicFormat.Raw))

    def sign(self, text: bytes) -> bytes:
        """Sign; 64 bytes."""
        return self._key.sign(text)


def default_key_path() -> Path:
    """Where this machine's key is: `$XDG_DATA_HOME/fras/log.key`, or below `~/.local/share`.

    Raises
    ------
    BadKey
        Neither is known, as for a user whom no system knows.
    """
    try:
        return data_folder() / "log.key"
    except RuntimeError as error:
        raise BadKey("there is no home directory for the key: set XDG_DATA_HOME") from error


def load_or_make(path: Path) -> Signer:
    """Read a private key, or make it, and its public half beside it, if there is no file.

    Raises
    ------
    BadKey
        The file is no key, is not its owner's alone, or can't be read or made.
    """
    try:
        if not path.exists():
            _make(path)
        # Whoever can read it can sign in its name.
        if not is_private(path):
            raise BadKey(f"{path}: others may use this key: `chmod 600 {path}`", path=path)
        key = load_pem_private_key(path.read_bytes(), password=None)
    except (OSError, ValueError, TypeError, UnsupportedAlgorithm) as error:
        raise BadKey(
            f"{path}: no key to sign logs with: {error}; where it is moved away, a new one is made",
            path=path,
        ) from error
    if not isinstance(key, Ed25519PrivateKey):
        raise BadKey(
            f"{path}: is no Ed25519 key; where it is moved away, a new one is made", path=path
        )
    _publish(key, path.with_suffix(PUBLIC_SUFFIX))
    return Signer(key)


def _make(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    key = Ed25519PrivateKey.generate()
    temporary = _write_beside(
        path, key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    )
    try:
        # Unlike a rename this fails if another process was quicker; then its key is the one.
        path.hardlink_to(temporary)
    except FileExistsError:
        return
    finally:
        temporary.unlink()


def _publish(key: Ed25519PrivateKey, path: Path) -> None:
    """Write the public half, if whoever made the key did not get to it yet."""
    if path.exists():
        return
    public = key.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)
    # A key where nothing can be written signs all the same; the next start tries again.
    with contextlib.suppress(OSError):
        temporary = _write_beside(path, public)
        temporary.chmod(0o644)
        temporary.replace(path)


def _write_beside(path: Path, content: bytes) -> Path:
    """Write a file of its owner's alone, for a move that shows it complete or not at all."""
    descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=path.stem)
    with os.fdopen(descriptor, "wb") as file:
        file.write(content)
    return Path(name)


def read_public(path: Path) -> PublicKey:
    """Read a public key.

    Raises
    ------
    BadKey
        The file is none.
    """
    try:
        key = load_pem_public_key(path.read_bytes())
    except (OSError, ValueError, UnsupportedAlgorithm) as error:
        raise BadKey(f"{path}: no public key: {error}; {WHICH_PUBLIC}", path=path) from error
    if not isinstance(key, Ed25519PublicKey):
        raise BadKey(f"{path}: is no Ed25519 key; {WHICH_PUBLIC}", path=path)
    return PublicKey(key.public_bytes(Encoding.Raw, PublicFormat.Raw))


def trusted_keys(paths: Iterable[Path]) -> list[PublicKey]:
    """Read the public keys given; without any, this machine's own if there is one.

    Raises
    ------
    BadKey
    """
    given = list(paths)
    if given:
        return [read_public(path) for path in given]
    own = default_key_path().with_suffix(PUBLIC_SUFFIX)
    return [read_public(own)] if own.exists() else []
