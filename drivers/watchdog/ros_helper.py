"""Cancels goals with rclpy, for a robot whose Python has it and has no cyclonedds wheel (ARM).

Run by the robot's own ROS Python as a script: it imports nothing of ours. Lines in: "cancel TRIP". Lines out, JSON:
{"trip": TRIP, "code": CODE} for an answer, {"servers": N, "driving": BOOL} five times a second. It ends with its input.
"""

import json
import sys
import threading

REJECTED = 1  # action_msgs/CancelGoal
PENDING_MAX = 32  # unanswered cancels that are kept


def say(**words):  # type: ignore[no-untyped-def]  # runs under the robot's Python
    print(json.dumps(words), flush=True)


def main(action):  # type: ignore[no-untyped-def]
    import rclpy
    from action_msgs.msg import GoalStatusArray
    from action_msgs.srv import CancelGoal
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    rclpy.init()
    node = rclpy.create_node("openbelief_watchdog")
    client = node.create_client(CancelGoal, f"{action}/_action/cancel_goal")
    running, asked = set(), []  # type: ignore[var-annotated]  # uuids; the newest questions
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE)

    def servers():  # type: ignore[no-untyped-def]
        """Each action server publishes one status topic."""
        return node.count_publishers(f"{action}/_action/status") if client.service_is_ready() else 0

    def hear(array):  # type: ignore[no-untyped-def]
        """Of several servers each tells its own goals only, so what it does not name stays."""
        for status in array.status_list:
            (running.add if status.status in (1, 2) else running.discard)(bytes(status.goal_info.goal_id.uuid))

    def tell():  # type: ignore[no-untyped-def]
        count = servers()
        if not count:
            running.clear()  # a Nav2 that is started again knows none of them
        say(servers=count, driving=bool(running))

    def answer(trip, reply):  # type: ignore[no-untyped-def]
        """rclpy gives the first of several answers, and a server on it refuses with "ok": each goal must be named."""
        named = {bytes(info.goal_id.uuid) for info in reply.goals_canceling}
        say(trip=trip, code=reply.return_code if reply.return_code or running <= named else REJECTED)

    def cancel(trip):  # type: ignore[no-untyped-def]
        future = client.call_async(CancelGoal.Request())  # zero uuid, zero stamp: every goal
        future.add_done_callback(lambda done: answer(trip, done.result()))
        asked.append(future)
        if len(asked) > PENDING_MAX:
            client.remove_pending_request(asked.pop(0))

    def listen():  # type: ignore[no-untyped-def]
        for line in sys.stdin:
            word, _, trip = line.strip().partition(" ")
            if word == "cancel":
                wanted.append(int(trip))
                guard.trigger()
        guard.trigger()
        ended.set()

    def obey():  # type: ignore[no-untyped-def]
        while wanted:
            cancel(wanted.pop(0))

    wanted, ended = [], threading.Event()
    guard = node.create_guard_condition(obey)
    node.create_subscription(GoalStatusArray, f"{action}/_action/status", hear, latched)
    node.create_timer(0.2, tell)
    threading.Thread(target=listen, daemon=True).start()
    while rclpy.ok() and not ended.is_set():
        rclpy.spin_once(node, timeout_sec=0.1)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "/navigate_to_pose")
