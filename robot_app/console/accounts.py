"""Who may use the console: names, roles and Argon2id hashes in one file that only its owner reads."""

from __future__ import annotations

import functools
import json
import os
import re
import secrets
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, get_args

from openbelief.documents import from_json
from robot_app.cli import Failure

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.kdf.argon2 import Argon2id

Role = Literal["viewer", "operator"]
ROLES: tuple[Role, ...] = get_args(Role)
NAME = re.compile(r"[A-Za-z][A-Za-z0-9._-]{0,31}")
PHC = re.compile(r"\$argon2id\$v=\d+\$m=\d+,t=\d+,p=\d+\$[A-Za-z0-9+/]+\$[A-Za-z0-9+/]+")
OTHERS = 0o077  # a hash can be guessed at by who reads it, and an account made by who writes it
PASSWORD_MIN, PASSWORD_MAX = 10, 200
# RFC 9106's second recommendation: 64 MiB, three passes, four lanes. 0.2 s and more for each guess.
ITERATIONS, LANES, MEMORY_KIB, SALT_BYTES, HASH_BYTES = 3, 4, 64 << 10, 16, 32


@dataclass(frozen=True)
class Account:
    name: str
    role: Role


class AccountEntry(TypedDict):
    """password: its Argon2id hash as a PHC string."""

    role: Role
    password: str


class Accounts:
    """The file, read when it is asked; no file is no accounts. Raises Failure where it cannot be read."""

    def __init__(self, path: Path | None) -> None:
        self.path = path

    def __len__(self) -> int:
        return len(self._entries())

    def names(self) -> dict[str, Role]:
        return {name: entry["role"] for name, entry in self._entries().items()}

    def put(self, name: str, role: Role, password: str) -> None:
        """Add an account, or give it another role and password. Raises Failure on what makes none."""
        if not NAME.fullmatch(name):
            raise Failure(f"A name is 1 to 32 letters, digits, '.', '_' or '-', and begins with a letter: not {name!r}")
        if not PASSWORD_MIN <= len(password) <= PASSWORD_MAX:
            raise Failure(f"A password has {PASSWORD_MIN} to {PASSWORD_MAX} characters")
        self._write({**self._entries(), name: {"role": role, "password": hashed(password)}})

    def remove(self, name: str) -> None:
        entries = self._entries()
        if name not in entries:
            raise Failure(f"{self.path} has no account {name!r}")
        self._write({each: entry for each, entry in entries.items() if each != name})

    def verify(self, name: str, password: str) -> Account | None:
        """The account where the password is its own. Takes as long where there is none of that name."""
        entry = self._entries().get(name)
        right = verified(password[: PASSWORD_MAX + 1], entry["password"] if entry else _nobodys())
        return Account(name, entry["role"]) if entry and right else None

    def _entries(self) -> dict[str, AccountEntry]:
        if self.path is None:
            return {}
        try:
            if self.path.stat().st_mode & OTHERS:
                raise Failure(f"{self.path} can be read or written by others: chmod 600 {self.path}")
            entries = from_json(self.path.read_text(encoding="utf-8"))["accounts"]
            if all(_is_entry(entry) for entry in entries.values()):
                return dict(entries)
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise Failure(f"{self.path} cannot be read as accounts: {error}") from error
        raise Failure(
            f"{self.path} cannot be read as accounts: each has a role ({', '.join(ROLES)}) and the hash of a password;"
            " openbelief accounts add NAME makes one"
        )

    def _write(self, entries: dict[str, AccountEntry]) -> None:
        if self.path is None:
            raise Failure('robot.toml names no accounts: say [console] accounts = "accounts.json"')
        self.path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{self.path.name}.", dir=self.path.parent)  # 0600
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump({"accounts": entries}, file, indent=1)
        Path(name).replace(self.path)


def _is_entry(entry: Any) -> bool:
    return set(entry) == {"role", "password"} and entry["role"] in ROLES and bool(PHC.fullmatch(entry["password"]))


def hashed(password: str) -> str:
    """A PHC string."""
    return _argon2id(os.urandom(SALT_BYTES)).derive_phc_encoded(password.encode())


def verified(password: str, phc: str) -> bool:
    from cryptography.exceptions import InvalidKey
    from cryptography.hazmat.primitives.kdf.argon2 import Argon2id

    try:
        Argon2id.verify_phc_encoded(password.encode(), phc)
    except InvalidKey:
        return False
    return True


def _argon2id(salt: bytes) -> Argon2id:
    from cryptography.hazmat.primitives.kdf.argon2 import Argon2id

    return Argon2id(salt=salt, length=HASH_BYTES, iterations=ITERATIONS, lanes=LANES, memory_cost=MEMORY_KIB)


@functools.cache
def _nobodys() -> str:
    """A hash of a password that nobody knows, of the same cost."""
    return hashed(secrets.token_urlsafe(16))
