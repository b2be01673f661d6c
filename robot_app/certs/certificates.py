"""A robot's own certificate authority, and a certificate for each machine: robot, workstation, viewer."""

from __future__ import annotations

import ipaddress
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

HOST = re.compile(r"(?=.{1,253}\Z)(?!-)[a-z0-9-]{1,63}(?<!-)(\.(?!-)[a-z0-9-]{1,63}(?<!-))*", re.IGNORECASE | re.ASCII)
BACKDATED = timedelta(hours=1)  # a robot without a network may boot with a clock that is a little behind


@dataclass(frozen=True)
class Identity:
    """A certificate with its key. name: the common name, which access rules go by."""

    name: str
    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    def write(self, folder: Path, stem: str | None = None) -> None:
        """STEM.pem and STEM.key (0600); FileExistsError rather than overwrite."""
        stem = stem or self.name
        write_new(folder / f"{stem}.pem", self.pem, 0o644)
        plain = serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        write_new(folder / f"{stem}.key", self.key.private_bytes(*plain), 0o600)

    @property
    def pem(self) -> bytes:
        return self.certificate.public_bytes(serialization.Encoding.PEM)


def make_authority(name: str, now_ns: int, days: int) -> Identity:
    """A root that signs leaves and no further authorities."""
    key = ec.generate_private_key(ec.SECP256R1())
    builder = (
        _builder(_named(name), _named(name), key, now_ns, days)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
    )
    return Identity(name, builder.sign(key, hashes.SHA256()), key)


def issue(authority: Identity, name: str, hosts: Sequence[str], now_ns: int, days: int, *, server: bool) -> Identity:
    """A leaf. hosts: addresses or DNS names it is reached at. server: it may be connected to, not only connect."""
    key = ec.generate_private_key(ec.SECP256R1())
    purposes = [ExtendedKeyUsageOID.CLIENT_AUTH, *([ExtendedKeyUsageOID.SERVER_AUTH] if server else [])]
    builder = (
        _builder(_named(name), authority.certificate.subject, key, now_ns, days)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(purposes), critical=False)
        .add_extension(x509.SubjectAlternativeName([_reached_at(host) for host in (name, *hosts)]), critical=False)
    )
    return Identity(name, builder.sign(authority.key, hashes.SHA256()), key)


def require_host(text: str) -> str:
    """The text where it is an address or a DNS name; raises ValueError. Others would make a certificate for nobody."""
    try:
        ipaddress.ip_address(text)
    except ValueError:
        if not HOST.fullmatch(text):
            raise ValueError(
                f"a host is an address or a name like g1.local (letters, digits, -), got {text!r}"
            ) from None
    return text


def write_new(path: Path, content: bytes, mode: int) -> None:
    """Create a file with its permissions from the first byte on; FileExistsError where there is one."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
        os.fchmod(file.fileno(), mode)
        file.write(content)


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, now_ns: int, days: int
) -> x509.CertificateBuilder:
    now = datetime.fromtimestamp(now_ns // 10**9, UTC)
    return x509.CertificateBuilder(
        issuer_name=issuer,
        subject_name=subject,
        public_key=key.public_key(),
        serial_number=x509.random_serial_number(),
        not_valid_before=now - BACKDATED,
        not_valid_after=now + timedelta(days=days),
    )


def _named(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _reached_at(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )
