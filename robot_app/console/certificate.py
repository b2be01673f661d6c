"""Whether the console's certificate can be served: it can be read, fits its key, is valid now, and names our host."""

from __future__ import annotations

import ipaddress
import ssl
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure

if TYPE_CHECKING:
    from cryptography.x509 import Certificate

MAKE = "openbelief certs --console HOST makes another one"


def require_certificate(certificate: Path, key: Path, hosts: Iterable[str]) -> None:
    """Raises Failure, with what to do, where it cannot be served, or no browser could reach one of these hosts by it.

    hosts: () where it need not name any, as at this machine alone.
    """
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key, password="")
    except FileNotFoundError as error:
        missing = next(path for path in (certificate, key) if not path.is_file())
        raise Failure(f"There is no {missing}, which [console] in robot.toml names; {MAKE}") from error
    except (OSError, ValueError) as error:
        why = getattr(error, "reason", None) or getattr(error, "strerror", None) or error
        raise Failure(
            f"{certificate} and {key} cannot be used as the console's certificate and its key ({why}): they belong"
            f" together, as PEM; {MAKE}"
        ) from error
    _require_fit(certificate, tuple(hosts))


def _require_fit(path: Path, hosts: tuple[str, ...]) -> None:
    from cryptography import x509

    found, now = x509.load_pem_x509_certificate(path.read_bytes()), datetime.now(UTC)
    if not found.not_valid_before_utc <= now <= found.not_valid_after_utc:
        since, until = (f"{day:%Y-%m-%d}" for day in (found.not_valid_before_utc, found.not_valid_after_utc))
        raise Failure(f"{path} is valid from {since} to {until}, and it is {now:%Y-%m-%d} here; {MAKE}")
    names = _names(found)
    if hosts and not any(_named(host, names) for host in hosts):
        whose = ", ".join(sorted(names)) or "nobody"
        raise Failure(f"{path} is for {whose}, not for {hosts[0]}: browsers would refuse it; {MAKE}")


def _names(certificate: Certificate) -> set[str]:
    """The addresses and DNS names that browsers may reach it by."""
    from cryptography import x509

    try:
        named = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return set()
    addresses = {str(address) for address in named.get_values_for_type(x509.IPAddress)}
    return addresses | {name.lower() for name in named.get_values_for_type(x509.DNSName)}


def _named(host: str, names: set[str]) -> bool:
    try:
        return str(ipaddress.ip_address(host.strip("[]"))) in names
    except ValueError:
        return host.lower() in names or f"*.{host.lower().partition('.')[2]}" in names
