"""A bad cable between the emulated lidar and the host: faults on demand, the same ones for the same seed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from sim_fakes.sensors.livox_stream import Outgoing


@dataclass
class LivoxFaults:
    """Probabilities per points or IMU datagram; `silent` sends nothing at all. Change them at any time.

    `counts` says how often each fault was done.
    """

    seed: int = 0
    drop: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0  # swapped with the next datagram of its channel
    flip: float = 0.0  # one bit
    truncate: float = 0.0
    wrong_version: float = 0.0
    silent: bool = False
    counts: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        self._held: dict[str, Outgoing] = {}

    def apply(self, outgoing: Iterable[Outgoing]) -> list[Outgoing]:
        """What comes out at the other end."""
        if self.silent:
            return []
        return [arrived for sent in outgoing for arrived in self._one(sent)]

    def _one(self, sent: Outgoing) -> list[Outgoing]:
        if sent.channel not in ("points", "imu"):
            return [sent]
        if self._happens("drop"):
            return []
        for name, damage in self._damages().items():
            if self._happens(name):
                sent = sent._replace(datagram=damage(sent.datagram))
        copies = [sent, sent] if self._happens("duplicate") else [sent]
        return self._in_some_order(sent.channel, copies)

    def _in_some_order(self, channel: str, copies: list[Outgoing]) -> list[Outgoing]:
        held = self._held.pop(channel, None)
        if held is not None:
            return [*copies, held]
        if self._happens("reorder"):
            self._held[channel] = copies[-1]
            return copies[:-1]
        return copies

    def _damages(self) -> dict[str, Callable[[bytes], bytes]]:
        return {"flip": self._flipped, "truncate": self._truncated, "wrong_version": lambda data: b"\x07" + data[1:]}

    def _flipped(self, data: bytes) -> bytes:
        bit = int(self._rng.integers(8 * len(data)))
        return data[: bit // 8] + bytes([data[bit // 8] ^ 1 << bit % 8]) + data[bit // 8 + 1 :]

    def _truncated(self, data: bytes) -> bytes:
        return data[: int(self._rng.integers(len(data)))]

    def _happens(self, name: str) -> bool:
        happens = getattr(self, name) > 0 and self._rng.random() < getattr(self, name)
        self.counts[name] += happens
        return bool(happens)
