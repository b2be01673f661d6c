"""The folder of a site's keys: its owner's alone, never overwritten, and nothing is written where a name is none."""

from __future__ import annotations

import json
import stat
import time
from pathlib import Path

import pytest
from cryptography import x509

from robot_app.certs.folder import make_network
from robot_app.certs.zenoh import ZenohNetwork
from robot_app.cli import main


def test_keys_are_their_owners_alone_and_are_never_overwritten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["certs", "-o", str(tmp_path / "certs"), "--robot", "192.168.123.164", "--name", "g1.local", "--json"]
    assert main(command) == 0
    files = [Path(name) for name in json.loads(capsys.readouterr().out)["files"]]
    keys = [file for file in files if file.suffix == ".key"]
    assert {file.name for file in keys} == {
        f"{name}.key" for name in ("ca", "viewers-ca", "robot", "viewers", "workstation", "viewer", "operator", "agent")
    }
    assert {stat.S_IMODE(file.stat().st_mode) for file in keys} == {0o600}
    before = {file: file.read_bytes() for file in files}
    assert main(command) == 1
    assert "never overwritten" in capsys.readouterr().err
    assert {file: file.read_bytes() for file in files} == before
    robot = x509.load_pem_x509_certificate((tmp_path / "certs" / "robot" / "robot.pem").read_bytes())
    names = robot.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert "g1.local" in names.get_values_for_type(x509.DNSName)
    assert "192.168.123.164" in map(str, names.get_values_for_type(x509.IPAddress))
    assert not (tmp_path / "certs" / "viewer" / "workstation.key").exists()


@pytest.mark.parametrize(
    "words",
    [
        ["--namespace", 'g1"]x **'],
        ["--namespace", "/g1/*"],
        ["--namespace", "g1//a"],
        ["--name", "http://x y"],
        ["--name", "bäd host"],
        ["--name", "g1..local"],
        ["--name", "-g1"],
        ["--name", "g1\n"],
        ["--installed", "somewhere"],
        ["--installed", '/etc/"x'],
    ],
)
def test_what_is_no_name_is_refused_before_anything_is_written(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["certs", "-o", str(tmp_path / "certs"), "--robot", "192.168.123.164", *words])
    assert ended.value.code == 2
    assert words[0] in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_site_that_cannot_be_made_leaves_nothing_in_the_way_of_the_next_attempt(tmp_path: Path) -> None:
    with pytest.raises(ValueError):
        make_network(tmp_path / "certs", ZenohNetwork("127.0.0.1"), ["bäd host"], time.time_ns(), days=2)
    assert not list(tmp_path.iterdir())
    make_network(tmp_path / "certs", ZenohNetwork("127.0.0.1"), ["g1.local"], time.time_ns(), days=2)
    assert stat.S_IMODE((tmp_path / "certs").stat().st_mode) == 0o700


@pytest.mark.parametrize("address", ["0.0.0.0", "robot", "224.0.0.1"])
def test_a_robot_that_would_listen_everywhere_is_refused(
    address: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["certs", "-o", str(tmp_path / "certs"), "--robot", address])
    assert "address" in capsys.readouterr().err
    assert not (tmp_path / "certs").exists()
