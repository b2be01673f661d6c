"""A certificate that no browser could use is refused before anything is opened: its file, what is wrong, what to do."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from robot_app.certs.certificates import issue, make_authority
from robot_app.cli import Failure
from robot_app.config_sections import ConsoleSection
from robot_app.console.accounts import Accounts
from robot_app.console.listening import checked, listening_of

LAN = "192.168.1.5"
DAY_NS = 86_400 * 10**9


def certified(folder: Path, *hosts: str, days_ago: int = 0, name: str = "console") -> ConsoleSection:
    """The [console] section of a certificate for these hosts, issued so long ago for ten days."""
    now_ns = time.time_ns() - days_ago * DAY_NS
    identity = issue(make_authority("site", now_ns, 10), name, hosts, now_ns, 10, server=True)
    folder.mkdir(exist_ok=True)
    identity.write(folder)
    return ConsoleSection(certificate=folder / f"{name}.pem", key=folder / f"{name}.key")


def refusal(settings: ConsoleSection, accounts: Path, where: str = f"{LAN}:8800") -> str:
    with pytest.raises(Failure) as refused:
        checked(listening_of(where), settings, Accounts(accounts))
    assert "\n" not in str(refused.value) and "openbelief certs" in str(refused.value)
    return str(refused.value)


def test_one_for_the_address_or_for_a_name_of_hosts_is_served(tmp_path: Path, accounts: Path) -> None:
    checked(listening_of(f"{LAN}:8800"), certified(tmp_path / "a", LAN), Accounts(accounts))
    named = certified(tmp_path / "b", "robot.lab").model_copy(update={"hosts": ("Robot.Lab",)})
    checked(listening_of(f"{LAN}:8800"), named, Accounts(accounts))
    any_name = certified(tmp_path / "c", "robot.lab").model_copy(update={"hosts": ("other.lab", "robot.lab")})
    checked(listening_of(f"{LAN}:8800"), any_name, Accounts(accounts))


def test_one_for_another_address_is_refused_and_says_for_whom_it_is(tmp_path: Path, accounts: Path) -> None:
    said = refusal(certified(tmp_path, "10.0.0.9"), accounts)
    assert "10.0.0.9" in said and f"not for {LAN}" in said


def test_at_this_machine_alone_any_certificate_that_can_be_used_is(tmp_path: Path) -> None:
    checked(listening_of("8800"), certified(tmp_path, "10.0.0.9"), Accounts(None))


def test_one_that_has_expired_is_refused_with_its_last_day(tmp_path: Path, accounts: Path) -> None:
    assert "is valid from" in refusal(certified(tmp_path, LAN, days_ago=30), accounts)


def test_a_key_that_is_not_its_own_is_refused_before_a_robot_is_opened(tmp_path: Path, accounts: Path) -> None:
    own, other = certified(tmp_path, LAN), certified(tmp_path, LAN, name="other")
    said = refusal(own.model_copy(update={"key": other.key}), accounts)
    assert "console.pem" in said and "other.key" in said and "belong together" in said
    assert "belong together" in refusal(own.model_copy(update={"key": other.key}), accounts, "8800")


@pytest.mark.parametrize("which", ["certificate", "key"])
def test_a_file_that_is_not_there_and_one_that_holds_something_else_are_named(
    tmp_path: Path, accounts: Path, which: str
) -> None:
    section, garbage = certified(tmp_path, LAN), tmp_path / "garbage.pem"
    assert "nothing.pem" in refusal(section.model_copy(update={which: tmp_path / "nothing.pem"}), accounts)
    garbage.write_text("no certificate")
    assert "garbage.pem" in refusal(section.model_copy(update={which: garbage}), accounts)
