"""The robot's end of the wire: a Zenoh session with the keys and tokens of zenoh-bridge-ros2dds."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import zenoh
from zenoh import ext

from drivers.ros.bridge_keys import BridgeKeys, Keys, bridge_version_key
from drivers.ros.zenoh_link import LinkConfig
from drivers.topics import Action, Topic
from openbelief.lifetime import Lifetime

logger = logging.getLogger(__name__)
BLOCK = zenoh.CongestionControl.BLOCK  # a simulation loses nothing by accident


@dataclass(frozen=True)
class PendingQuery:
    """One query that waits. It ends when it is answered or dropped; a query that is kept runs into its time-out."""

    payload: bytes
    query: zenoh.Query

    def answer(self, payload: bytes) -> None:
        self.query.reply(self.query.key_expr, payload)
        self.query.drop()

    def drop(self) -> None:
        """End it without a reply."""
        self.query.drop()


class SimBridge(Lifetime):
    """One session with its own identity. Handlers of questions run on threads of their own, never on the clock's.

    `flush` runs after each batch of samples: a Fence registers there, so that the driver has seen all of them.
    """

    version = '"1.10.0"'  # as the bridge writes it: JSON

    def __init__(self, endpoint: str, keys: Keys | None = None) -> None:
        self.keys = keys or BridgeKeys()
        self._config = LinkConfig((endpoint,)).zenoh()
        self._config.insert_json5("timestamping/enabled", "true")  # latched publishers need it
        self._session: zenoh.Session | None = None
        self._publishers: dict[str, Any] = {}
        self._tokens: dict[str, Any] = {}
        self._fences: list[Callable[[], None]] = []
        self._unfenced = False  # something was put since the last fence
        self._failure: Exception | None = None
        self._lock = threading.Lock()

    def start(self) -> None:
        self._session = zenoh.open(self._config)
        self._token(self.keys.bridge_token(self._zid))
        self.answer(bridge_version_key(self._zid), lambda question: question.answer(self.version.encode()))

    def close(self) -> None:
        """What kill does: every token, publisher and query ends at once."""
        if self._session is not None:
            self._session.close()

    @property
    def open(self) -> bool:
        return self._session is not None and not self._session.is_closed()

    def offer(self, action: Action) -> None:
        """Declare the liveliness token of an action server."""
        self._token(self.keys.action_token(action, self._zid))

    def withdraw(self, action: Action) -> None:
        """Take the token away, as when the action server's node died."""
        self._tokens.pop(self.keys.action_token(action, self._zid)).undeclare()

    def answer(self, key: str, handler: Callable[[PendingQuery], None]) -> None:
        """Let `handler` answer the queries on a key."""

        def guarded(query: zenoh.Query) -> None:
            try:
                handler(PendingQuery(query.payload.to_bytes() if query.payload else b"", query))
            except Exception as error:  # kept, and raised again by flush()
                logger.exception("the simulated bridge failed on %s", key)
                with self._lock:
                    self._failure = self._failure or error
                query.drop()

        self._publishers[key] = self._opened.declare_queryable(key, guarded)

    def publish(self, topic: Topic, payload: bytes) -> None:
        """Put a sample; latched topics keep their last one for who comes later."""
        self.put(self.keys.topic(topic), payload, latched=topic.latched)

    def put(self, key: str, payload: bytes, *, latched: bool = False) -> None:
        if not self.open:
            return  # a killed bridge is silent
        if key not in self._publishers:
            self._publishers[key] = self._publisher(key, latched)
        self._publishers[key].put(payload)
        self._unfenced = True

    def on_flush(self, fence: Callable[[], None]) -> None:
        self._fences.append(fence)

    def flush(self) -> None:
        """Wait at every fence where something was put since; raises what a handler failed with."""
        with self._lock:
            failure, self._failure = self._failure, None
        if failure is not None:
            raise failure
        if self._unfenced:
            for fence in self._fences:
                fence()
            self._unfenced = False

    def _publisher(self, key: str, latched: bool) -> Any:
        if not latched:
            return self._opened.declare_publisher(key, congestion_control=BLOCK)
        last_one = ext.CacheConfig(max_samples=1)
        return ext.declare_advanced_publisher(
            self._opened, key, cache=last_one, publisher_detection=True, congestion_control=BLOCK
        )

    def _token(self, key: str) -> None:
        self._tokens[key] = self._opened.liveliness().declare_token(key)

    @property
    def _zid(self) -> str:
        return str(self._opened.zid())

    @property
    def _opened(self) -> zenoh.Session:
        if self._session is None:
            raise RuntimeError("Open the simulated bridge first: `with SimBridge(endpoint) as bridge`.")
        return self._session
