"""The Zenoh session of the workstation: the only driver module that imports zenoh."""

from __future__ import annotations

import json
import logging
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import zenoh
from zenoh import ext
from zenoh.handlers import Callback

from drivers.ports import LinkLost, PortError
from drivers.repeats import Repeats
from drivers.topics import MAX_BYTES
from openbelief.lifetime import Lifetime

logger = logging.getLogger(__name__)
KIB = 1 << 10
LISTEN_TRIES = 5
TARGET = zenoh.QueryTarget.ALL  # ALL_COMPLETE finds nothing behind the bridge
EACH = zenoh.ConsolidationMode.NONE  # else the replies of two servers under one key are merged into one


@dataclass(frozen=True)
class LinkConfig:
    """endpoints: where the bridge or router listens, like "tcp/192.168.123.164:7447" or "tls/...".

    tls: passed on to zenoh's `transport/link/tls` as it is (root_ca_certificate, connect_private_key,
    connect_certificate, enable_mtls, verify_name_on_connect). lease_s: after how long a silent workstation counts as
    gone at the other end; how fast we notice a silent bridge is the bridge's own lease.
    """

    endpoints: tuple[str, ...]
    tls: Mapping[str, Any] = field(default_factory=dict)
    lease_s: float = 2.0
    max_message_bytes: int = MAX_BYTES + 64 * KIB

    def zenoh(self, mode: str = "client") -> zenoh.Config:
        """A client never scouts: it connects to its endpoints or not at all."""
        config = zenoh.Config()
        values = {
            "mode": mode,
            "scouting/multicast/enabled": False,
            "scouting/gossip/enabled": False,
            "scouting/delay": 0,
            "transport/shared_memory/enabled": False,  # a pool of locked memory for each session, kept after its end
            "transport/link/tx/lease": round(self.lease_s * 1000),
            "transport/link/rx/max_message_size": self.max_message_bytes,
            ("listen" if mode == "router" else "connect") + "/endpoints": list(self.endpoints),
        }
        if mode == "client":
            values["listen/endpoints"] = []
        if self.tls:
            values["transport/link/tls"] = dict(self.tls)
        for key, value in values.items():
            config.insert_json5(key, json.dumps(value))
        return config


@dataclass(frozen=True)
class Replies:
    """What a query brought. With neither: no queryable, one that could not read the request, or a dead link."""

    payloads: tuple[bytes, ...] = ()
    errors: tuple[str, ...] = ()


class ZenohLink(Lifetime):
    """One session. Callbacks run on Zenoh's network thread, in the order of arrival: they must be short, never block.

    What a callback raises is logged, kept, and raised by the next `check()`.
    """

    def __init__(self, config: LinkConfig) -> None:
        self.config = config
        self._session: zenoh.Session | None = None
        self._declared: list[Any] = []
        self._failure: Exception | None = None
        self._repeats = Repeats()
        self._lock = threading.Lock()

    def start(self) -> None:
        try:
            self._session = zenoh.open(self.config.zenoh())
        except zenoh.ZError as error:
            raise LinkLost(
                f"Nothing answers at {', '.join(self.config.endpoints)}: start zenoh-bridge-ros2dds on the robot "
                "and check the network."
            ) from error

    def close(self) -> None:
        """End the session; queries under way end empty. Closing twice is allowed."""
        if self._session is not None and not self._session.is_closed():
            try:
                self._session.close()
            except zenoh.ZError as error:  # a link that fell silent cannot say goodbye; zenoh gives up after 10 s
                logger.warning("the Zenoh link did not close in time: %s", str(error).split(" at /")[0])
        self._declared.clear()

    @property
    def alive(self) -> bool:
        """True while a bridge or router is connected; Zenoh reconnects by itself."""
        session = self._session
        return session is not None and not session.is_closed() and bool(session.info.routers_zid())

    def check(self) -> None:
        """Raise what a callback of ours failed with, once; it is a fault of this program, not of the wire."""
        with self._lock:
            failure, self._failure = self._failure, None
        if failure is not None:
            raise PortError(f"A message handler failed: {type(failure).__name__}: {failure}") from failure

    def subscribe(self, key: str, callback: Callable[[bytes], None], *, history: bool = False) -> None:
        """Every payload put on that key; with `history` the last one put before we came too (latched topics)."""
        handler = Callback(self._guard(lambda sample: callback(sample.payload.to_bytes())), indirect=False)
        if history:
            late = ext.HistoryConfig(detect_late_publishers=True)
            self._declared.append(ext.declare_advanced_subscriber(self._open, key, handler, history=late))
        else:
            self._declared.append(self._open.declare_subscriber(key, handler))

    def watch_tokens(self, pattern: str, callback: Callable[[str, bool], None]) -> None:
        """Liveliness tokens as they come (True) and go (False), those already there first."""
        put = zenoh.SampleKind.PUT
        handler = Callback(self._guard(lambda s: callback(str(s.key_expr), s.kind == put)), indirect=False)
        self._declared.append(self._open.liveliness().declare_subscriber(pattern, handler, history=True))

    def declare_token(self, key: str) -> None:
        """A liveliness token of our own: it goes when this session ends, however it ends."""
        self._declared.append(self._open.liveliness().declare_token(key))

    def answer(self, key: str, handler: Callable[[bytes], bytes], *, elsewhere: Executor | None = None) -> None:
        """Answer the queries on a key; a handler that raises leaves the query without a reply.

        elsewhere: where the handler runs if it takes long; None is the network's own thread.
        """

        def reply(query: zenoh.Query) -> None:
            query.reply(query.key_expr, handler(query.payload.to_bytes() if query.payload else b""))
            query.drop()

        replying = self._guard(reply)
        handle = replying if elsewhere is None else lambda query: elsewhere.submit(replying, query)
        self._declared.append(self._open.declare_queryable(key, Callback(handle, indirect=False)))

    def put(self, key: str, payload: bytes, *, drop: bool = False) -> None:
        """Publish; a put that an access rule denies vanishes silently, so nothing that matters is a put.

        drop: rather lose it than wait where the link is full.
        """
        full = zenoh.CongestionControl.DROP if drop else zenoh.CongestionControl.BLOCK
        try:
            self._open.put(key, payload, congestion_control=full)
        except zenoh.ZError as error:  # closed between our look and the put
            raise LinkLost("The Zenoh link is closed.") from error

    def get(self, key: str, payload: bytes, timeout_s: float) -> Replies:
        """Ask and wait, for `timeout_s` of wall time at most. Raises LinkLost where the session is closed."""
        done = threading.Event()
        answer: list[Replies] = []

        def keep(replies: Replies) -> None:
            answer.append(replies)
            done.set()

        self.get_later(key, payload, timeout_s, keep)
        # Zenoh ends every query itself; the margin is for a loaded machine.
        return answer[0] if done.wait(timeout_s + 1.0) else Replies(errors=("Timeout",))

    def get_later(self, key: str, payload: bytes, timeout_s: float, callback: Callable[[Replies], None]) -> None:
        """Ask without waiting; `callback` gets all replies at once, when the query has ended."""
        payloads: list[bytes] = []
        errors: list[str] = []

        def collect(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                payloads.append(reply.ok.payload.to_bytes())
            elif reply.err is not None:
                errors.append(reply.err.payload.to_bytes().decode(errors="replace"))

        def finish(_: None) -> None:
            callback(Replies(tuple(payloads), tuple(errors)))

        ended = self._guard(finish)
        handler = Callback(self._guard(collect), lambda: ended(None), indirect=False)
        self._open.get(key, handler, target=TARGET, consolidation=EACH, timeout=timeout_s, payload=payload)

    @property
    def _open(self) -> zenoh.Session:
        if self._session is None or self._session.is_closed():
            raise LinkLost("The Zenoh link is closed.")
        return self._session

    def _guard(self, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        """Zenoh prints and forgets what a callback raises; we keep it."""

        def guarded(event: Any) -> None:
            try:
                callback(event)
            except Exception as error:  # kept, and raised again by check()
                if count := self._repeats.due(type(error).__name__):
                    logger.exception("a Zenoh callback failed (%d times so far)", count)
                with self._lock:
                    self._failure = self._failure or error

        return guarded


@contextmanager
def open_router(endpoint: str | None = None, *, lease_s: float = 2.0) -> Iterator[str]:
    """A Zenoh router in this process, for this machine only; yields its endpoint, by default on an ephemeral port.

    lease_s: a connected client takes this router for dead after so long a silence. Raises PortError where nothing can
    listen there.
    """
    session, endpoint = _listen(endpoint, lease_s)
    try:
        yield endpoint
    finally:
        session.close()


def _listen(wanted: str | None, lease_s: float) -> tuple[zenoh.Session, str]:
    """Zenoh does not tell which port it chose, so we choose a free one; somebody may take it first."""
    for attempt in range(LISTEN_TRIES):
        endpoint = wanted or _free_endpoint()
        try:
            return zenoh.open(LinkConfig((endpoint,), lease_s=lease_s).zenoh("router")), endpoint
        except zenoh.ZError as error:
            if wanted or attempt == LISTEN_TRIES - 1:
                raise PortError(
                    f"Nothing can listen at {endpoint}: has another program the port (another `openbelief run`?), "
                    "and is the address this machine's?"
                ) from error
    raise AssertionError("unreachable")


def _free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
