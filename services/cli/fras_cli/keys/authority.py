"""A certificate authority and what it certifies, as bytes: no file, no clock.

ECDSA on P-256. A service's certificate is good for a client only, so that none of them can play the
router; the router's names the hosts it may be reached by. A router that links to another one
(`router-b`) is that one's client, too.
"""

import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from fras_common.access import LINK

__all__ = ["HOSTS", "ROUTER", "Pair", "certified", "hosts_named", "is_router", "make_authority"]

ROUTER = "router"
HOSTS = ("localhost", "127.0.0.1", "::1")
_AUTHORITY_NAME = "FRAS certificate authority"
# Machines whose clocks differ a little must still take a certificate that was just made.
_SKEW = timedelta(minutes=5)


@dataclass(frozen=True)
class Pair:
    """A certificate and its private key, both PEM."""

    certificate: bytes
    key: bytes


def make_authority(now: datetime, validity: timedelta) -> Pair:
    """Make a CA; it signs certificates of processes and nothing else.

    Parameters
    ----------
    now : datetime
        With a time zone.
    validity : timedelta
        From now.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    name = _name(_AUTHORITY_NAME)
    usage = x509.KeyUsage(
        digital_signature=False,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=True,
        crl_sign=True,
        encipher_only=False,
        decipher_only=False,
    )
    certificate = (
        _blank(now, validity)
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, SHA256())
    )
    return _pair(certificate, key)


def is_router(name: str) -> bool:
    """Whether a certificate's name is that of a router."""
    return name == ROUTER or name.startswith(LINK)


def hosts_named(certificate: x509.Certificate) -> list[str]:
    """List the hosts by which a certificate says that its router may be reached."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    return [
        *names.get_values_for_type(x509.DNSName),
        *map(str, names.get_values_for_type(x509.IPAddress)),
    ]


def certified(
    authority: Pair, name: str, now: datetime, validity: timedelta, hosts: Sequence[str] = HOSTS
) -> Pair:
    """Make a key and certify it.

    Parameters
    ----------
    authority : Pair
    name : str
        What it says; access control goes by it.
    now : datetime
        With a time zone.
    validity : timedelta
        From now, at most until the CA's own end.
    hosts : sequence of str
        Names and addresses by which others reach the router; of no other's concern.

    Raises
    ------
    ValueError
        The authority is none, or has expired.
    """
    issuer = x509.load_pem_x509_certificate(authority.certificate)
    issuer_key = load_pem_private_key(authority.key, password=None)
    if not isinstance(issuer_key, ec.EllipticCurvePrivateKey):
        raise TypeError("the CA's key is no key on an elliptic curve")
    if issuer.not_valid_after_utc <= now:
        raise ValueError(f"the CA has expired, {issuer.not_valid_after_utc:%Y-%m-%d %H:%M} UTC")
    key = ec.generate_private_key(ec.SECP256R1())
    purposes = [ExtendedKeyUsageOID.SERVER_AUTH] if is_router(name) else []
    if name != ROUTER:
        purposes.append(ExtendedKeyUsageOID.CLIENT_AUTH)
    certificate = (
        _blank(now, min(validity, issuer.not_valid_after_utc - now))
        .subject_name(_name(name))
        .issuer_name(issuer.subject)
        .public_key(key.public_key())
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage(purposes), critical=True)
        .add_extension(
            x509.SubjectAlternativeName(
                [_alternative(host) for host in hosts] if is_router(name) else [x509.DNSName(name)]
            ),
            critical=False,
        )
        .sign(issuer_key, SHA256())
    )
    return _pair(certificate, key)


def _blank(now: datetime, validity: timedelta) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _SKEW)
        .not_valid_after(now + validity)
    )


def _name(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _alternative(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _pair(certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> Pair:
    return Pair(
        certificate.public_bytes(Encoding.PEM),
        key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()),
    )
