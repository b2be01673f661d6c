"""What the terminal says of the console: where it is, and a link that logs one browser in, once."""

from __future__ import annotations

import sys
from typing import TextIO

from robot_app.console.accounts import Role
from robot_app.console.server import Server
from robot_app.console.sessions import PAIRING_S


class Invitation:
    """Prints a fresh link each time; where other machines reach the console, as a QR code too."""

    def __init__(self, server: Server, name: str, screen: TextIO | None = None) -> None:
        self._server, self._name, self._screen = server, name, screen or sys.stderr

    def operator(self) -> None:
        self._link("operator")

    def viewer(self) -> None:
        self._link("viewer")

    def again(self) -> None:
        """An empty line ends nothing while pages are served."""
        words = f"The console stays at {self._server.url}; Ctrl-C ends. Type pair for a link."
        print(words, file=self._screen, flush=True)

    def _link(self, role: Role) -> None:
        url = self._server.pairing_url(self._name if role == "operator" else "viewer", role)
        print(f"Open once, within {PAIRING_S / 60:.0f} minutes, as {role}: {url}", file=self._screen)
        if self._server.reachable:
            import segno

            segno.make(url, error="l", micro=False).terminal(out=self._screen, compact=True)
        self._screen.flush()
