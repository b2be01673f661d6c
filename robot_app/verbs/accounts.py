"""Who may use the console: names with a password and a role, in the file that [console] accounts names.

An operator may take the command, ask and answer; a viewer may look. Whoever is logged in may stop the robot. A password
is asked for, or read from standard input where that is no terminal; the file keeps its Argon2id hash only.
"""

from __future__ import annotations

import argparse
import getpass
import sys
from pathlib import Path

from robot_app.cli import Failure, Usage, print_json

EXAMPLE = "openbelief accounts list --config demo-out/robot.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", choices=["list", "add", "remove"])
    parser.add_argument("name", nargs="?", help="of the account to add (or to change) or to remove")
    parser.add_argument("--role", choices=["viewer", "operator"], default="viewer", help="default viewer")
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )


def run(options: argparse.Namespace) -> None:
    from robot_app.config import ConfigError, load_config
    from robot_app.console.accounts import Accounts

    if (options.what == "list") != (options.name is None):
        raise Usage(f"accounts {options.what}: {'no name is needed' if options.name else 'whose account?'}")
    try:
        accounts = Accounts(load_config(options.config).console.accounts)
    except ConfigError as error:
        raise Failure(str(error)) from error
    if options.what == "add":
        accounts.put(options.name, options.role, _password())
    elif options.what == "remove":
        accounts.remove(options.name)
    if options.json:
        print_json({"accounts": accounts.names()})
    else:
        print("\n".join(f"{name}  {role}" for name, role in sorted(accounts.names().items())) or "no accounts")


def _password() -> str:
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\n")
    first = getpass.getpass("Password (10 characters or more): ")
    if getpass.getpass("Again: ") != first:
        raise Failure("Those were two different passwords: nothing was changed")
    return first
