"""A network's folder: the authority, and for each machine what it needs and no more."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from robot_app.certs.certificates import Identity, issue, make_authority, write_new
from robot_app.certs.zenoh import AGENT, CONSOLE, LOOPBACK, OPERATOR, ROBOT, VIEWER, VIEWERS, WORKSTATION, ZenohNetwork

CLIENTS = (WORKSTATION, VIEWER, OPERATOR, AGENT)
REMOTE = '\n[remote]\nserve = "robot"\n'
NOTE = "// Made by openbelief certs. docs/security.md says what each part is for.\n"


def make_network(
    folder: Path, network: ZenohNetwork, names: Sequence[str], now_ns: int, days: int, console: Sequence[str] = ()
) -> list[Path]:
    """Everything of a new network, or nothing; FileExistsError where the folder is there. Returns the files.

    console: addresses and names at which browsers reach the operator's page; none: no certificate for it.
    """
    if os.path.lexists(folder):
        raise FileExistsError(f"{folder} exists")
    folder.parent.mkdir(parents=True, exist_ok=True)
    unfinished = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))  # 0700
    try:
        _write_network(unfinished, network, names, now_ns, days, console)
        unfinished.rename(folder)
    except BaseException:
        shutil.rmtree(unfinished)
        raise
    return sorted(path for path in folder.rglob("*") if path.is_file())


def _write_network(
    folder: Path, network: ZenohNetwork, names: Sequence[str], now_ns: int, days: int, console: Sequence[str]
) -> None:
    """Two authorities: a viewer's certificate is worth nothing at the operator's door."""
    authority = make_authority(f"openbelief robot {network.robot}", now_ns, days)
    viewers = make_authority(f"openbelief viewers of {network.robot}", now_ns, days)
    authority.write(folder, "ca")
    viewers.write(folder, "viewers-ca")
    hosts = list(dict.fromkeys([network.robot, LOOPBACK, "localhost", *names]))
    for name, reached_at, server in ((ROBOT, hosts, True), *((name, [], False) for name in CLIENTS)):
        issuer = viewers if name == VIEWER else authority
        _write_machine(folder / name, issuer, issue(issuer, name, reached_at, now_ns, days, server=server))
    issue(viewers, VIEWERS, hosts, now_ns, days, server=True).write(folder / ROBOT)
    write_new(folder / ROBOT / "viewers-ca.pem", viewers.pem, 0o644)
    if console:
        reached_at = [*dict.fromkeys([*console, LOOPBACK, "localhost"])]
        _write_machine(folder / CONSOLE, authority, issue(authority, CONSOLE, reached_at, now_ns, days, server=True))
        _write(folder / CONSOLE / "robot.toml", _console_section(console))
    configs = {"router.json5": network.router(), "bridge.json5": network.bridge(), "viewers.json5": network.viewers()}
    for name, config in configs.items():
        _write(folder / ROBOT / name, NOTE + json.dumps(config, indent=2) + "\n")
    _write(folder / ROBOT / "robot.toml", _section(network.local_endpoint, network.namespace, None))
    for name in CLIENTS:
        _write(
            folder / name / "robot.toml",
            _section(network.viewers_endpoint if name == VIEWER else network.endpoint, network.namespace, name)
            + (REMOTE if name in (OPERATOR, AGENT) else ""),
        )


def _write_machine(folder: Path, authority: Identity, identity: Identity) -> None:
    folder.mkdir(mode=0o700)
    identity.write(folder)
    write_new(folder / "ca.pem", authority.pem, 0o644)


def _section(endpoint: str, namespace: str, name: str | None) -> str:
    """robot.toml's [zenoh], to be kept beside the certificates; without a name there is no certificate to show."""
    values: dict[str, Any] = {"endpoint": endpoint, "namespace": namespace}
    if name is not None:
        values |= {"ca": "ca.pem", "certificate": f"{name}.pem", "key": f"{name}.key"}
    bodies = "".join(f'{port} = "ros"\n' for port in ("camera", "lidar", "pose", "map", "navigator"))
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in values.items())
    return f"[ports]\n{bodies}\n[zenoh]\n{lines}"


def _console_section(hosts: Sequence[str]) -> str:
    """robot.toml's [console], to be kept beside the certificate."""
    values = {"accounts": "accounts.json", "certificate": f"{CONSOLE}.pem", "key": f"{CONSOLE}.key"}
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in values.items())
    return f"[console]\n{lines}hosts = {json.dumps(list(hosts))}\n"


def _write(path: Path, text: str) -> None:
    write_new(path, text.encode(), 0o644)
