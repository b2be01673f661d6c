"""Mutual TLS through the link's own configuration: who has no certificate of the authority is not let in."""

from __future__ import annotations

import datetime
import ipaddress
import socket

import pytest
import zenoh
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from drivers.ports import LinkLost
from drivers.ros.zenoh_link import LinkConfig, ZenohLink


class Authority:
    """A certificate authority that writes PEM files below `folder`."""

    def __init__(self, folder, name):
        self.folder, self.name = folder, name
        self._key = ec.generate_private_key(ec.SECP256R1())
        self._certificate = self._sign(name, self._key, authority=True)
        self.root = self._write(f"{name}.pem", self._certificate.public_bytes(serialization.Encoding.PEM))

    def issue(self, name):
        """(certificate file, key file)"""
        key = ec.generate_private_key(ec.SECP256R1())
        plain = serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        certificate = self._sign(name, key).public_bytes(serialization.Encoding.PEM)
        secret = key.private_bytes(serialization.Encoding.PEM, *plain)
        stem = f"{self.name}-{name}"
        return self._write(f"{stem}.pem", certificate), self._write(f"{stem}.key", secret)

    def _sign(self, name, key, authority=False):
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        issuer = subject if authority else self._certificate.subject
        now, day = datetime.datetime.now(datetime.UTC), datetime.timedelta(days=1)
        builder = (
            x509.CertificateBuilder(
                issuer, subject, key.public_key(), x509.random_serial_number(), now - day, now + day
            )
            .add_extension(x509.BasicConstraints(authority, None), critical=True)
            .add_extension(
                x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]), critical=False
            )
        )
        return builder.sign(self._key, hashes.SHA256())

    def _write(self, name, content):
        path = self.folder / name
        path.write_bytes(content)
        return str(path)


@pytest.fixture
def authority(tmp_path):
    return Authority(tmp_path, "network")


@pytest.fixture
def endpoint(authority):
    """A bridge that asks every client for a certificate of the authority."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tls/127.0.0.1:{probe.getsockname()[1]}"
    certificate, key = authority.issue("robot")
    tls = {
        "root_ca_certificate": authority.root,
        "listen_certificate": certificate,
        "listen_private_key": key,
        "enable_mtls": True,
    }
    with zenoh.open(LinkConfig((endpoint,), tls=tls).zenoh("router")):
        yield endpoint


def client(authority, trusted):
    certificate, key = authority.issue("workstation")
    return {
        "root_ca_certificate": trusted.root,
        "connect_certificate": certificate,
        "connect_private_key": key,
        "enable_mtls": True,
        "verify_name_on_connect": True,
    }


def test_a_certificate_of_the_network_is_let_in(endpoint, authority):
    with ZenohLink(LinkConfig((endpoint,), tls=client(authority, authority))) as link:
        assert link.alive


def test_a_certificate_of_another_authority_is_refused(endpoint, authority, tmp_path):
    stranger = Authority(tmp_path, "stranger")
    with pytest.raises(LinkLost), ZenohLink(LinkConfig((endpoint,), tls=client(stranger, authority))):
        pass


def test_no_certificate_is_refused(endpoint, authority):
    with pytest.raises(LinkLost), ZenohLink(LinkConfig((endpoint,), tls={"root_ca_certificate": authority.root})):
        pass
