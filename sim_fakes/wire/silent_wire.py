"""A TCP relay that can fall silent without closing anything, as a robot walking out of Wi-Fi does."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress
from types import TracebackType


class SilentWire:
    """Forwards both ways between `endpoint` and the target until `cut` or `refuse`; after `mend` it forwards again.

    What was sent meanwhile is lost, as are the connections: both ends find out by their own time-outs.
    """

    def __init__(self, target: str) -> None:
        host, port = target.removeprefix("tcp/").split(":")
        self._target = (host, int(port))
        self._server = socket.create_server(("127.0.0.1", 0))
        self._sockets: list[socket.socket] = []
        self._silent, self._refusing = threading.Event(), threading.Event()

    def __enter__(self) -> SilentWire:
        threading.Thread(target=self._accept, name="wire", daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close([self._server, *self._sockets])

    @property
    def endpoint(self) -> str:
        return f"tcp/127.0.0.1:{self._server.getsockname()[1]}"

    def cut(self) -> None:
        """From now on nothing passes, and nobody is told."""
        self._silent.set()

    def refuse(self) -> None:
        """Close what is open, and let nobody in."""
        self._refusing.set()
        self._close(self._sockets)

    def mend(self) -> None:
        """Close the old connections and let new ones through."""
        self._close(self._sockets)
        self._sockets = []
        self._silent.clear()
        self._refusing.clear()

    def _close(self, sockets: list[socket.socket]) -> None:
        for each in sockets:
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._server.accept()
                if self._refusing.is_set():
                    near.close()
                    continue
                try:
                    far = socket.create_connection(self._target)
                except ConnectionRefusedError:  # nobody there just now; who asks again later gets through
                    near.close()
                    continue
                self._sockets += [near, far]
                for source, sink in ((near, far), (far, near)):
                    threading.Thread(target=self._pump, args=(source, sink), daemon=True).start()

    def _pump(self, source: socket.socket, sink: socket.socket) -> None:
        """An end that closes is told to the other, but not while silent."""
        with suppress(OSError):
            while data := source.recv(65536):
                if not self._silent.is_set():
                    sink.sendall(data)
            if not self._silent.is_set():
                sink.shutdown(socket.SHUT_WR)
