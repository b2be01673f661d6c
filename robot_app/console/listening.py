"""Where the console listens, and the port it binds."""

from __future__ import annotations

import ipaddress
import os
import socket
from dataclasses import dataclass

from robot_app.cli import Failure
from robot_app.config_sections import ConsoleSection
from robot_app.console.accounts import Accounts
from robot_app.console.certificate import require_certificate
from robot_app.console.doors import Address


@dataclass(frozen=True)
class Listening:
    """HOST:PORT as asked for on the command line. Loopback unless a host is named."""

    host: str
    port: int

    @property
    def loopback(self) -> bool:
        return self.host == "localhost" or ipaddress.ip_address(self.host).is_loopback

    @property
    def name(self) -> str:
        return f"[{self.host}]" if ":" in self.host else self.host


def listening_of(text: str) -> Listening:
    """[HOST:]PORT; an IPv6 address in brackets. Raises ValueError."""
    host, _, port = text.rpartition(":")
    host = host.removeprefix("[").removesuffix("]") or "127.0.0.1"
    try:
        address = ipaddress.ip_address(host if host != "localhost" else "127.0.0.1")
        if not 0 <= int(port) <= 65535:
            raise ValueError
    except ValueError:
        raise ValueError(f"[HOST:]PORT is needed, an address and a port like 192.168.1.5:8800, not {text!r}") from None
    if address.is_unspecified:
        why = f"{host} would be every network that this machine is in"
        raise ValueError(f"one address is needed, like 192.168.1.5:8800: {why}")
    return Listening(host, int(port))


def checked(listening: Listening, settings: ConsoleSection, accounts: Accounts) -> None:
    """Refuses to be reached from elsewhere without TLS and somebody who can log in; never serves what cannot be used.

    Raises Failure.
    """
    somebody = len(accounts) > 0  # also at this machine alone: a file that cannot be read is said now, not at a login
    if settings.certificate is not None and settings.key is not None:
        hosts = () if listening.loopback else (listening.host, *settings.hosts)
        require_certificate(settings.certificate, settings.key, hosts)
    if listening.loopback:
        return
    if settings.certificate is None:
        raise Failure(
            f"The console is not opened to {listening.host} without TLS: openbelief certs --console makes a"
            " certificate; name it with [console] certificate and key in robot.toml, or leave the host out"
        )
    if not somebody:
        raise Failure(
            f"The console is not opened to {listening.host} while nobody can log in: openbelief accounts add NAME"
        )


def require_free(listening: Listening) -> None:
    """Before long work: raises Failure where another program has the port."""
    bound_socket(listening).close()


def bound_socket(listening: Listening) -> socket.socket:
    family = socket.AF_INET6 if ":" in listening.host else socket.AF_INET
    try:
        return socket.create_server((listening.host, listening.port), family=family)
    except OSError as error:
        where = f"{listening.name}:{listening.port}"
        why = os.strerror(error.errno or 0)
        raise Failure(f"The console cannot listen at {where}: {why}; name another port.") from error


def address_of(listening: Listening, settings: ConsoleSection) -> Address:
    names = ["localhost", "127.0.0.1", "[::1]"] if listening.loopback else []
    hosts = dict.fromkeys([listening.name, *names, *settings.hosts])
    return Address(tuple(f"{host.lower()}:{listening.port}" for host in hosts), settings.certificate is not None)
