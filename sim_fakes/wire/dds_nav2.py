"""Nav2 on DDS, as far as a watchdog needs it: a goal that runs, its status, and the cancel service.

`python -m sim_fakes.wire.dds_nav2 DOMAIN` drives until it is cancelled, printing one JSON line per event with its
moment on the monotonic clock. A line "drive" on standard input begins anew; it ends when its standard input does.
"""

from __future__ import annotations

import json
import queue
import sys
import threading
import time

from drivers.dds.action import (
    CANCEL_REQUEST,
    CANCEL_RESPONSE,
    STATUS_ARRAY,
    ActionTopics,
    with_header,
    without_header,
)
from drivers.dds.raw import DdsPeer
from drivers.ros import action
from drivers.ros.messages import WireError, codec
from drivers.topics import NAVIGATE_TO_POSE
from sim_fakes.wire.nav2_messages import Nav2Messages, ServedGoal

TICK_S = 0.005


class DdsNav2:
    """One goal. refuses: cancels are answered with "rejected"; mute: they are obeyed and not answered."""

    def __init__(self, peer: DdsPeer) -> None:
        topics = ActionTopics(NAVIGATE_TO_POSE)
        self._requests = peer.reader(topics.cancel_request, CANCEL_REQUEST)
        self._replies = peer.writer(topics.cancel_reply, CANCEL_RESPONSE)
        self._statuses = peer.writer(topics.status, STATUS_ARRAY, latched=True)
        self._codec, self._say = codec(), Nav2Messages(codec())
        self.refuses = self.mute = False
        self.cancels: list[tuple[int, bool]] = []  # (monotonic ns, whether it asked for every goal)
        self.goal = ServedGoal(bytes(range(16)), None, 0, status=action.CANCELED)

    def drive(self) -> None:
        self.goal.status = action.EXECUTING
        self._tell()

    def step(self) -> None:
        """Serve what was asked since the last call."""
        for payload in self._requests.take():
            found = without_header(payload)
            if found is None:
                continue
            try:
                info = self._codec.decode(found[0], CANCEL_REQUEST).goal_info
            except WireError:
                continue
            self.cancels.append((time.monotonic_ns(), bytes(info.goal_id.uuid) == action.ALL_GOALS))
            self._answer(*found[1:])

    def _answer(self, client: int, sequence: int) -> None:
        code, canceling = action.CANCEL_REJECTED, []
        if not self.refuses:
            code, canceling = action.CANCEL_OK, [self.goal] if self.goal.status == action.EXECUTING else []
            self.goal.status = action.CANCELED
            self._tell()
        if not self.mute:
            reply = self._codec.encode(self._say.cancelled(code, canceling))
            self._replies.write(with_header(reply, client, sequence))

    def _tell(self) -> None:
        self._statuses.write(self._codec.encode(self._say.statuses([self.goal])))


def _read(lines: queue.SimpleQueue[str | None]) -> None:
    for line in sys.stdin:
        lines.put(line.strip())
    lines.put(None)


def main() -> None:
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(lines,), daemon=True).start()
    with DdsPeer(int(sys.argv[1])) as peer:
        nav2 = DdsNav2(peer)
        nav2.drive()
        print(json.dumps({"driving": True}), flush=True)
        while True:
            try:
                line = lines.get(timeout=TICK_S)
            except queue.Empty:
                line = ""
            if line is None:
                return
            if line == "drive":
                nav2.drive()
                print(json.dumps({"driving": True}), flush=True)
            nav2.step()
            for at_ns, every in nav2.cancels:
                print(json.dumps({"cancel_ns": at_ns, "all": every}), flush=True)
            nav2.cancels.clear()


if __name__ == "__main__":
    main()
