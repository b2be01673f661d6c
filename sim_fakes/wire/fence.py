"""Determinism over real wires: time in the simulation goes on only when the driver has seen what was sent so far."""

from __future__ import annotations

import threading

from drivers.ros.zenoh_link import ZenohLink
from sim_fakes.wire.sim_bridge import SimBridge

KEY = "sim/fence"
RETRY_S = 0.2  # a sample put before the driver's subscription is known everywhere goes nowhere


class Fence:
    """A numbered sample after each batch. One link delivers in order, and our callbacks run on its receiving thread in
    that order, so once the number is seen everything before it has been used. Costs about 0.7 ms of wall time.

    Make it after the driver's ports have started: then their subscriptions are known once the fence's is.
    """

    def __init__(self, bridge: SimBridge, link: ZenohLink, timeout_s: float = 5.0) -> None:
        self._bridge, self._link, self._timeout_s = bridge, link, timeout_s
        self._sent, self._seen, self._arrival = 0, 0, threading.Condition()
        link.subscribe(KEY, self._arrived)
        bridge.on_flush(self.wait)

    def wait(self) -> None:
        """Return once the driver has seen all samples so far; at once where either end is closed."""
        self._sent += 1
        for _ in range(round(self._timeout_s / RETRY_S)):
            if not (self._bridge.open and self._link.alive):
                return
            self._bridge.put(KEY, self._sent.to_bytes(8, "little"))
            with self._arrival:
                if self._arrival.wait_for(lambda: self._seen >= self._sent, RETRY_S):
                    return
        raise RuntimeError(f"The driver has not seen fence {self._sent} within {self._timeout_s} s.")

    def _arrived(self, payload: bytes) -> None:
        with self._arrival:
            self._seen = int.from_bytes(payload, "little")
            self._arrival.notify_all()
