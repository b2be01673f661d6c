"""A workstation that drives: beats, sends one goal, and lets it run; to be killed, stopped or cut off.

`python -m sim_fakes.wire.workstation_process ENDPOINT` prints one JSON line when its goal is under way. It ends in good
order when its standard input does.
"""

from __future__ import annotations

import json
import sys
import uuid

from drivers.ros.action import ActionClient
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.convert import pose_message
from drivers.ros.shapes import shapes_of
from drivers.ros.zenoh_link import LinkConfig, ZenohLink
from drivers.topics import NAVIGATE_TO_POSE
from drivers.watchdog.heartbeat import Heartbeat
from openbelief.pose import Pose2


def main() -> None:
    with ZenohLink(LinkConfig((sys.argv[1],))) as link, Heartbeat(link) as heartbeat:
        navigate = ActionClient(link, BridgeKeys(), NAVIGATE_TO_POSE, shapes_of("jazzy"))
        answer = navigate.send_goal(uuid.uuid4().bytes, 2.0, pose=pose_message(Pose2(1.0, 1.0, 0.0)))
        accepted = answer.message is not None and bool(answer.message.accepted)
        print(json.dumps({"workstation": heartbeat.workstation, "driving": accepted, "why": answer.why}), flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main()
