"""DDS with bytes in and bytes out: what ROS 2 nodes on CycloneDDS say and hear, without ROS.

The only module that imports `cyclonedds` (the optional extra `dds`), and only once a peer is opened. A sample is a CDR
payload with its 4-byte encapsulation. Domain and network are those of every DDS program: ROS_DOMAIN_ID, CYCLONEDDS_URI.
"""

from __future__ import annotations

import importlib.util
import os
from contextlib import ExitStack
from types import TracebackType
from typing import Any

TAKEN_AT_ONCE = 64


class DdsUnavailable(RuntimeError):
    """There is no DDS here; the text says why, and the way out."""


def dds_installed() -> bool:
    return importlib.util.find_spec("cyclonedds") is not None


def ros_domain() -> int:
    """The domain that ROS nodes of this environment are in; raises DdsUnavailable where it is no number."""
    text = os.environ.get("ROS_DOMAIN_ID", "0")
    if not text.isdigit() or int(text) > 232:
        raise DdsUnavailable(f"ROS_DOMAIN_ID should be 0 to 232, got {text!r}.")
    return int(text)


class RawWriter:
    def __init__(self, writer: Any, write: Any) -> None:
        self._writer, self._write = writer, write

    def write(self, payload: bytes) -> None:
        """Raises DdsUnavailable where DDS does not take it."""
        code = self._write(self._writer._ref, payload.ljust(-(-len(payload) // 4) * 4, b"\0"))
        if code < 0:
            raise DdsUnavailable(f"DDS did not take a sample (code {code}).")

    @property
    def readers(self) -> int:
        """How many hear it just now."""
        return len(self._writer.get_matched_subscriptions())


class RawReader:
    def __init__(self, reader: Any, take: Any, any_state: int) -> None:
        self._reader, self._take, self._any_state = reader, take, any_state

    def take(self) -> list[bytes]:
        """What came since the last call, oldest first."""
        taken = self._take(self._reader._ref, self._any_state, TAKEN_AT_ONCE)
        if isinstance(taken, int):
            raise DdsUnavailable(f"DDS gave no samples (code {taken}).")
        return [bytes(payload) for payload, about in taken if about.valid_data]

    @property
    def writers(self) -> int:
        return len(self._reader.get_matched_publications())


class DdsPeer:
    """A participant of its own. Types go by their ROS name, "action_msgs/srv/CancelGoal_Request"; their fields are the
    business of who makes the bytes."""

    def __init__(self, domain: int) -> None:
        self._domain, self._opened = domain, ExitStack()

    def __enter__(self) -> DdsPeer:
        """Raises DdsUnavailable."""
        try:
            from cyclonedds.core import DDSException
            from cyclonedds.domain import DomainParticipant
        except ImportError as error:
            raise DdsUnavailable("cyclonedds is not installed: pip install 'openbelief[dds]'.") from error
        try:
            self._participant = DomainParticipant(self._domain)
        except DDSException as error:
            raise DdsUnavailable(f"DDS cannot be joined in domain {self._domain}: {error}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        del self._participant

    def writer(self, topic: str, type_name: str, *, latched: bool = False) -> RawWriter:
        from cyclonedds._clayer import ddspy_write
        from cyclonedds.pub import DataWriter

        qos = _qos(latched)
        return RawWriter(DataWriter(self._participant, self._topic(topic, type_name, qos), qos=qos), ddspy_write)

    def reader(self, topic: str, type_name: str, *, latched: bool = False) -> RawReader:
        from cyclonedds._clayer import ddspy_take
        from cyclonedds.core import InstanceState, SampleState, ViewState
        from cyclonedds.sub import DataReader

        qos = _qos(latched)
        reader = DataReader(self._participant, self._topic(topic, type_name, qos), qos=qos)
        return RawReader(reader, ddspy_take, SampleState.Any | ViewState.Any | InstanceState.Any)

    def _topic(self, topic: str, type_name: str, qos: Any) -> Any:
        from cyclonedds.idl import make_idl_struct
        from cyclonedds.idl.types import uint8
        from cyclonedds.topic import Topic

        package, kind, name = type_name.split("/")
        message = make_idl_struct(f"{name}_", f"{package}.{kind}.dds_.{name}_", {"octet": uint8})
        return Topic(self._participant, topic, message, qos=qos)


def _qos(latched: bool) -> Any:
    """The quality of service that ROS uses for services, and for latched topics."""
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.util import duration

    return Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)),
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(1 if latched else 10),
    )
